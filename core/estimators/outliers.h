/* Finds the points that do not lie on the surface their neighbours agree on.
 *
 * Overlapping patches each make a robust fit to the points of their centre's sheet (L1, then Tukey's biweight, by
 * iteratively reweighted least squares, scale by the median absolute deviation with degrees of freedom corrected) and
 * judge the points near their centre; a point is an outlier when the median of the judgements by patches of its own
 * sheet (by all, where hardly any are) exceeds the cut. A patch with too few points to leave the fit a choice does not
 * judge. Nothing need be known of the noise. */
#ifndef GNP_CORE_OUTLIERS_H
#define GNP_CORE_OUTLIERS_H

#include "core/base/pool.h"
#include "core/search/neighbors.h"

/* points (count, 3) in curve order, normals (count, 3) unit, count >= 12. outlier (count) out: 1 or 0.
 * Deterministic. */
gnp_status gnp_outliers_find(const double *points, const double *normals, size_t count,
                             const struct gnp_neighbors *neighbors, struct gnp_pool *pool, struct gnp_task *task,
                             unsigned char *outlier, struct gnp_error *error);

#endif
