/* Finds points and clusters far from all surface, before any surface is fitted: the statistical filter for gross
 * outliers.
 *
 * The local spacing at a point is the median, over its 16 nearest, of r / sqrt(6 / pi), r the distance to the sixth
 * neighbour (or the first after it that does not coincide with the point): an isolated point's neighbours lie on the
 * surface, so that its spacing is the surface's. Points at most `link` local spacings apart are linked. Of the pieces
 * that hang together, those of fewer than `cluster` points are isolated, and those whose points are scattered in space
 * rather than along a surface (least variance of the 16 nearest over the sum of all three, on average above 0.1: 0.2
 * for clutter, hardly any for surfaces); the largest piece never is. Points that were displaced along the surface or
 * by less than the link are not told apart by this, and an isolated flat cluster of `cluster` points or more counts as
 * a surface. */
#ifndef GNP_CORE_ISOLATED_H
#define GNP_CORE_ISOLATED_H

#include "core/cloud/prepare.h"

/* link >= 1, cluster >= 1. In the prepared cloud's curve order: isolated (count) out, 0 or 1; away (count) out: of
 * isolated points the distance to the nearest point that is none, in local spacings, at most 1e100, else 0.
 * *isolated_count: how many. task may be NULL. Deterministic for any worker count. O(n log n); 108 bytes a point. */
gnp_status gnp_isolated_find(const struct gnp_prepared *prepared, double link, size_t cluster, struct gnp_pool *pool,
                             struct gnp_task *task, unsigned char *isolated, double *away, size_t *isolated_count,
                             struct gnp_error *error);

#endif
