#include "core/network/trunk.h"

#include <assert.h>
#include <stdio.h>
#include <string.h>

#include "core/network/dense.h"
#include "core/network/quadrature.h"
#include "core/network/trunk_parts.h"

static const struct {
	gnp_integral_fn integral, mean;
	gnp_integral_backward_fn integral_backward, mean_backward;
	const char *lift, *mix;
} kinds[GNP_TRUNKS] = {
	[GNP_TRUNK_EDGE] = {gnp_edge_integral, gnp_edge_mean_integral, gnp_edge_integral_backward, gnp_edge_mean_integral_backward,
	                    "model.lift", "model.mixes.#"},
	[GNP_TRUNK_SEPARABLE] = {gnp_separable_integral, gnp_separable_mean_integral, gnp_separable_integral_backward,
	                         gnp_separable_mean_integral_backward, "lift", "convs.#.linear"},
};

struct gnp_linear_place gnp_trunk_place(const struct gnp_network *network, const char *pattern, unsigned layer)
{
	char name[64];
	const char *mark = strchr(pattern, '#');
	if (mark)
		snprintf(name, sizeof name, "%.*s%u%s.weight", (int)(mark - pattern), pattern, layer, mark + 1);
	else
		snprintf(name, sizeof name, "%s.weight", pattern);
	const struct gnp_parameter_row *row = gnp_layout_find(&network->layout, name);
	assert(row);
	return (struct gnp_linear_place){row->offset, row->offset + row->count};
}

struct gnp_blocks gnp_trunk_blocks(const struct gnp_network *network, struct gnp_linear_place place)
{
	const struct gnp_architecture *a = &network->architecture;
	return (struct gnp_blocks){a->channels, a->width / a->channels, a->neurons, network->parameters + place.weight,
	                           network->parameters + place.bias};
}

static size_t patch_nodes(const struct gnp_network_batch *batch, size_t patch)
{
	return batch->start[patch + 1] - batch->start[patch];
}

static size_t patch_sources(const struct gnp_architecture *a, size_t nodes)
{
	return a->trunk == GNP_TRUNK_SEPARABLE || nodes < a->quadrature ? nodes : a->quadrature;
}

static void put_row(struct gnp_trunk_tape *tape, const float *features, size_t row, float share)
{
	float *x = tape->x + row * tape->terms;
	memcpy(x, features, (tape->terms - 1) * sizeof *x);
	x[tape->terms - 1] = 1;
	tape->share[row] = share;
}

/* The rows of one patch from `row` on; the row after them is returned. */
static size_t lay_out_patch(struct gnp_trunk_tape *tape, const struct gnp_network_batch *batch, size_t patch,
                            size_t row, size_t *chosen, float *distance)
{
	const size_t features = tape->terms - 1, nodes = patch_nodes(batch, patch), inner = batch->inner[patch];
	const float *x = batch->nodes + batch->start[patch] * features, share = 1 / (float)inner;
	size_t sources = gnp_quadrature_choose(x, features, nodes, tape->sources[patch], chosen, distance);
	for (size_t j = 0; j < sources; j++)
		put_row(tape, x + chosen[j] * features, row++, chosen[j] < inner ? share : 0);
	memset(distance, 0, nodes * sizeof *distance);
	for (size_t j = 0; j < sources; j++)
		distance[chosen[j]] = 1;
	for (size_t i = 0; i < inner; i++)
		if (distance[i] == 0)
			put_row(tape, x + i * features, row++, share);
	return row;
}

static bool lay_out(struct gnp_trunk_tape *tape, const struct gnp_network *network,
                    const struct gnp_network_batch *batch, struct gnp_scratch *scratch)
{
	const struct gnp_architecture *a = &network->architecture;
	size_t most = 1;
	tape->patches = batch->patches;
	tape->terms = (size_t)a->features + 1;
	tape->first = gnp_scratch_take(scratch, batch->patches + 1, sizeof *tape->first);
	tape->sources = gnp_scratch_take(scratch, batch->patches, sizeof *tape->sources);
	tape->x = gnp_scratch_take(scratch, batch->start[batch->patches] * tape->terms, sizeof *tape->x);
	tape->share = gnp_scratch_take(scratch, batch->start[batch->patches], sizeof *tape->share);
	for (size_t p = 0; p < batch->patches; p++)
		if (patch_nodes(batch, p) > most)
			most = patch_nodes(batch, p);
	struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
	size_t *chosen = gnp_scratch_take(scratch, most, sizeof *chosen);
	float *distance = gnp_scratch_take(scratch, most, sizeof *distance);
	if (!tape->first || !tape->sources || !tape->x || !tape->share || !chosen || !distance)
		return false;
	tape->first[0] = 0;
	for (size_t p = 0; p < batch->patches; p++) {
		assert(batch->inner[p] >= 1 && batch->inner[p] <= patch_nodes(batch, p));
		tape->sources[p] = patch_sources(a, patch_nodes(batch, p));
		tape->first[p + 1] = lay_out_patch(tape, batch, p, tape->first[p], chosen, distance);
	}
	tape->rows = tape->first[batch->patches];
	gnp_scratch_release(scratch, mark);
	return true;
}

