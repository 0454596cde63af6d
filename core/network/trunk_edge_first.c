#include "core/network/trunk_edge_first.h"

#include <string.h>

#include "core/linear/linalg.h"
#include "core/network/dense.h"
#include "core/network/edges.h"

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

/* The first layer's integrals: z_i = sum_f lifted[f] K with moments_if = mean_j x_j[f] h_ij in place of the hidden
 * activations, one contraction for all patches. */
bool gnp_trunk_edge_first(const struct gnp_trunk_pass *pass, const struct gnp_edge_kernel *kernel,
                          struct gnp_trunk_kept *kept)
{
	struct gnp_trunk_tape *tape = pass->tape;
	size_t n = kernel->blocks.neurons, width = pass->network->architecture.width, terms = tape->terms;
	kept->moments = gnp_edge_kernel_take(pass, tape->rows * terms, n);
	float *lifted = gnp_edge_kernel_take(pass, terms, width), *spread = gnp_edge_kernel_take(pass, terms * width, n),
		  *xs = gnp_edge_kernel_take(pass, GNP_QUADRATURE_MAX, terms);
	float *ysum = gnp_edge_kernel_take(pass, 2, width);
	if (!kept->moments || !lifted || !spread || !xs || !ysum)
		return false;
	lifted_terms(pass, lifted);
	gnp_blocks_spread(&kernel->blocks, terms, lifted, spread);
	for (size_t p = 0; p < tape->patches; p++) {
		struct gnp_scratch_mark mark = gnp_scratch_mark(pass->scratch);
		struct gnp_edge_patch view;
		if (!gnp_edge_kernel_open(pass, kernel, p, &view))
			return false;
		gnp_edge_kernel_scaled(&view, view.x, terms, xs);
		gnp_edges_moments(view.targets, view.sources, n, terms, view.a, view.b, xs, kept->moments + view.row * terms * n);
		float *y = gnp_edge_kernel_take(pass, view.sources, width);
		if (!y)
			return false;
		gnp_edge_kernel_scaled(&view, tape->values[0] + view.row * width, width, y);
		gnp_edge_kernel_bias(kernel, view.sources, y, ysum, ysum + width);
		for (size_t i = 0; i < view.targets; i++)
			memcpy(kept->z + (view.row + i) * width, ysum + width, width * sizeof *ysum);
		gnp_scratch_release(pass->scratch, mark);
	}
	for (size_t f = 0; f < terms; f++)
		gnp_dense_forward_add(tape->rows, n, width, kept->moments + f * n, terms * n, spread + f * width * n, n, kept->z);
	return true;
}

static bool first_patch_backward(const struct gnp_trunk_pass *pass, const struct gnp_edge_kernel *kernel, size_t patch,
                                 const float *dz, const float *dmoments, float *dvalues)
{
	const struct gnp_trunk_tape *tape = pass->tape;
	size_t n = kernel->blocks.neurons, width = pass->network->architecture.width, terms = tape->terms;
	struct gnp_edge_patch view;
	if (!gnp_edge_kernel_open(pass, kernel, patch, &view))
		return false;
	float *xs = gnp_edge_kernel_take(pass, view.sources, terms), *y = gnp_edge_kernel_take(pass, 2 * view.sources + 3, width);
	if (!xs || !y)
		return false;
	float *dy = y + view.sources * width, *ysum = dy + view.sources * width, *dzsum = ysum + width, *dysum = dzsum + width;
	gnp_edge_kernel_scaled(&view, view.x, terms, xs);
	gnp_edges_moments_backward(view.targets, view.sources, n, terms, view.a, view.b, xs, dmoments + view.row * terms * n, view.da,
	                           view.db);
	gnp_edge_kernel_close_backward(pass, kernel, &view);
	gnp_edge_kernel_scaled(&view, tape->values[0] + view.row * width, width, y);
	memset(dy, 0, (view.sources + 3) * width * sizeof *dy);
	gnp_rows_sum(view.sources, width, y, ysum);
	gnp_rows_sum(view.targets, width, dz + view.row * width, dzsum);
	gnp_edge_kernel_bias_backward(pass, kernel, view.sources, ysum, dzsum, dysum, dy);
	for (size_t i = 0; i < view.sources * width; i++)
		dvalues[view.row * width + i] += dy[i] / (float)view.sources;
	return true;
}

bool gnp_trunk_edge_first_backward(const struct gnp_trunk_pass *pass, const struct gnp_edge_kernel *kernel,
                                   const float *dz, float *dvalues)
{
	const struct gnp_trunk_tape *tape = pass->tape;
	const float *moments = tape->kept[0].moments;
	size_t n = kernel->blocks.neurons, width = pass->network->architecture.width, terms = tape->terms;
	float *lifted = gnp_edge_kernel_take(pass, 2 * terms, width), *spread = gnp_edge_kernel_take(pass, 2 * terms * width, n);
	float *dmoments = gnp_edge_kernel_take(pass, tape->rows * terms, n);
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
