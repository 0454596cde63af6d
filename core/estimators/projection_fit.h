/* Fits patches by a network with the projection head: sums, description, trunk, head, solution. */
#ifndef GNP_CORE_PROJECTION_FIT_H
#define GNP_CORE_PROJECTION_FIT_H

#include "core/network/projection.h"
#include "core/network/projection_head.h"
#include "core/network/trunk.h"

/* What the network makes of a batch of patches, in scratch. */
struct gnp_projected {
	size_t patches;
	struct gnp_projection *sums;    /* (patches) */
	struct gnp_projection_fit *fits; /* (patches) */
	float *summary, *nodes, *outputs;
	struct gnp_network_batch batch;
	struct gnp_projection_tape head;
	const struct gnp_trunk_tape *trunk; /* NULL where no tape was wanted */
};

/* Which points of a patch count: positions (at most `most`) out, ascending by distance; their number is returned. */
typedef size_t (*gnp_usable_fn)(const void *context, const struct gnp_patch *patch, size_t most, uint32_t *positions);

/* Sets sums, summary, nodes, batch. GNP_OUT_OF_MEMORY. */
gnp_status gnp_projected_describe(const struct gnp_architecture *architecture, const struct gnp_patch *patches,
                                  size_t count, gnp_usable_fn usable, const void *context, struct gnp_projected *out,
                                  struct gnp_scratch *scratch, struct gnp_error *error);

/* Sets the rest. tape: whether backward will follow. */
gnp_status gnp_projected_solve(const struct gnp_network *network, bool tape, struct gnp_projected *projected,
                               struct gnp_scratch *scratch, struct gnp_error *error);

/* Adds d loss / d parameters to gradient, given dcoefficients (patches, GNP_TAYLOR_SIZE) of the fits'. */
gnp_status gnp_projected_backward(const struct gnp_network *network, const struct gnp_projected *projected,
                                  const double *dcoefficients, float *gradient, struct gnp_scratch *scratch,
                                  struct gnp_error *error);

#endif
