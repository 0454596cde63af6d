#include <string.h>

#include "core/linear/linalg.h"
#include "core/network/dense.h"
#include "core/network/edges.h"
#include "core/network/trunk_parts.h"

/* A layer's kernel: h_ij = max(H [x_j, x_i] + b, 0), and the blocks on top. */
struct kernel {
	struct gnp_linear_place hidden, top;
	struct gnp_blocks blocks;
	const float *source, *target, *bias; /* (n, 2 features) from the sources' and the targets' columns on; (n) */
};

static struct kernel kernel_of(const struct gnp_network *network, unsigned layer)
{
	struct kernel kernel;
	kernel.hidden = gnp_trunk_place(network, "model.convs.#.nn.layers.0", layer);
	kernel.top = gnp_trunk_place(network, "model.convs.#.nn.layers.1", layer);
	kernel.blocks = gnp_trunk_blocks(network, kernel.top);
	kernel.source = network->parameters + kernel.hidden.weight;
	kernel.target = kernel.source + network->architecture.features;
	kernel.bias = network->parameters + kernel.hidden.bias;
	return kernel;
}

/* One patch of a batch, and its part of the hidden activations, h_ij = max(a_i + b_j, 0). */
struct view {
	size_t targets, sources, row; /* row: the patch's first */
	const float *x;               /* (targets, terms), the sources first */
	float *a, *b;                 /* (targets, n), (sources, n) */
	float *da, *db;               /* the same, zero at first; NULL in a forward pass */
};

static float *take(const struct gnp_trunk_pass *pass, size_t rows, size_t columns)
{
	size_t count = rows * columns;
	return gnp_scratch_take(pass->scratch, count, sizeof(float));
}

static struct view patch_of(const struct gnp_trunk_tape *tape, size_t patch)
{
	size_t row = tape->first[patch];
	return (struct view){.row = row, .targets = tape->first[patch + 1] - row, .sources = tape->sources[patch],
		.x = tape->x + row * tape->terms};
}

