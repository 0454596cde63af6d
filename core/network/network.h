/* A geometric neural operator ready to run: architecture and parameters. */
#ifndef GNP_CORE_NETWORK_H
#define GNP_CORE_NETWORK_H

#include <stddef.h>

#include "core/network/architecture.h"

/* Immutable, so threads share it. */
struct gnp_network {
	struct gnp_architecture architecture;
	struct gnp_layout layout;
	const float *parameters; /* (layout.total) */
};

/* Copies the parameters (layout.total floats). On failure *out is unchanged. */
gnp_status gnp_network_create(const struct gnp_architecture *architecture, const float *parameters,
                              struct gnp_network **out, struct gnp_error *error);
void gnp_network_free(struct gnp_network *network);

/* The tensor of a name the layout has. */
const float *gnp_network_tensor(const struct gnp_network *network, const char *name);

/* Patches as the trunk sees them. Rows start[p] .. start[p + 1] - 1 of the arrays are the nodes of patch p: first the
 * `inner` that the head's mean is over, the centre before all, then the buffer. Features begin with u and v.
 * Borrowed. */
struct gnp_network_batch {
	size_t patches;
	const size_t *start;  /* (patches + 1), from 0 */
	const size_t *inner;  /* (patches) 1 .. nodes of the patch */
	const float *nodes;   /* (start[patches], features) */
};

#endif