/* All layers but the last: values[layer + 1] from values[layer], in place where none of it is kept. */
static bool hidden_layer(const struct gnp_trunk_pass *pass, unsigned layer, bool keep)
{
	const struct gnp_network *network = pass->network;
	struct gnp_trunk_tape *tape = pass->tape;
	size_t width = network->architecture.width, count = tape->rows * width;
	struct gnp_linear_place mix = gnp_trunk_place(network, kinds[network->architecture.trunk].mix, layer);
	float *next = tape->values[layer];
	if (keep) {
		next = gnp_scratch_take(pass->scratch, count, sizeof *next);
		if (!next)
			return false;
		memcpy(next, tape->values[layer], count * sizeof *next);
	}
	struct gnp_scratch_mark mark = gnp_scratch_mark(pass->scratch);
	if (!kinds[network->architecture.trunk].integral(pass, layer))
		return false;
	gnp_dense_forward_add(tape->rows, width, width, tape->kept[layer].z, width, network->parameters + mix.weight, width, next);
	gnp_bias_relu(tape->rows, width, network->parameters + mix.bias, next);
	tape->values[layer + 1] = next;
	if (!keep)
		gnp_scratch_release(pass->scratch, mark);
	return true;
}

static void mean_values(const struct gnp_trunk_tape *tape, size_t width, const float *values, float *mean)
{
	memset(mean, 0, tape->patches * width * sizeof *mean);
	for (size_t p = 0; p < tape->patches; p++)
		for (size_t row = tape->first[p]; row < tape->first[p + 1]; row++)
			for (size_t i = 0; i < width; i++)
				mean[p * width + i] += tape->share[row] * values[row * width + i];
}

static bool last_layer(const struct gnp_trunk_pass *pass, float *mean)
{
	const struct gnp_network *network = pass->network;
	struct gnp_trunk_tape *tape = pass->tape;
	unsigned last = network->architecture.layers - 1;
	size_t width = network->architecture.width, patches = tape->patches;
	const float *parameters = network->parameters;
	struct gnp_linear_place mix = gnp_trunk_place(network, kinds[network->architecture.trunk].mix, last);
	bool edge = network->architecture.trunk == GNP_TRUNK_EDGE;
	float *sum = mean;
	if (edge && !(sum = tape->mean = gnp_scratch_take(pass->scratch, patches * width, sizeof *sum)))
		return false;
	if (!kinds[network->architecture.trunk].mean(pass, last))
		return false;
	mean_values(tape, width, tape->values[last], sum);
	gnp_dense_forward_add(patches, width, width, tape->kept[last].z, width, parameters + mix.weight, width, sum);
	for (size_t p = 0; p < patches; p++)
		for (size_t i = 0; i < width; i++)
			sum[p * width + i] += parameters[mix.bias + i];
	if (edge) {
		struct gnp_linear_place project = gnp_trunk_place(network, "model.proj", 0);
		gnp_dense_forward(patches, width, width, sum, width, parameters + project.weight, width, parameters + project.bias, mean);
	}
	return true;
}

static bool forward(const struct gnp_trunk_pass *pass, const struct gnp_network_batch *batch, bool keep, float *mean)
{
	const struct gnp_architecture *a = &pass->network->architecture;
	struct gnp_trunk_tape *tape = pass->tape;
	struct gnp_linear_place lift = gnp_trunk_place(pass->network, kinds[a->trunk].lift, 0);
	if (!lay_out(tape, pass->network, batch, pass->scratch))
		return false;
	tape->values[0] = gnp_scratch_take(pass->scratch, tape->rows * a->width, sizeof **tape->values);
	if (!tape->values[0])
		return false;
	gnp_dense_forward(tape->rows, a->features, a->width, tape->x, tape->terms, pass->network->parameters + lift.weight,
	                  a->features, pass->network->parameters + lift.bias, tape->values[0]);
	for (unsigned layer = 0; layer + 1 < a->layers; layer++)
		if (!hidden_layer(pass, layer, keep))
			return false;
	return last_layer(pass, mean);
}