static bool open_patch(const struct gnp_trunk_pass *pass, const struct kernel *kernel, size_t patch, struct view *view)
{
	const struct gnp_trunk_tape *tape = pass->tape;
	size_t n = kernel->blocks.neurons, features = tape->terms - 1;
	*view = patch_of(tape, patch);
	view->a = take(pass, view->targets, n);
	view->b = take(pass, view->sources, n);
	view->da = pass->gradient ? take(pass, view->targets, n) : NULL;
	view->db = pass->gradient ? take(pass, view->sources, n) : NULL;
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

/* From da and db to the hidden layer's parameters. */
static void close_patch_backward(const struct gnp_trunk_pass *pass, const struct kernel *kernel, const struct view *view)
{
	size_t n = kernel->blocks.neurons, terms = pass->tape->terms, features = terms - 1;
	float *dsource = pass->gradient + kernel->hidden.weight;
	gnp_dense_backward(view->targets, features, n, view->x, terms, NULL, 2 * features, view->da, NULL, dsource + features, NULL);
	gnp_dense_backward(view->sources, features, n, view->x, terms, NULL, 2 * features, view->db, NULL, dsource,
	                   pass->gradient + kernel->hidden.bias);
}

/* y (sources, columns) = x / sources for the patch's first rows of x. */
static void scaled(const struct view *view, const float *x, size_t columns, float *y)
{
	float factor = 1 / (float)view->sources;
	for (size_t i = 0; i < view->sources * columns; i++)
		y[i] = factor * x[i];
}

/* The sum of y's rows goes through the kernel's bias to every target. */
static void bias_part(const struct kernel *kernel, size_t sources, const float *y, float *ysum, float *z)
{
	size_t width = kernel->blocks.channels * kernel->blocks.side;
	memset(ysum, 0, width * sizeof *ysum);
	gnp_rows_sum(sources, width, y, ysum);
	memset(z, 0, width * sizeof *z);
	gnp_blocks_bias(&kernel->blocks, 1, ysum, z);
}

/* Back from dz, summed over targets: dy of every source, and the bias. */
static void bias_part_backward(const struct gnp_trunk_pass *pass, const struct kernel *kernel, size_t sources, const float *ysum,
                               const float *dzsum, float *dysum, float *dy)
{
	size_t width = kernel->blocks.channels * kernel->blocks.side;
	memset(dysum, 0, width * sizeof *dysum);
	gnp_blocks_bias_backward(&kernel->blocks, 1, ysum, dzsum, dysum, pass->gradient + kernel->top.bias);
	for (size_t j = 0; j < sources; j++)
		for (size_t i = 0; i < width; i++)
			dy[j * width + i] += dysum[i];
}

/* Neurons at a time in a forward pass: what they take of the values and of the hidden activations, 2 x 64 kB for 32 sources and
 * a width of 64, fits the second cache. */
enum { SLICE = 16 };

/* a and b of one patch, b as (n, sources). */
static bool open_sliced(const struct gnp_trunk_pass *pass, const struct kernel *kernel, size_t patch, struct view *view)
{
	size_t n = kernel->blocks.neurons, terms = pass->tape->terms, features = terms - 1;
	*view = patch_of(pass->tape, patch);
	view->a = take(pass, view->targets, n);
	view->b = take(pass, n, view->sources);
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

/* The integrals of one patch: values are contracted with the kernel once a source, and all edges are one product then, both made
 * and used up slice by slice. */
static bool patch_integral(const struct gnp_trunk_pass *pass, const struct kernel *kernel, const float *sliced, size_t patch,
                           const float *values, float *z)
{
	size_t n = kernel->blocks.neurons, side = kernel->blocks.side, width = pass->network->architecture.width;
	struct view view;
	if (!open_sliced(pass, kernel, patch, &view))
		return false;
	float *y = take(pass, view.sources + 2, width);
	float *spread = take(pass, view.sources * width, SLICE), *h = take(pass, view.targets * view.sources, SLICE);
	if (!y || !spread || !h)
		return false;
	float *ysum = y + view.sources * width, *zbias = ysum + width;
	scaled(&view, values + view.row * width, width, y);
	bias_part(kernel, view.sources, y, ysum, zbias);
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

static bool patch_integral_backward(const struct gnp_trunk_pass *pass, const struct kernel *kernel, size_t patch,
                                    const float *values, const float *dz, float *dvalues)
{
	size_t n = kernel->blocks.neurons, width = pass->network->architecture.width;
	struct view view;
	if (!open_patch(pass, kernel, patch, &view))
		return false;
	size_t sources = view.sources, targets = view.targets;
	float *y = take(pass, 2 * sources + 3, width), *h = take(pass, 2 * targets, n);
	float *spread = take(pass, sources * width, n), *dspread = take(pass, sources * width, n);
	if (!y || !h || !spread || !dspread)
		return false;
	float *dy = y + sources * width, *dh = h + targets * n;
	float *ysum = dy + sources * width, *dzsum = ysum + width, *dysum = dzsum + width;
	dz += view.row * width;
	scaled(&view, values + view.row * width, width, y);
	memset(dy, 0, (sources + 3) * width * sizeof *dy);
	gnp_rows_sum(sources, width, y, ysum);
	gnp_rows_sum(targets, width, dz, dzsum);
	bias_part_backward(pass, kernel, sources, ysum, dzsum, dysum, dy);
	gnp_blocks_spread(&kernel->blocks, sources, y, spread);
	for (size_t j = 0; j < sources; j++) {
		gnp_edges_fill(targets, n, view.a, view.b + j * n, h);
		gnp_linalg_gemm(GNP_TRANSPOSED, GNP_PLAIN, width, n, targets, 1, dz, width, h, n, 0, dspread + j * width * n, n);
		gnp_linalg_gemm(GNP_PLAIN, GNP_PLAIN, targets, n, width, 1, dz, width, spread + j * width * n, n, 0, dh, n);
		gnp_edges_fill_backward(targets, n, h, dh, view.da, view.db + j * n);
	}
	gnp_blocks_spread_backward(&kernel->blocks, sources, y, dspread, dy, pass->gradient + kernel->top.weight);
	close_patch_backward(pass, kernel, &view);
	for (size_t i = 0; i < sources * width; i++)
		dvalues[view.row * width + i] += dy[i] / (float)sources;
	return true;
}

/* The lift as values (terms, width) of the terms: v_j = sum_f x_j[f] lifted[f]. */
static void lifted_terms(const struct gnp_trunk_pass *pass, float *lifted)
{
	size_t width = pass->network->architecture.width, features = pass->tape->terms - 1;
	struct gnp_linear_place lift = gnp_trunk_place(pass->network, "model.lift", 0);
	for (size_t i = 0; i < width; i++) {
		for (size_t f = 0; f < features; f++)
			lifted[f * width + i] = pass->network->parameters[lift.weight + i * features + f];
		lifted[features * width + i] = pass->network->parameters[lift.bias + i];
	}
}

static void lifted_terms_backward(const struct gnp_trunk_pass *pass, const float *dlifted)
{
	size_t width = pass->network->architecture.width, features = pass->tape->terms - 1;
	struct gnp_linear_place lift = gnp_trunk_place(pass->network, "model.lift", 0);
	for (size_t i = 0; i < width; i++) {
		for (size_t f = 0; f < features; f++)
			pass->gradient[lift.weight + i * features + f] += dlifted[f * width + i];
		pass->gradient[lift.bias + i] += dlifted[features * width + i];
	}
}

/* The first layer's integrals: z_i = sum_f lifted[f] K with moments_if = mean_j x_j[f] h_ij in place of the hidden activations, one
 * contraction for all patches. */
static bool first_integral(const struct gnp_trunk_pass *pass, const struct kernel *kernel, struct gnp_trunk_kept *kept)
{
	struct gnp_trunk_tape *tape = pass->tape;
	size_t n = kernel->blocks.neurons, width = pass->network->architecture.width, terms = tape->terms;
	kept->moments = take(pass, tape->rows * terms, n);
	float *lifted = take(pass, terms, width), *spread = take(pass, terms * width, n), *xs = take(pass, GNP_QUADRATURE_MAX, terms);
	float *ysum = take(pass, 2, width);
	if (!kept->moments || !lifted || !spread || !xs || !ysum)
		return false;
	lifted_terms(pass, lifted);
	gnp_blocks_spread(&kernel->blocks, terms, lifted, spread);
	for (size_t p = 0; p < tape->patches; p++) {
		struct gnp_scratch_mark mark = gnp_scratch_mark(pass->scratch);
		struct view view;
		if (!open_patch(pass, kernel, p, &view))
			return false;
		scaled(&view, view.x, terms, xs);
		gnp_edges_moments(view.targets, view.sources, n, terms, view.a, view.b, xs, kept->moments + view.row * terms * n);
		float *y = take(pass, view.sources, width);
		if (!y)
			return false;
		scaled(&view, tape->values[0] + view.row * width, width, y);
		bias_part(kernel, view.sources, y, ysum, ysum + width);
		for (size_t i = 0; i < view.targets; i++)
			memcpy(kept->z + (view.row + i) * width, ysum + width, width * sizeof *ysum);
		gnp_scratch_release(pass->scratch, mark);
	}
	for (size_t f = 0; f < terms; f++)
		gnp_dense_forward_add(tape->rows, n, width, kept->moments + f * n, terms * n, spread + f * width * n, n, kept->z);
	return true;
}

static bool first_patch_backward(const struct gnp_trunk_pass *pass, const struct kernel *kernel, size_t patch, const float *dz,
                                 const float *dmoments, float *dvalues)
{
	const struct gnp_trunk_tape *tape = pass->tape;
	size_t n = kernel->blocks.neurons, width = pass->network->architecture.width, terms = tape->terms;
	struct view view;
	if (!open_patch(pass, kernel, patch, &view))
		return false;
	float *xs = take(pass, view.sources, terms), *y = take(pass, 2 * view.sources + 3, width);
	if (!xs || !y)
		return false;
	float *dy = y + view.sources * width, *ysum = dy + view.sources * width, *dzsum = ysum + width, *dysum = dzsum + width;
	scaled(&view, view.x, terms, xs);
	gnp_edges_moments_backward(view.targets, view.sources, n, terms, view.a, view.b, xs, dmoments + view.row * terms * n, view.da,
	                           view.db);
	close_patch_backward(pass, kernel, &view);
	scaled(&view, tape->values[0] + view.row * width, width, y);
	memset(dy, 0, (view.sources + 3) * width * sizeof *dy);
	gnp_rows_sum(view.sources, width, y, ysum);
	gnp_rows_sum(view.targets, width, dz + view.row * width, dzsum);
	bias_part_backward(pass, kernel, view.sources, ysum, dzsum, dysum, dy);
	for (size_t i = 0; i < view.sources * width; i++)
		dvalues[view.row * width + i] += dy[i] / (float)view.sources;
	return true;
}

static bool first_integral_backward(const struct gnp_trunk_pass *pass, const struct kernel *kernel, const float *dz, float *dvalues)
{
	const struct gnp_trunk_tape *tape = pass->tape;
	const float *moments = tape->kept[0].moments;
	size_t n = kernel->blocks.neurons, width = pass->network->architecture.width, terms = tape->terms;
	float *lifted = take(pass, 2 * terms, width), *spread = take(pass, 2 * terms * width, n);
	float *dmoments = take(pass, tape->rows * terms, n);
	if (!lifted || !spread || !dmoments)
		return false;
	float *dlifted = lifted + terms * width, *dspread = spread + terms * width * n;
	lifted_terms(pass, lifted);
	gnp_blocks_spread(&kernel->blocks, terms, lifted, spread);
	for (size_t f = 0; f < terms; f++) {
		gnp_linalg_gemm(GNP_TRANSPOSED, GNP_PLAIN, width, n, tape->rows, 1, dz, width, moments + f * n, terms * n, 0,
		                dspread + f * width * n, n);
		gnp_linalg_gemm(GNP_PLAIN, GNP_PLAIN, tape->rows, n, width, 1, dz, width, spread + f * width * n, n, 0, dmoments + f * n,
		                terms * n);
	}
	memset(dlifted, 0, terms * width * sizeof *dlifted);
	gnp_blocks_spread_backward(&kernel->blocks, terms, lifted, dspread, dlifted, pass->gradient + kernel->top.weight);
	lifted_terms_backward(pass, dlifted);
	for (size_t p = 0; p < tape->patches; p++) {
		struct gnp_scratch_mark mark = gnp_scratch_mark(pass->scratch);
		if (!first_patch_backward(pass, kernel, p, dz, dmoments, dvalues))
			return false;
		gnp_scratch_release(pass->scratch, mark);
	}
	return true;
}

bool gnp_edge_integral(const struct gnp_trunk_pass *pass, unsigned layer)
{
	struct gnp_trunk_tape *tape = pass->tape;
	struct gnp_trunk_kept *kept = &tape->kept[layer];
	struct kernel kernel = kernel_of(pass->network, layer);
	kept->z = take(pass, tape->rows, pass->network->architecture.width);
	if (!kept->z)
		return false;
	if (layer == 0)
		return first_integral(pass, &kernel, kept);
	float *sliced = take(pass, pass->network->architecture.width * kernel.blocks.side, kernel.blocks.neurons);
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
	struct kernel kernel = kernel_of(pass->network, layer);
	struct gnp_scratch_mark whole = gnp_scratch_mark(pass->scratch);
	if (layer == 0 && !first_integral_backward(pass, &kernel, dz, dvalues))
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

/* The mean of the last layer's integrals is that of its hidden activations: a source counts by one row, not by one a target. */
bool gnp_edge_mean_integral(const struct gnp_trunk_pass *pass, unsigned layer)
{
	struct gnp_trunk_tape *tape = pass->tape;
	struct gnp_trunk_kept *kept = &tape->kept[layer];
	struct kernel kernel = kernel_of(pass->network, layer);
	size_t n = kernel.blocks.neurons, width = pass->network->architecture.width;
	kept->z = take(pass, tape->patches, width);
	kept->moments = take(pass, tape->patches * width, n);
	float *ysum = take(pass, 1, width), *zbias = take(pass, tape->patches, width);
	if (!kept->z || !kept->moments || !ysum || !zbias)
		return false;
	for (size_t p = 0; p < tape->patches; p++) {
		struct gnp_scratch_mark mark = gnp_scratch_mark(pass->scratch);
		struct view view;
		if (!open_patch(pass, &kernel, p, &view))
			return false;
		float *y = take(pass, view.sources, width), *mean = take(pass, view.sources, n);
		if (!y || !mean)
			return false;
		scaled(&view, tape->values[layer] + view.row * width, width, y);
		bias_part(&kernel, view.sources, y, ysum, zbias + p * width);
		gnp_edges_mean(view.targets, view.sources, n, tape->share + view.row, view.a, view.b, mean);
		gnp_linalg_gemm(GNP_TRANSPOSED, GNP_PLAIN, width, n, view.sources, 1, y, width, mean, n, 0, kept->moments + p * width * n, n);
		gnp_scratch_release(pass->scratch, mark);
	}
	gnp_blocks_gather(&kernel.blocks, tape->patches, kept->moments, kept->z);
	for (size_t i = 0; i < tape->patches * width; i++)
		kept->z[i] += zbias[i];
	return true;
}

static bool mean_patch_backward(const struct gnp_trunk_pass *pass, const struct kernel *kernel, size_t patch, const float *values,
                                const float *dz, const float *dmoments, float *dvalues)
{
	const struct gnp_trunk_tape *tape = pass->tape;
	size_t n = kernel->blocks.neurons, width = pass->network->architecture.width;
	struct view view;
	if (!open_patch(pass, kernel, patch, &view))
		return false;
	size_t sources = view.sources;
	float *y = take(pass, 2 * sources + 2, width), *mean = take(pass, 2 * sources, n);
	if (!y || !mean)
		return false;
	float *dy = y + sources * width, *ysum = dy + sources * width, *dysum = ysum + width, *dmean = mean + sources * n;
	scaled(&view, values + view.row * width, width, y);
	memset(dy, 0, (sources + 2) * width * sizeof *dy);
	gnp_rows_sum(sources, width, y, ysum);
	bias_part_backward(pass, kernel, sources, ysum, dz, dysum, dy);
	gnp_edges_mean(view.targets, sources, n, tape->share + view.row, view.a, view.b, mean);
	gnp_linalg_gemm(GNP_PLAIN, GNP_PLAIN, sources, n, width, 1, y, width, dmoments, n, 0, dmean, n);
	gnp_linalg_gemm(GNP_PLAIN, GNP_TRANSPOSED, sources, width, n, 1, mean, n, dmoments, n, 1, dy, width);
	gnp_edges_mean_backward(view.targets, sources, n, tape->share + view.row, view.a, view.b, dmean, view.da, view.db);
	close_patch_backward(pass, kernel, &view);
	for (size_t i = 0; i < sources * width; i++)
		dvalues[view.row * width + i] += dy[i] / (float)sources;
	return true;
}

bool gnp_edge_mean_integral_backward(const struct gnp_trunk_pass *pass, unsigned layer, const float *dz, float *dvalues)
{
	const struct gnp_trunk_tape *tape = pass->tape;
	struct kernel kernel = kernel_of(pass->network, layer);
	size_t n = kernel.blocks.neurons, width = pass->network->architecture.width;
	struct gnp_scratch_mark whole = gnp_scratch_mark(pass->scratch);
	float *dmoments = take(pass, tape->patches * width, n);
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
