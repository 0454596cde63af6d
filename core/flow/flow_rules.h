/* The rules that stop a flow between two steps.
 *
 * `singularity` tells a neck that collapses from a surface that was never resolved: a flow that starts with curvatures
 * its points are too few for (edges, noise, details of a scan) first rounds them, and stops only where they become
 * larger than they were. Explicit steps have no such start: they are the paper's. */
#ifndef GNP_CORE_FLOW_RULES_H
#define GNP_CORE_FLOW_RULES_H

#include "core/flow/flow_options.h"
#include "core/flow/flow_result.h"
#include "core/flow/flow_state.h"
#include "core/flow/flow_step.h"

/* Root of the mean area of the state's cells. */
double gnp_flow_mean_spacing(const struct gnp_flow_state *state);

/* How far points jump back on average in a step of dt, in spacings: much for curvatures that are noise. */
double gnp_flow_fling(const struct gnp_flow_state *state, double dt);
/* More than this counts as unstable. */
#define GNP_FLOW_FLING_MOST 0.05

/* Whether the state is one to go on from by a step of move->dt; else result has the reason. result: has the record of
 * the start, and its spacing. */
bool gnp_flow_may_go_on(const struct gnp_flow_options *options, const struct gnp_flow_move *move,
                        const struct gnp_flow_state *now, struct gnp_flow *result);

#endif
