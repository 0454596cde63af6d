/* The integrals of a trunk over the edges between nodes, forward and back: of inner layers in full, of the last as a
 * mean over its targets. */
#include <string.h>

#include "core/linear/linalg.h"
#include "core/network/dense.h"
#include "core/network/edges.h"
#include "core/network/trunk_edge_first.h"

/* Neurons at a time in a forward pass: what they take of the values and of the hidden activations, 2 x 64 kB for 32
 * sources and a width of 64, fits the second cache. */
enum { SLICE = 16 };

/* a and b of one patch, b as (n, sources). */
static bool open_sliced(const struct gnp_trunk_pass *pass, const struct gnp_edge_kernel *kernel, size_t patch,
                        struct gnp_edge_patch *view)
{
	size_t n = kernel->blocks.neurons, terms = pass->tape->terms, features = terms - 1;
	*view = gnp_edge_kernel_patch(pass->tape, patch);
	view->a = gnp_edge_kernel_take(pass, view->targets, n);
	view->b = gnp_edge_kernel_take(pass, n, view->sources);
	if (!view->a || !view->b)
		return false;
	gnp_dense_forward(view->targets, features, n, view->x, terms, kernel->target, 2 * features, NULL, view->a);
	for (size_t p = 0; p < n; p++)
		for (size_t j = 0; j < view->sources; j++)
			view->b[p * view->sources + j] = kernel->bias[p];
	gnp_linalg_gemm(GNP_PLAIN, GNP_TRANSPOSED, n, view->sources, features, 1, kernel->source, 2 * features, view->x, terms, 1,
	                view->b, view->sources);
	return true;
}

/* The integrals of one patch: values are contracted with the kernel once a source, and all edges are one product then,
 * both made and used up slice by slice. */
static bool patch_integral(const struct gnp_trunk_pass *pass, const struct gnp_edge_kernel *kernel, const float *sliced,
                           size_t patch, const float *values, float *z)
{
	size_t n = kernel->blocks.neurons, side = kernel->blocks.side, width = pass->network->architecture.width;
	struct gnp_edge_patch view;
	if (!open_sliced(pass, kernel, patch, &view))
		return false;
	float *y = gnp_edge_kernel_take(pass, view.sources + 2, width);
	float *spread = gnp_edge_kernel_take(pass, view.sources * width, SLICE),
		  *h = gnp_edge_kernel_take(pass, view.targets * view.sources, SLICE);
	if (!y || !spread || !h)
		return false;
	float *ysum = y + view.sources * width, *zbias = ysum + width;
	gnp_edge_kernel_scaled(&view, values + view.row * width, width, y);
	gnp_edge_kernel_bias(kernel, view.sources, y, ysum, zbias);
	z += view.row * width;
	for (size_t i = 0; i < view.targets; i++)
		memcpy(z + i * width, zbias, width * sizeof *z);
	for (size_t p = 0; p < n; p += SLICE) {
		size_t count = n - p < SLICE ? n - p : SLICE, edges = count * view.sources;
		gnp_blocks_spread_slice(&kernel->blocks, sliced + width * side * p, count, view.sources, y, spread);
		gnp_edges_fill_slice(view.targets, view.sources, n, count, view.a + p, view.b + p * view.sources, h);
		gnp_dense_forward_add(view.targets, edges, width, h, edges, spread, edges, z);
	}
	return true;
}

