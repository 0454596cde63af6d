/* What a flow leaves behind: records, snapshots, the cloud at the end. */
#ifndef GNP_CORE_FLOW_RESULT_H
#define GNP_CORE_FLOW_RESULT_H

#include "core/flow/flow_state.h"

/* Appends the row of a step, which is the result's number of steps from then on. gnp_flow_clear frees a half-made result. */
gnp_status gnp_flow_result_record(struct gnp_flow *result, const struct gnp_flow_record *record, struct gnp_error *error);

/* Appends the state, of that record. */
gnp_status gnp_flow_result_snapshot(struct gnp_flow *result, const struct gnp_flow_state *state, const struct gnp_flow_record *record,
                                    struct gnp_error *error);

/* Points, normals, H and indices of the state, in the cloud's order, those inserted last. */
gnp_status gnp_flow_result_take(struct gnp_flow *result, const struct gnp_flow_state *state, struct gnp_error *error);

#endif
