/* Says of each point of an estimated cloud whether it lies where the cloud ends: the quantity `boundary`. */
#ifndef GNP_CORE_ESTIMATE_BOUNDARY_H
#define GNP_CORE_ESTIMATE_BOUNDARY_H

#include "core/base/pool.h"
#include "core/estimate/estimate_patches.h"

/* Writes the column of the outputs. Before, it holds where fits have found that a rim may be; where points were chosen, the
 * whole cloud is looked at, since they are a few of it. */
gnp_status gnp_estimate_boundary(const struct gnp_estimate_work *work, struct gnp_pool *pool, struct gnp_task *task,
                                 struct gnp_error *error);

/* Bytes it may take for so many points. */
size_t gnp_estimate_boundary_memory(size_t count);

#endif