static bool patch_integral_backward(const struct gnp_trunk_pass *pass, const struct gnp_edge_kernel *kernel,
                                    size_t patch, const float *values, const float *dz, float *dvalues)
{
	size_t n = kernel->blocks.neurons, width = pass->network->architecture.width;
	struct gnp_edge_patch view;
	if (!gnp_edge_kernel_open(pass, kernel, patch, &view))
		return false;
	size_t sources = view.sources, targets = view.targets;
	float *y = gnp_edge_kernel_take(pass, 2 * sources + 3, width), *h = gnp_edge_kernel_take(pass, 2 * targets, n);
	float *spread = gnp_edge_kernel_take(pass, sources * width, n), *dspread = gnp_edge_kernel_take(pass, sources * width, n);
	if (!y || !h || !spread || !dspread)
		return false;
	float *dy = y + sources * width, *dh = h + targets * n;
	float *ysum = dy + sources * width, *dzsum = ysum + width, *dysum = dzsum + width;
	dz += view.row * width;
	gnp_edge_kernel_scaled(&view, values + view.row * width, width, y);
	memset(dy, 0, (sources + 3) * width * sizeof *dy);
	gnp_rows_sum(sources, width, y, ysum);
	gnp_rows_sum(targets, width, dz, dzsum);
	gnp_edge_kernel_bias_backward(pass, kernel, sources, ysum, dzsum, dysum, dy);
	gnp_blocks_spread(&kernel->blocks, sources, y, spread);
	for (size_t j = 0; j < sources; j++) {
		gnp_edges_fill(targets, n, view.a, view.b + j * n, h);
		gnp_linalg_gemm(GNP_TRANSPOSED, GNP_PLAIN, width, n, targets, 1, dz, width, h, n, 0, dspread + j * width * n, n);
		gnp_linalg_gemm(GNP_PLAIN, GNP_PLAIN, targets, n, width, 1, dz, width, spread + j * width * n, n, 0, dh, n);
		gnp_edges_fill_backward(targets, n, h, dh, view.da, view.db + j * n);
	}
	gnp_blocks_spread_backward(&kernel->blocks, sources, y, dspread, dy, pass->gradient + kernel->top.weight);
	gnp_edge_kernel_close_backward(pass, kernel, &view);
	for (size_t i = 0; i < sources * width; i++)
		dvalues[view.row * width + i] += dy[i] / (float)sources;
	return true;
}

bool gnp_edge_integral(const struct gnp_trunk_pass *pass, unsigned layer)
{
	struct gnp_trunk_tape *tape = pass->tape;
	struct gnp_trunk_kept *kept = &tape->kept[layer];
	struct gnp_edge_kernel kernel = gnp_edge_kernel_of(pass->network, layer);
	kept->z = gnp_edge_kernel_take(pass, tape->rows, pass->network->architecture.width);
	if (!kept->z)
		return false;
	if (layer == 0)
		return gnp_trunk_edge_first(pass, &kernel, kept);
	float *sliced = gnp_edge_kernel_take(pass, pass->network->architecture.width * kernel.blocks.side, kernel.blocks.neurons);
	if (!sliced)
		return false;
	gnp_blocks_slice(&kernel.blocks, SLICE, sliced);
	for (size_t p = 0; p < tape->patches; p++) {
		struct gnp_scratch_mark mark = gnp_scratch_mark(pass->scratch);
		if (!patch_integral(pass, &kernel, sliced, p, tape->values[layer], kept->z))
			return false;
		gnp_scratch_release(pass->scratch, mark);
	}
	return true;
}

bool gnp_edge_integral_backward(const struct gnp_trunk_pass *pass, unsigned layer, const float *dz, float *dvalues)
{
	const struct gnp_trunk_tape *tape = pass->tape;
	struct gnp_edge_kernel kernel = gnp_edge_kernel_of(pass->network, layer);
	struct gnp_scratch_mark whole = gnp_scratch_mark(pass->scratch);
	if (layer == 0 && !gnp_trunk_edge_first_backward(pass, &kernel, dz, dvalues))
		return false;
	for (size_t p = 0; layer > 0 && p < tape->patches; p++) {
		struct gnp_scratch_mark mark = gnp_scratch_mark(pass->scratch);
		if (!patch_integral_backward(pass, &kernel, p, tape->values[layer], dz, dvalues))
			return false;
		gnp_scratch_release(pass->scratch, mark);
	}
	gnp_scratch_release(pass->scratch, whole);
	return true;
}

/* The mean of the last layer's integrals is that of its hidden activations: a source counts by one row, not by one a
 * target. */
