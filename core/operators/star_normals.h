/* Chooses the normals that the stars of a cloud's points go by (star.h): those from before the estimator's.
 *
 * The estimator's keep to one side of a crease, where the stars of either side would not find each other; the
 * normals that come with a cloud, and those of its neighbourhoods' planes, run on over it. But normals that only
 * say which side is out need not be near the surface's. */
#ifndef GNP_CORE_STAR_NORMALS_H
#define GNP_CORE_STAR_NORMALS_H

#include "core/cloud/prepare.h"

/* prepared->unfitted: where the fitted normals (count, 3) turn away by more than 45 degrees but not to the other
 * side, and the nearest points lie four times nearer to their plane in squares, it becomes those. Deterministic for
 * any worker count. task may be NULL. */
gnp_status gnp_star_normals_choose(struct gnp_prepared *prepared, struct gnp_pool *pool, struct gnp_task *task,
                                   struct gnp_error *error);

#endif
