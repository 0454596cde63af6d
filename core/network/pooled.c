#include "core/network/pooled.h"

#include <assert.h>

#include "core/network/dense.h"

struct gnp_pooled_tape {
	size_t patches;
	float *mean, *hidden; /* (patches, width), (patches, head_width) */
	const struct gnp_trunk_tape *trunk;
};

struct head {
	const struct gnp_parameter_row *first, *second; /* weights; each bias is the next row */
};

static struct head head_of(const struct gnp_network *network)
{
	bool edge = network->architecture.trunk == GNP_TRUNK_EDGE;
	struct head head = {gnp_layout_find(&network->layout, edge ? "mlp.0.weight" : "proj.0.weight"),
	                    gnp_layout_find(&network->layout, edge ? "mlp.2.weight" : "proj.2.weight")};
	assert(head.first && head.second);
	return head;
}

gnp_status gnp_pooled_forward(const struct gnp_network *network, const struct gnp_network_batch *batch,
                              float *coefficients, const struct gnp_pooled_tape **tape, struct gnp_scratch *scratch,
                              struct gnp_error *error)
{
	const struct gnp_architecture *a = &network->architecture;
	const float *parameters = network->parameters;
	struct head head = head_of(network);
	struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
	struct gnp_pooled_tape *kept = gnp_scratch_take(scratch, 1, sizeof *kept);
	float *mean = gnp_scratch_take(scratch, batch->patches * a->width, sizeof *mean);
	float *hidden = gnp_scratch_take(scratch, batch->patches * a->head_width, sizeof *hidden);
	if (!kept || !mean || !hidden)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "operator: no memory for %zu patches", batch->patches);
	*kept = (struct gnp_pooled_tape){batch->patches, mean, hidden, NULL};
	gnp_status status = gnp_trunk_forward(network, batch, mean, tape ? &kept->trunk : NULL, scratch, error);
	if (status != GNP_OK)
		return status;
	gnp_dense_forward(batch->patches, a->width, a->head_width, mean, a->width, parameters + head.first->offset, a->width,
	                  parameters + head.first[1].offset, hidden);
	gnp_relu(batch->patches * a->head_width, hidden);
	gnp_dense_forward(batch->patches, a->head_width, a->outputs, hidden, a->head_width, parameters + head.second->offset,
	                  a->head_width, parameters + head.second[1].offset, coefficients);
	if (tape)
		*tape = kept;
	else
		gnp_scratch_release(scratch, mark);
	return GNP_OK;
}

gnp_status gnp_pooled_backward(const struct gnp_network *network, const struct gnp_pooled_tape *tape,
                               const float *dcoefficients, float *gradient, struct gnp_scratch *scratch,
                               struct gnp_error *error)
{
	const struct gnp_architecture *a = &network->architecture;
	const float *parameters = network->parameters;
	struct head head = head_of(network);
	struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
	size_t patches = tape->patches;
	float *dhidden = gnp_scratch_take(scratch, patches * a->head_width, sizeof *dhidden);
	float *dmean = gnp_scratch_take(scratch, patches * a->width, sizeof *dmean);
	if (!dhidden || !dmean)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "operator: no memory for %zu patches", patches);
	gnp_dense_backward(patches, a->head_width, a->outputs, tape->hidden, a->head_width, parameters + head.second->offset,
	                   a->head_width, dcoefficients, dhidden, gradient + head.second->offset, gradient + head.second[1].offset);
	gnp_relu_backward(patches * a->head_width, tape->hidden, dhidden);
	gnp_dense_backward(patches, a->width, a->head_width, tape->mean, a->width, parameters + head.first->offset, a->width, dhidden,
	                   dmean, gradient + head.first->offset, gradient + head.first[1].offset);
	gnp_status status = gnp_trunk_backward(network, tape->trunk, dmean, NULL, gradient, scratch, error);
	gnp_scratch_release(scratch, mark);
	return status;
}
