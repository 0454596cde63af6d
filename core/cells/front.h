/* Distances along a surface by fronts that leave the sources and pass from triangle to triangle (fast marching:
 * Kimmel & Sethian 1998).
 *
 * Within a triangle a front is a circle about the place where its source would lie if all triangles on the way were
 * unfolded into this one's plane (Novotni & Klein 2002): exact where the surface unrolls, whatever the distances to
 * the sources, and second order in the spacing of one step elsewhere. Fronts of different sources are kept apart, so
 * that they meet sharply. */
#ifndef GNP_CORE_FRONT_H
#define GNP_CORE_FRONT_H

#include "core/base/task.h"
#include "core/cells/carry.h"
#include "core/cells/fans.h"

/* Where a front may end: `beyond` past the last of these points. */
struct gnp_front_goals {
	const uint32_t *points; /* (count) */
	size_t count;
	double beyond; /* [length]: with twice the longest edge their distances are those of a front that goes everywhere */
};

/* distance (points) out [length]: to the nearest of the sources (count); INFINITY where no way leads, and with goals
 * where the front did not come. shared: the triangles at all their corners (gnp_fans_share). In curve order. carried,
 * goals and task may be NULL. On failure outputs are undefined. */
gnp_status gnp_front_find(const struct gnp_prepared *prepared, const struct gnp_fans *shared, const uint32_t *sources,
                          size_t count, const struct gnp_carried *carried, const struct gnp_front_goals *goals,
                          struct gnp_task *task, double *distance, struct gnp_error *error);

#endif