bool gnp_edge_mean_integral(const struct gnp_trunk_pass *pass, unsigned layer)
{
	struct gnp_trunk_tape *tape = pass->tape;
	struct gnp_trunk_kept *kept = &tape->kept[layer];
	struct gnp_edge_kernel kernel = gnp_edge_kernel_of(pass->network, layer);
	size_t n = kernel.blocks.neurons, width = pass->network->architecture.width;
	kept->z = gnp_edge_kernel_take(pass, tape->patches, width);
	kept->moments = gnp_edge_kernel_take(pass, tape->patches * width, n);
	float *ysum = gnp_edge_kernel_take(pass, 1, width), *zbias = gnp_edge_kernel_take(pass, tape->patches, width);
	if (!kept->z || !kept->moments || !ysum || !zbias)
		return false;
	for (size_t p = 0; p < tape->patches; p++) {
		struct gnp_scratch_mark mark = gnp_scratch_mark(pass->scratch);
		struct gnp_edge_patch view;
		if (!gnp_edge_kernel_open(pass, &kernel, p, &view))
			return false;
		float *y = gnp_edge_kernel_take(pass, view.sources, width), *mean = gnp_edge_kernel_take(pass, view.sources, n);
		if (!y || !mean)
			return false;
		gnp_edge_kernel_scaled(&view, tape->values[layer] + view.row * width, width, y);
		gnp_edge_kernel_bias(&kernel, view.sources, y, ysum, zbias + p * width);
		gnp_edges_mean(view.targets, view.sources, n, tape->share + view.row, view.a, view.b, mean);
		gnp_linalg_gemm(GNP_TRANSPOSED, GNP_PLAIN, width, n, view.sources, 1, y, width, mean, n, 0, kept->moments + p * width * n, n);
		gnp_scratch_release(pass->scratch, mark);
	}
	gnp_blocks_gather(&kernel.blocks, tape->patches, kept->moments, kept->z);
	for (size_t i = 0; i < tape->patches * width; i++)
		kept->z[i] += zbias[i];
	return true;
}

static bool mean_patch_backward(const struct gnp_trunk_pass *pass, const struct gnp_edge_kernel *kernel, size_t patch,
                                const float *values, const float *dz, const float *dmoments, float *dvalues)
{
	const struct gnp_trunk_tape *tape = pass->tape;
	size_t n = kernel->blocks.neurons, width = pass->network->architecture.width;
	struct gnp_edge_patch view;
	if (!gnp_edge_kernel_open(pass, kernel, patch, &view))
		return false;
	size_t sources = view.sources;
	float *y = gnp_edge_kernel_take(pass, 2 * sources + 2, width), *mean = gnp_edge_kernel_take(pass, 2 * sources, n);
	if (!y || !mean)
		return false;
	float *dy = y + sources * width, *ysum = dy + sources * width, *dysum = ysum + width, *dmean = mean + sources * n;
	gnp_edge_kernel_scaled(&view, values + view.row * width, width, y);
	memset(dy, 0, (sources + 2) * width * sizeof *dy);
	gnp_rows_sum(sources, width, y, ysum);
	gnp_edge_kernel_bias_backward(pass, kernel, sources, ysum, dz, dysum, dy);
	gnp_edges_mean(view.targets, sources, n, tape->share + view.row, view.a, view.b, mean);
	gnp_linalg_gemm(GNP_PLAIN, GNP_PLAIN, sources, n, width, 1, y, width, dmoments, n, 0, dmean, n);
	gnp_linalg_gemm(GNP_PLAIN, GNP_TRANSPOSED, sources, width, n, 1, mean, n, dmoments, n, 1, dy, width);
	gnp_edges_mean_backward(view.targets, sources, n, tape->share + view.row, view.a, view.b, dmean, view.da, view.db);
	gnp_edge_kernel_close_backward(pass, kernel, &view);
	for (size_t i = 0; i < sources * width; i++)
		dvalues[view.row * width + i] += dy[i] / (float)sources;
	return true;
}

bool gnp_edge_mean_integral_backward(const struct gnp_trunk_pass *pass, unsigned layer, const float *dz, float *dvalues)
{
	const struct gnp_trunk_tape *tape = pass->tape;
	struct gnp_edge_kernel kernel = gnp_edge_kernel_of(pass->network, layer);
	size_t n = kernel.blocks.neurons, width = pass->network->architecture.width;
	struct gnp_scratch_mark whole = gnp_scratch_mark(pass->scratch);
	float *dmoments = gnp_edge_kernel_take(pass, tape->patches * width, n);
	if (!dmoments)
		return false;
	gnp_blocks_gather_backward(&kernel.blocks, tape->patches, tape->kept[layer].moments, dz, dmoments,
	                           pass->gradient + kernel.top.weight);
	for (size_t p = 0; p < tape->patches; p++) {
		struct gnp_scratch_mark mark = gnp_scratch_mark(pass->scratch);
		if (!mean_patch_backward(pass, &kernel, p, tape->values[layer], dz + p * width, dmoments + p * width * n, dvalues))
			return false;
		gnp_scratch_release(pass->scratch, mark);
	}
	gnp_scratch_release(pass->scratch, whole);
	return true;
}
