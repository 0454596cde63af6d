/* The layers between the trunk and the projection (projection.h): an MLP from the trunk's mean and the patch's summary
 * to the outputs that the projection is made by. */
#ifndef GNP_CORE_PROJECTION_HEAD_H
#define GNP_CORE_PROJECTION_HEAD_H

#include "core/base/scratch.h"
#include "core/network/network.h"

/* What backward needs of a forward pass; its arrays lie in scratch. */
struct gnp_projection_tape {
	size_t patches;
	float *inputs;     /* (patches, width + summary) */
	float *hidden[2];  /* (patches, head_width) */
};

/* mean (patches, width) of the trunk, summary (patches, gnp_projection_summary) -> outputs (patches,
 * gnp_projection_outputs). The tape stays in scratch. GNP_OUT_OF_MEMORY. */
gnp_status gnp_projection_head_forward(const struct gnp_network *network, size_t patches, const float *mean,
                                       const float *summary, float *outputs, struct gnp_projection_tape *tape,
                                       struct gnp_scratch *scratch, struct gnp_error *error);

/* Adds to gradient (the layout's total); dmean (patches, width) out. GNP_OUT_OF_MEMORY. */
gnp_status gnp_projection_head_backward(const struct gnp_network *network, const struct gnp_projection_tape *tape,
                                        const float *doutputs, float *gradient, float *dmean, struct gnp_scratch *scratch,
                                        struct gnp_error *error);

#endif
