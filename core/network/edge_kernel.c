#include "core/network/edge_kernel.h"

#include <string.h>

#include "core/network/dense.h"

struct gnp_edge_kernel gnp_edge_kernel_of(const struct gnp_network *network, unsigned layer)
{
	struct gnp_edge_kernel kernel;
	kernel.hidden = gnp_trunk_place(network, "model.convs.#.nn.layers.0", layer);
	kernel.top = gnp_trunk_place(network, "model.convs.#.nn.layers.1", layer);
	kernel.blocks = gnp_trunk_blocks(network, kernel.top);
	kernel.source = network->parameters + kernel.hidden.weight;
	kernel.target = kernel.source + network->architecture.features;
	kernel.bias = network->parameters + kernel.hidden.bias;
	return kernel;
}

float *gnp_edge_kernel_take(const struct gnp_trunk_pass *pass, size_t rows, size_t columns)
{
	size_t count = rows * columns;
	return gnp_scratch_take(pass->scratch, count, sizeof(float));
}

struct gnp_edge_patch gnp_edge_kernel_patch(const struct gnp_trunk_tape *tape, size_t patch)
{
	size_t row = tape->first[patch];
	return (struct gnp_edge_patch){.row = row, .targets = tape->first[patch + 1] - row, .sources = tape->sources[patch],
		.x = tape->x + row * tape->terms};
}

bool gnp_edge_kernel_open(const struct gnp_trunk_pass *pass, const struct gnp_edge_kernel *kernel, size_t patch,
                          struct gnp_edge_patch *view)
{
	const struct gnp_trunk_tape *tape = pass->tape;
	size_t n = kernel->blocks.neurons, features = tape->terms - 1;
	*view = gnp_edge_kernel_patch(tape, patch);
	view->a = gnp_edge_kernel_take(pass, view->targets, n);
	view->b = gnp_edge_kernel_take(pass, view->sources, n);
	view->da = pass->gradient ? gnp_edge_kernel_take(pass, view->targets, n) : NULL;
	view->db = pass->gradient ? gnp_edge_kernel_take(pass, view->sources, n) : NULL;
	if (!view->a || !view->b || (pass->gradient && (!view->da || !view->db)))
		return false;
	gnp_dense_forward(view->targets, features, n, view->x, tape->terms, kernel->target, 2 * features, NULL, view->a);
	gnp_dense_forward(view->sources, features, n, view->x, tape->terms, kernel->source, 2 * features, kernel->bias, view->b);
	if (pass->gradient) {
		memset(view->da, 0, view->targets * n * sizeof *view->da);
		memset(view->db, 0, view->sources * n * sizeof *view->db);
	}
	return true;
}

void gnp_edge_kernel_close_backward(const struct gnp_trunk_pass *pass, const struct gnp_edge_kernel *kernel,
                                    const struct gnp_edge_patch *view)
{
	size_t n = kernel->blocks.neurons, terms = pass->tape->terms, features = terms - 1;
	float *dsource = pass->gradient + kernel->hidden.weight;
	gnp_dense_backward(view->targets, features, n, view->x, terms, NULL, 2 * features, view->da, NULL, dsource + features, NULL);
	gnp_dense_backward(view->sources, features, n, view->x, terms, NULL, 2 * features, view->db, NULL, dsource,
	                   pass->gradient + kernel->hidden.bias);
}

void gnp_edge_kernel_scaled(const struct gnp_edge_patch *view, const float *x, size_t columns, float *y)
{
	float factor = 1 / (float)view->sources;
	for (size_t i = 0; i < view->sources * columns; i++)
		y[i] = factor * x[i];
}

void gnp_edge_kernel_bias(const struct gnp_edge_kernel *kernel, size_t sources, const float *y, float *ysum, float *z)
{
	size_t width = kernel->blocks.channels * kernel->blocks.side;
	memset(ysum, 0, width * sizeof *ysum);
	gnp_rows_sum(sources, width, y, ysum);
	memset(z, 0, width * sizeof *z);
	gnp_blocks_bias(&kernel->blocks, 1, ysum, z);
}

void gnp_edge_kernel_bias_backward(const struct gnp_trunk_pass *pass, const struct gnp_edge_kernel *kernel,
                                   size_t sources, const float *ysum, const float *dzsum, float *dysum, float *dy)
{
	size_t width = kernel->blocks.channels * kernel->blocks.side;
	memset(dysum, 0, width * sizeof *dysum);
	gnp_blocks_bias_backward(&kernel->blocks, 1, ysum, dzsum, dysum, pass->gradient + kernel->top.bias);
	for (size_t j = 0; j < sources; j++)
		for (size_t i = 0; i < width; i++)
			dy[j * width + i] += dysum[i];
}
