/* A flow between two steps as bytes, for a later process to go on from: text of a magic and a SHA-256 of the rest, sizes and figures, the
 * arrays of the state, the records and the snapshots so far. In the byte order of the machine; of this build's flows alone. */
#ifndef GNP_CORE_FLOW_CHECKPOINT_H
#define GNP_CORE_FLOW_CHECKPOINT_H

#include "checkpoint.h"
#include "flow_state.h"

/* What a flow is in the middle of, borrowed. */
struct gnp_flow_middle {
	struct gnp_flow_state *now; /* measured */
	struct gnp_flow *result;    /* its records, steps and snapshots */
	size_t cloud_count;         /* points of the caller's cloud */
	size_t steps_most;
	bool conformal;
	double *time, *dt;
	size_t *unsorted;
};

gnp_status gnp_flow_checkpoint_save(const struct gnp_flow_middle *middle, const struct gnp_checkpoint *checkpoint, struct gnp_error *error);

/* Puts a flow that stands at its start where the bytes left it. GNP_INVALID_ARGUMENT for bytes that are damaged, of another version, or of
 * a flow whose start was another one (other points, options or weights). Any bytes may be given. On failure nothing is changed. */
gnp_status gnp_flow_checkpoint_load(const struct gnp_flow_middle *middle, const unsigned char *bytes, size_t size, struct gnp_error *error);

#endif
