/* A flow between two steps as bytes, for a later process to go on from: text of a magic and a SHA-256 of the rest,
 * sizes and figures, a digest of what the flow was asked for, the arrays of the state, the records and the snapshots so
 * far. In the byte order of the machine; of this build's flows alone. */
#ifndef GNP_CORE_FLOW_CHECKPOINT_H
#define GNP_CORE_FLOW_CHECKPOINT_H

#include "core/base/checkpoint.h"
#include "core/base/sha256.h"
#include "core/flow/flow_options.h"
#include "core/flow/flow_result.h"
#include "core/flow/flow_state.h"

/* What a flow is in the middle of, borrowed. */
struct gnp_flow_middle {
	struct gnp_flow_state *now; /* measured */
	struct gnp_flow *result;    /* its records, steps and snapshots */
	size_t cloud_count;         /* points of the caller's cloud */
	size_t steps_most;
	bool conformal;
	double *time, *dt;
	size_t *unsorted;
	const char *request; /* of gnp_flow_checkpoint_request */
};

/* The digest of everything a flow's result depends on: the caller's cloud, its fixed points, the options, the weights.
 * model: those of the estimator, chosen if they were not given; NULL if it has none. */
void gnp_flow_checkpoint_request(const struct gnp_cloud *cloud, const unsigned char *fixed,
                                 const struct gnp_flow_options *options, const struct gnp_model *model,
                                 char request[GNP_SHA256_TEXT]);

gnp_status gnp_flow_checkpoint_save(const struct gnp_flow_middle *middle, const struct gnp_checkpoint *checkpoint,
                                    struct gnp_error *error);

/* Puts a flow that stands at its start where the bytes left it. GNP_INVALID_ARGUMENT for bytes that are damaged, of
 * another version, or of another flow: its request's digest, or its first record. Any bytes may be given. On failure
 * nothing is changed. */
gnp_status gnp_flow_checkpoint_load(const struct gnp_flow_middle *middle, const unsigned char *bytes, size_t size,
                                    struct gnp_error *error);

#endif