/* nodes and tape: NULL where they are not wanted. */
static gnp_status run(const struct gnp_network *network, const struct gnp_network_batch *batch, float *mean,
                      float *nodes, const struct gnp_trunk_tape **tape, struct gnp_scratch *scratch,
                      struct gnp_error *error)
{
	struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
	struct gnp_trunk_pass pass = {network, gnp_scratch_take(scratch, 1, sizeof *pass.tape), NULL, scratch};
	bool none = network->architecture.trunk == GNP_TRUNK_NONE;
	if (!pass.tape || (!none && !forward(&pass, batch, tape != NULL, mean)))
		return gnp_error_set(error, GNP_OUT_OF_MEMORY,
		                     "operator: no memory for %zu nodes", batch->start[batch->patches]);
	if (nodes)
		memcpy(nodes, gnp_trunk_nodes(network, pass.tape),
		       pass.tape->rows * network->architecture.width * sizeof *nodes);
	if (tape)
		*tape = pass.tape;
	else
		gnp_scratch_release(scratch, mark);
	return GNP_OK;
}

gnp_status gnp_trunk_forward(const struct gnp_network *network, const struct gnp_network_batch *batch, float *mean,
                             const struct gnp_trunk_tape **tape, struct gnp_scratch *scratch, struct gnp_error *error)
{
	return run(network, batch, mean, NULL, tape, scratch, error);
}

gnp_status gnp_trunk_forward_nodes(const struct gnp_network *network, const struct gnp_network_batch *batch,
                                   float *mean, float *nodes, struct gnp_scratch *scratch, struct gnp_error *error)
{
	return run(network, batch, mean, nodes, NULL, scratch, error);
}

const float *gnp_trunk_nodes(const struct gnp_network *network, const struct gnp_trunk_tape *tape)
{
	return tape->values[network->architecture.layers - 1];
}

static bool last_layer_backward(const struct gnp_trunk_pass *pass, const float *dmean, float *dvalues)
{
	const struct gnp_network *network = pass->network;
	const struct gnp_trunk_tape *tape = pass->tape;
	const float *parameters = network->parameters;
	float *gradient = pass->gradient;
	unsigned last = network->architecture.layers - 1;
	size_t width = network->architecture.width, patches = tape->patches;
	struct gnp_linear_place mix = gnp_trunk_place(network, kinds[network->architecture.trunk].mix, last);
	float *dsum = gnp_scratch_take(pass->scratch, patches * width, sizeof *dsum);
	float *dz = gnp_scratch_take(pass->scratch, patches * width, sizeof *dz);
	if (!dsum || !dz)
		return false;
	if (network->architecture.trunk == GNP_TRUNK_EDGE) {
		struct gnp_linear_place project = gnp_trunk_place(network, "model.proj", 0);
		gnp_dense_backward(patches, width, width, tape->mean, width, parameters + project.weight, width, dmean, dsum,
		                   gradient + project.weight, gradient + project.bias);
	} else {
		memcpy(dsum, dmean, patches * width * sizeof *dsum);
	}
	gnp_dense_backward(patches, width, width, tape->kept[last].z, width, parameters + mix.weight, width, dsum, dz,
	                   gradient + mix.weight, gradient + mix.bias);
	for (size_t p = 0; p < patches; p++)
		for (size_t row = tape->first[p]; row < tape->first[p + 1]; row++)
			for (size_t i = 0; i < width; i++)
				dvalues[row * width + i] = tape->share[row] * dsum[p * width + i];
	return kinds[network->architecture.trunk].mean_backward(pass, last, dz, dvalues);
}

/* dvalues: in, of what comes out of the layer; out, of what goes in. dz: scratch of the same size. */
static bool hidden_layer_backward(const struct gnp_trunk_pass *pass, unsigned layer, float *dvalues, float *dz)
{
	const struct gnp_network *network = pass->network;
	const struct gnp_trunk_tape *tape = pass->tape;
	size_t width = network->architecture.width;
	struct gnp_linear_place mix = gnp_trunk_place(network, kinds[network->architecture.trunk].mix, layer);
	gnp_relu_backward(tape->rows * width, tape->values[layer + 1], dvalues);
	gnp_dense_backward(tape->rows, width, width, tape->kept[layer].z, width, network->parameters + mix.weight, width, dvalues, dz,
	                   pass->gradient + mix.weight, pass->gradient + mix.bias);
	return kinds[network->architecture.trunk].integral_backward(pass, layer, dz, dvalues);
}

