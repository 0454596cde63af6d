#include "weights/train/initial.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "core/base/random.h"

static bool ends_with(const char *name, const char *end)
{
	size_t length = strlen(name), tail = strlen(end);
	return length >= tail && strcmp(name + length - tail, end) == 0;
}

static void fill_uniform(const struct gnp_parameter_row *row, double bound, struct gnp_random *random, float *parameters)
{
	for (size_t i = 0; i < row->count; i++)
		parameters[row->offset + i] = (float)(bound * (2 * gnp_random_uniform(random) - 1));
}

/* layer: its name without ".weight" or ".bias". */
static bool ends_kernel(const char *layer)
{
	return ends_with(layer, ".nn.layers.1") || ends_with(layer, ".kernel1.layers.2") || ends_with(layer, ".kernel2.layers.2");
}

/* 0 and 1: the hidden layers of a separable kernel, of which the first reads coordinates; -1: none of these. */
static int hidden_of_separable(const char *layer)
{
	if (!strstr(layer, ".kernel1.") && !strstr(layer, ".kernel2."))
		return -1;
	return ends_with(layer, ".layers.0") ? 0 : ends_with(layer, ".layers.1") ? 1 : -1;
}

/* The largest size of an entry; a bias goes with the inputs of its layer. */
static double bound_of(const struct gnp_architecture *architecture, const char *layer, size_t inputs, bool bias)
{
	if (ends_kernel(layer))
		return bias ? 0 : sqrt(3.0 * architecture->channels / ((double)architecture->neurons * architecture->width));
	if (hidden_of_separable(layer) == 0)
		return bias ? 1 : sqrt(2);
	if (hidden_of_separable(layer) == 1)
		return bias ? 0.1 : sqrt(6 / (double)inputs);
	if (strcmp(layer, "head.4") == 0)
		return 0;
	return 1 / sqrt((double)inputs);
}

void gnp_initial_parameters(const struct gnp_architecture *architecture, const struct gnp_layout *layout, uint64_t seed,
                            float *parameters)
{
	size_t inputs = 1;
	for (size_t i = 0; i < layout->rows; i++) {
		const struct gnp_parameter_row *row = &layout->row[i];
		struct gnp_random random;
		char layer[64];
		bool bias = ends_with(row->name, ".bias");
		snprintf(layer, sizeof layer, "%.*s", (int)(strrchr(row->name, '.') - row->name), row->name);
		inputs = row->rank == 2 ? row->shape[1] : inputs;
		gnp_random_seed(&random, seed, UINT64_C(0x10) << 56 | i);
		fill_uniform(row, bound_of(architecture, layer, inputs, bias), &random, parameters);
	}
}
