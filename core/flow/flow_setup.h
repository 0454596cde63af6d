/* From a flow's options and its cloud to lengths, where what is left open follows the cloud's spacing and what cannot
 * work is refused, and to the memory it takes. */
#ifndef GNP_CORE_FLOW_SETUP_H
#define GNP_CORE_FLOW_SETUP_H

#include "core/flow/flow_measure.h"
#include "core/flow/flow_options.h"
#include "core/flow/flow_result.h"
#include "core/flow/flow_step.h"

/* All lengths, and what *result has of spacings. The prepared cloud is the flow's at the start. */
gnp_status gnp_flow_setup(const struct gnp_flow_options *options, const struct gnp_prepared *prepared,
                          struct gnp_pool *pool, struct gnp_task *task, struct gnp_flow_rule *rule,
                          struct gnp_flow_move *move, struct gnp_flow *result, struct gnp_error *error);

/* dt, where it is left open by the start's spacings, of explicit steps by what is dense now. */
double gnp_flow_default_step(const struct gnp_flow_options *options, const struct gnp_flow *result, double dense);

/* Peak bytes gnp_flow_run may allocate for count points, for admission control: 450 to 800 a point, and the snapshots.
 * given: the cloud comes with normals. */
size_t gnp_flow_memory(size_t count, bool given, const struct gnp_flow_options *options);

#endif