/* dvalues (rows of the tape) += dnodes (rows of the batch). */
static void add_nodes(const struct gnp_trunk_tape *tape, size_t width, const float *dnodes, float *dvalues)
{
	for (size_t i = 0; i < tape->rows * width; i++)
		dvalues[i] += dnodes[i];
}

static bool backward(const struct gnp_trunk_pass *pass, const float *dmean, const float *dnodes)
{
	const struct gnp_architecture *a = &pass->network->architecture;
	const struct gnp_trunk_tape *tape = pass->tape;
	struct gnp_linear_place lift = gnp_trunk_place(pass->network, kinds[a->trunk].lift, 0);
	float *dvalues = gnp_scratch_take(pass->scratch, tape->rows * a->width, sizeof *dvalues);
	float *dz = gnp_scratch_take(pass->scratch, tape->rows * a->width, sizeof *dz);
	if (!dvalues || !dz || !last_layer_backward(pass, dmean, dvalues))
		return false;
	if (dnodes)
		add_nodes(tape, a->width, dnodes, dvalues);
	for (unsigned layer = a->layers - 1; layer-- > 0;)
		if (!hidden_layer_backward(pass, layer, dvalues, dz))
			return false;
	gnp_dense_backward(tape->rows, a->features, a->width, tape->x, tape->terms, NULL, a->features, dvalues, NULL,
	                   pass->gradient + lift.weight, pass->gradient + lift.bias);
	return true;
}

gnp_status gnp_trunk_backward(const struct gnp_network *network, const struct gnp_trunk_tape *tape, const float *dmean,
                              const float *dnodes, float *gradient, struct gnp_scratch *scratch,
                              struct gnp_error *error)
{
	struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
	struct gnp_trunk_pass pass = {network, (struct gnp_trunk_tape *)tape, gradient, scratch};
	bool done = network->architecture.trunk == GNP_TRUNK_NONE || backward(&pass, dmean, dnodes);
	gnp_scratch_release(scratch, mark);
	if (!done)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY,
		                     "operator: no memory for the derivatives of %zu nodes", tape->rows);
	return GNP_OK;
}

/* Multiply-adds of one layer's integrals for a patch: those of the forward pass, or of the backward one. */
static double edge_products(const struct gnp_architecture *a, unsigned layer, double sources, double targets,
                            bool backward)
{
	double n = a->neurons, width = a->width, side = width / a->channels, top = width * side * n, hidden = n * a->features;
	double count = (sources + targets) * hidden; /* a, b, and back to their parameters */
	if (backward)
		count *= 2;
	if (layer + 1 == a->layers)
		return count + (backward ? 2 : 1) * (sources * width * n + top);
	if (layer == 0)
		return count + (backward ? 2 : 1) * targets * (a->features + 1) * n * width;
	return count + (backward ? 3 : 1) * sources * top + (backward ? 2 : 1) * sources * targets * n * width;
}

static double separable_products(const struct gnp_architecture *a, unsigned layer, double sources, double targets,
                                 bool backward)
{
	double n = a->neurons, width = a->width, side = width / a->channels;
	double nodes = (sources + targets) * (n * a->features + n * n);
	double sums = (sources + (layer + 1 == a->layers ? 1 : targets)) * n * width;
	return (backward ? 2 : 1) * (nodes + sums + 2 * width * side * n);
}

double gnp_trunk_operations(const struct gnp_network *network, const struct gnp_network_batch *batch, bool backward)
{
	const struct gnp_architecture *a = &network->architecture;
	double count = 0;
	for (size_t p = 0; p < batch->patches; p++) {
		double sources = (double)patch_sources(a, patch_nodes(batch, p)), inner = (double)batch->inner[p];
		double targets = inner > sources ? inner : sources;
		for (unsigned layer = 0; layer < a->layers; layer++) {
			count += a->trunk == GNP_TRUNK_EDGE ? edge_products(a, layer, sources, targets, backward)
			                                    : separable_products(a, layer, sources, targets, backward);
			count += (backward ? 2 : 1) * (layer + 1 < a->layers ? targets : 1) * a->width * a->width;
		}
	}
	return 2 * count;
}
