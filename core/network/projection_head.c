#include "core/network/projection_head.h"

#include <string.h>

#include "core/network/dense.h"

/* Where the head's tensors lie in the block of parameters. */
struct places {
	size_t mean, deviation, weight[3], bias[3];
};

static struct places places_of(const struct gnp_network *network)
{
	static const char *const weights[3] = {"head.0.weight", "head.2.weight", "head.4.weight"};
	static const char *const biases[3] = {"head.0.bias", "head.2.bias", "head.4.bias"};
	const struct gnp_layout *layout = &network->layout;
	struct places places = {.mean = gnp_layout_find(layout, "head.mean")->offset,
	                        .deviation = gnp_layout_find(layout, "head.deviation")->offset};
	for (int i = 0; i < 3; i++) {
		places.weight[i] = gnp_layout_find(layout, weights[i])->offset;
		places.bias[i] = gnp_layout_find(layout, biases[i])->offset;
	}
	return places;
}

struct sizes {
	size_t width, summary, inputs, hidden, outputs;
};

static struct sizes sizes_of(const struct gnp_architecture *a)
{
	size_t summary = gnp_projection_summary(a);
	return (struct sizes){a->width, summary, a->width + summary, a->head_width, gnp_projection_outputs(a)};
}

/* The trunk's mean, then the summary in units of its spread over the training data. */
static void fill_inputs(const struct sizes *s, const float *parameters, const struct places *at, size_t patches,
                        const float *mean, const float *summary, float *inputs)
{
	const float *centre = parameters + at->mean, *deviation = parameters + at->deviation;
	for (size_t p = 0; p < patches; p++) {
		float *row = inputs + p * s->inputs;
		memcpy(row, mean + p * s->width, s->width * sizeof *row);
		for (size_t i = 0; i < s->summary; i++)
			row[s->width + i] = (summary[p * s->summary + i] - centre[i]) / deviation[i];
	}
}

gnp_status gnp_projection_head_forward(const struct gnp_network *network, size_t patches, const float *mean,
                                       const float *summary, float *outputs, struct gnp_projection_tape *tape,
                                       struct gnp_scratch *scratch, struct gnp_error *error)
{
	const struct sizes s = sizes_of(&network->architecture);
	const struct places at = places_of(network);
	const float *w = network->parameters;
	*tape = (struct gnp_projection_tape){
		.patches = patches, .inputs = gnp_scratch_take(scratch, patches, s.inputs * sizeof(float)),
		.hidden = {gnp_scratch_take(scratch, patches, s.hidden * sizeof(float)),
	               gnp_scratch_take(scratch, patches, s.hidden * sizeof(float))}};
	if (!tape->inputs || !tape->hidden[0] || !tape->hidden[1])
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "projection: no memory for %zu patches", patches);
	fill_inputs(&s, w, &at, patches, mean, summary, tape->inputs);
	gnp_dense_forward(patches, s.inputs, s.hidden, tape->inputs, s.inputs, w + at.weight[0], s.inputs, w + at.bias[0],
	                  tape->hidden[0]);
	gnp_relu(patches * s.hidden, tape->hidden[0]);
	gnp_dense_forward(patches, s.hidden, s.hidden, tape->hidden[0], s.hidden, w + at.weight[1], s.hidden, w + at.bias[1],
	                  tape->hidden[1]);
	gnp_relu(patches * s.hidden, tape->hidden[1]);
	gnp_dense_forward(patches, s.hidden, s.outputs, tape->hidden[1], s.hidden, w + at.weight[2], s.hidden, w + at.bias[2], outputs);
	return GNP_OK;
}

gnp_status gnp_projection_head_backward(const struct gnp_network *network, const struct gnp_projection_tape *tape,
                                        const float *doutputs, float *gradient, float *dmean, struct gnp_scratch *scratch,
                                        struct gnp_error *error)
{
	const struct sizes s = sizes_of(&network->architecture);
	const struct places at = places_of(network);
	const float *w = network->parameters;
	struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
	float *dinputs = gnp_scratch_take(scratch, tape->patches, s.inputs * sizeof *dinputs);
	float *dhidden[2] = {gnp_scratch_take(scratch, tape->patches, s.hidden * sizeof *dinputs),
	                     gnp_scratch_take(scratch, tape->patches, s.hidden * sizeof *dinputs)};
	if (!dinputs || !dhidden[0] || !dhidden[1])
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "projection: no memory for %zu patches", tape->patches);
	memset(dinputs, 0, tape->patches * s.inputs * sizeof *dinputs);
	memset(dhidden[0], 0, tape->patches * s.hidden * sizeof *dinputs);
	memset(dhidden[1], 0, tape->patches * s.hidden * sizeof *dinputs);
	gnp_dense_backward(tape->patches, s.hidden, s.outputs, tape->hidden[1], s.hidden, w + at.weight[2], s.hidden, doutputs,
	                   dhidden[1], gradient + at.weight[2], gradient + at.bias[2]);
	gnp_relu_backward(tape->patches * s.hidden, tape->hidden[1], dhidden[1]);
	gnp_dense_backward(tape->patches, s.hidden, s.hidden, tape->hidden[0], s.hidden, w + at.weight[1], s.hidden, dhidden[1],
	                   dhidden[0], gradient + at.weight[1], gradient + at.bias[1]);
	gnp_relu_backward(tape->patches * s.hidden, tape->hidden[0], dhidden[0]);
	gnp_dense_backward(tape->patches, s.inputs, s.hidden, tape->inputs, s.inputs, w + at.weight[0], s.inputs, dhidden[0], dinputs,
	                   gradient + at.weight[0], gradient + at.bias[0]);
	for (size_t p = 0; p < tape->patches; p++)
		memcpy(dmean + p * s.width, dinputs + p * s.inputs, s.width * sizeof *dmean);
	gnp_scratch_release(scratch, mark);
	return GNP_OK;
}
