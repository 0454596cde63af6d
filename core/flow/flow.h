/* Mean-curvature flow of a point cloud, x_t = H n (the paper's section on shape deformations): spheres of radius R0
 * shrink by R^2 = R0^2 - 2 t, cylinders by R0^2 - t. */
#ifndef GNP_CORE_FLOW_H
#define GNP_CORE_FLOW_H

#include "core/base/checkpoint.h"
#include "core/flow/flow_options.h"
#include "core/flow/flow_result.h"

/* fixed: (cloud->count) 1 where a point stays where it is, or NULL. When a stop rule other than `steps` holds, the
 * result is the last state that was good; when it already holds of the first step, that is an error that says what
 * would do. Deterministic for any worker count. On failure *out is unchanged. task may be NULL. */
gnp_status gnp_flow_run(const struct gnp_cloud *cloud, const unsigned char *fixed,
                        const struct gnp_flow_options *options, struct gnp_pool *pool, struct gnp_task *task,
                        struct gnp_flow *out, struct gnp_error *error);
/* The same for a flow that outlives its process: between steps it is handed to checkpoint (may be NULL) now and then,
 * and when it is stopped with GNP_DRAINING; it goes on from what was kept if that is of the same flow, else begins at
 * its start. The result is that of a flow that was never interrupted, but for the seconds of the records. */
gnp_status gnp_flow_run_kept(const struct gnp_cloud *cloud, const unsigned char *fixed,
                             const struct gnp_flow_options *options, const struct gnp_checkpoint *checkpoint,
                             struct gnp_pool *pool, struct gnp_task *task, struct gnp_flow *out,
                             struct gnp_error *error);

#endif
