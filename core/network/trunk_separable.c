#include <string.h>

#include "core/linear/linalg.h"
#include "core/network/dense.h"
#include "core/network/trunk_parts.h"

/* K1 of sources or K2 of targets: an MLP on a node's features, two hidden layers and the blocks. */
struct kernel {
	struct gnp_linear_place place[3];
	struct gnp_blocks blocks;
};

static struct kernel kernel_of(const struct gnp_network *network, unsigned layer, int which)
{
	static const char *const names[2][3] = {
		{"convs.#.kernel1.layers.0", "convs.#.kernel1.layers.1", "convs.#.kernel1.layers.2"},
		{"convs.#.kernel2.layers.0", "convs.#.kernel2.layers.1", "convs.#.kernel2.layers.2"}};
	struct kernel kernel;
	for (int i = 0; i < 3; i++)
		kernel.place[i] = gnp_trunk_place(network, names[which][i], layer);
	kernel.blocks = gnp_trunk_blocks(network, kernel.place[2]);
	return kernel;
}

static float *take(const struct gnp_trunk_pass *pass, size_t rows, size_t columns)
{
	size_t count = rows * columns;
	return gnp_scratch_take(pass->scratch, count, sizeof(float));
}

/* hidden (2): (rows, n) each; x (rows, terms). */
static void hidden_forward(const struct gnp_trunk_pass *pass, const struct kernel *kernel, size_t rows, const float *x,
                           float *const *hidden)
{
	const float *parameters = pass->network->parameters;
	size_t n = kernel->blocks.neurons, terms = pass->tape->terms;
	gnp_dense_forward(rows, terms - 1, n, x, terms, parameters + kernel->place[0].weight, terms - 1, NULL, hidden[0]);
	gnp_bias_relu(rows, n, parameters + kernel->place[0].bias, hidden[0]);
	gnp_dense_forward(rows, n, n, hidden[0], n, parameters + kernel->place[1].weight, n, NULL, hidden[1]);
	gnp_bias_relu(rows, n, parameters + kernel->place[1].bias, hidden[1]);
}

/* dhidden (rows, n): of the second layer; it is used up. dfirst: scratch of the same size. */
static void hidden_backward(const struct gnp_trunk_pass *pass, const struct kernel *kernel, size_t rows, const float *x,
                            float *const *hidden, float *dhidden, float *dfirst)
{
	size_t n = kernel->blocks.neurons, terms = pass->tape->terms;
	float *gradient = pass->gradient;
	gnp_relu_backward(rows * n, hidden[1], dhidden);
	gnp_dense_backward(rows, n, n, hidden[0], n, pass->network->parameters + kernel->place[1].weight, n, dhidden, dfirst,
	                   gradient + kernel->place[1].weight, gradient + kernel->place[1].bias);
	gnp_relu_backward(rows * n, hidden[0], dfirst);
	gnp_dense_backward(rows, terms - 1, n, x, terms, NULL, terms - 1, dfirst, NULL, gradient + kernel->place[0].weight,
	                   gradient + kernel->place[0].bias);
}

/* y (rows, width): values / nodes of the patch; sum (patches, width) of y. */
static void scale(const struct gnp_trunk_pass *pass, const float *values, float *y, float *sum)
{
	const struct gnp_trunk_tape *tape = pass->tape;
	size_t width = pass->network->architecture.width;
	memset(sum, 0, tape->patches * width * sizeof *sum);
	for (size_t p = 0; p < tape->patches; p++) {
		size_t row = tape->first[p], count = tape->first[p + 1] - row;
		float factor = 1 / (float)count;
		for (size_t i = row * width; i < (row + count) * width; i++)
			y[i] = factor * values[i];
		gnp_rows_sum(count, width, y + row * width, sum + p * width);
	}
}

static bool take_kept(const struct gnp_trunk_pass *pass, struct gnp_trunk_kept *kept)
{
	const struct gnp_trunk_tape *tape = pass->tape;
	size_t n = pass->network->architecture.neurons, width = pass->network->architecture.width;
	for (int i = 0; i < 4; i++)
		if (!(kept->hidden[i] = take(pass, tape->rows, n)))
			return false;
	kept->moments = take(pass, tape->patches * width, n);
	kept->pooled = take(pass, tape->patches, width);
	kept->spread = take(pass, tape->patches * width, n);
	return kept->moments && kept->pooled && kept->spread;
}

/* What both kinds of layers need: pooled, its spread by K2, K2's hidden layers; zbias (patches, width) the part of K2's
 * bias. */
static bool evaluate(const struct gnp_trunk_pass *pass, unsigned layer, struct gnp_trunk_kept *kept, float *zbias)
{
	const struct gnp_trunk_tape *tape = pass->tape;
	struct kernel source = kernel_of(pass->network, layer, 0), target = kernel_of(pass->network, layer, 1);
	size_t n = source.blocks.neurons, width = pass->network->architecture.width;
	float *y = take(pass, tape->rows, width), *sum = take(pass, tape->patches, width);
	if (!y || !sum || !take_kept(pass, kept))
		return false;
	scale(pass, tape->values[layer], y, sum);
	hidden_forward(pass, &source, tape->rows, tape->x, kept->hidden);
	for (size_t p = 0; p < tape->patches; p++) {
		size_t row = tape->first[p];
		gnp_linalg_gemm(GNP_TRANSPOSED, GNP_PLAIN, width, n, tape->first[p + 1] - row, 1, y + row * width, width,
		                kept->hidden[1] + row * n, n, 0, kept->moments + p * width * n, n);
	}
	gnp_blocks_gather(&source.blocks, tape->patches, kept->moments, kept->pooled);
	gnp_blocks_bias(&source.blocks, tape->patches, sum, kept->pooled);
	gnp_blocks_spread(&target.blocks, tape->patches, kept->pooled, kept->spread);
	memset(zbias, 0, tape->patches * width * sizeof *zbias);
	gnp_blocks_bias(&target.blocks, tape->patches, kept->pooled, zbias);
	hidden_forward(pass, &target, tape->rows, tape->x, kept->hidden + 2);
	return true;
}

bool gnp_separable_integral(const struct gnp_trunk_pass *pass, unsigned layer)
{
	const struct gnp_trunk_tape *tape = pass->tape;
	struct gnp_trunk_kept *kept = &pass->tape->kept[layer];
	size_t n = pass->network->architecture.neurons, width = pass->network->architecture.width;
	kept->z = take(pass, tape->rows, width);
	float *zbias = take(pass, tape->patches, width);
	if (!kept->z || !zbias || !evaluate(pass, layer, kept, zbias))
		return false;
	for (size_t p = 0; p < tape->patches; p++)
		gnp_dense_forward(tape->first[p + 1] - tape->first[p], n, width, kept->hidden[3] + tape->first[p] * n, n,
		                  kept->spread + p * width * n, n, zbias + p * width, kept->z + tape->first[p] * width);
	return true;
}

bool gnp_separable_mean_integral(const struct gnp_trunk_pass *pass, unsigned layer)
{
	const struct gnp_trunk_tape *tape = pass->tape;
	struct gnp_trunk_kept *kept = &pass->tape->kept[layer];
	size_t n = pass->network->architecture.neurons, width = pass->network->architecture.width;
	kept->z = take(pass, tape->patches, width);
	kept->average = take(pass, tape->patches, n);
	float *zbias = take(pass, tape->patches, width);
	if (!kept->z || !kept->average || !zbias || !evaluate(pass, layer, kept, zbias))
		return false;
	for (size_t p = 0; p < tape->patches; p++) {
		size_t row = tape->first[p];
		gnp_linalg_gemm(GNP_PLAIN, GNP_PLAIN, 1, n, tape->first[p + 1] - row, 1, tape->share + row, tape->first[p + 1] - row,
		                kept->hidden[3] + row * n, n, 0, kept->average + p * n, n);
		gnp_dense_forward(1, n, width, kept->average + p * n, n, kept->spread + p * width * n, n, zbias + p * width,
		                  kept->z + p * width);
	}
	return true;
}

/* From dspread (patches, width, n), dhidden (rows, n) of K2 and dzsum (patches, width) to all parameters and the
 * values. */
static bool evaluate_backward(const struct gnp_trunk_pass *pass, unsigned layer, const float *dspread, float *dhidden,
                              const float *dzsum, float *dvalues)
{
	const struct gnp_trunk_tape *tape = pass->tape;
	const struct gnp_trunk_kept *kept = &tape->kept[layer];
	struct kernel source = kernel_of(pass->network, layer, 0), target = kernel_of(pass->network, layer, 1);
	size_t n = source.blocks.neurons, width = pass->network->architecture.width;
	float *y = take(pass, 2 * tape->rows, width), *sum = take(pass, tape->patches, width);
	float *dpooled = take(pass, 2 * tape->patches, width), *dmoments = take(pass, tape->patches * width, n);
	float *dfirst = take(pass, tape->rows, n), *dsource = take(pass, tape->rows, n);
	if (!y || !sum || !dpooled || !dmoments || !dfirst || !dsource)
		return false;
	float *dy = y + tape->rows * width;
	scale(pass, tape->values[layer], y, sum);
	float *dsum = dpooled + tape->patches * width;
	memset(dpooled, 0, 2 * tape->patches * width * sizeof *dpooled);
	hidden_backward(pass, &target, tape->rows, tape->x, kept->hidden + 2, dhidden, dfirst);
	gnp_blocks_spread_backward(&target.blocks, tape->patches, kept->pooled, dspread, dpooled,
	                           pass->gradient + target.place[2].weight);
	gnp_blocks_bias_backward(&target.blocks, tape->patches, kept->pooled, dzsum, dpooled, pass->gradient + target.place[2].bias);
	gnp_blocks_gather_backward(&source.blocks, tape->patches, kept->moments, dpooled, dmoments,
	                           pass->gradient + source.place[2].weight);
	gnp_blocks_bias_backward(&source.blocks, tape->patches, sum, dpooled, dsum, pass->gradient + source.place[2].bias);
	for (size_t p = 0; p < tape->patches; p++) {
		size_t row = tape->first[p], count = tape->first[p + 1] - row;
		const float *d = dmoments + p * width * n;
		gnp_linalg_gemm(GNP_PLAIN, GNP_PLAIN, count, n, width, 1, y + row * width, width, d, n, 0, dsource + row * n, n);
		gnp_dense_forward(count, n, width, kept->hidden[1] + row * n, n, d, n, dsum + p * width, dy + row * width);
		for (size_t i = row * width; i < (row + count) * width; i++)
			dvalues[i] += dy[i] / (float)count;
	}
	hidden_backward(pass, &source, tape->rows, tape->x, kept->hidden, dsource, dfirst);
	return true;
}

bool gnp_separable_integral_backward(const struct gnp_trunk_pass *pass, unsigned layer, const float *dz, float *dvalues)
{
	const struct gnp_trunk_tape *tape = pass->tape;
	const struct gnp_trunk_kept *kept = &tape->kept[layer];
	size_t n = pass->network->architecture.neurons, width = pass->network->architecture.width;
	struct gnp_scratch_mark mark = gnp_scratch_mark(pass->scratch);
	float *dspread = take(pass, tape->patches * width, n), *dhidden = take(pass, tape->rows, n);
	float *dzsum = take(pass, tape->patches, width);
	if (!dspread || !dhidden || !dzsum)
		return false;
	memset(dzsum, 0, tape->patches * width * sizeof *dzsum);
	for (size_t p = 0; p < tape->patches; p++) {
		size_t row = tape->first[p], count = tape->first[p + 1] - row;
		gnp_rows_sum(count, width, dz + row * width, dzsum + p * width);
		gnp_linalg_gemm(GNP_TRANSPOSED, GNP_PLAIN, width, n, count, 1, dz + row * width, width, kept->hidden[3] + row * n, n, 0,
		                dspread + p * width * n, n);
		gnp_linalg_gemm(GNP_PLAIN, GNP_PLAIN, count, n, width, 1, dz + row * width, width, kept->spread + p * width * n, n, 0,
		                dhidden + row * n, n);
	}
	bool done = evaluate_backward(pass, layer, dspread, dhidden, dzsum, dvalues);
	gnp_scratch_release(pass->scratch, mark);
	return done;
}

bool gnp_separable_mean_integral_backward(const struct gnp_trunk_pass *pass, unsigned layer, const float *dz,
                                          float *dvalues)
{
	const struct gnp_trunk_tape *tape = pass->tape;
	const struct gnp_trunk_kept *kept = &tape->kept[layer];
	size_t n = pass->network->architecture.neurons, width = pass->network->architecture.width;
	struct gnp_scratch_mark mark = gnp_scratch_mark(pass->scratch);
	float *dspread = take(pass, tape->patches * width, n), *dhidden = take(pass, tape->rows, n), *daverage = take(pass, 1, n);
	if (!dspread || !dhidden || !daverage)
		return false;
	for (size_t p = 0; p < tape->patches; p++) {
		const float *d = dz + p * width;
		gnp_linalg_gemm(GNP_TRANSPOSED, GNP_PLAIN, width, n, 1, 1, d, width, kept->average + p * n, n, 0, dspread + p * width * n, n);
		gnp_linalg_gemm(GNP_PLAIN, GNP_PLAIN, 1, n, width, 1, d, width, kept->spread + p * width * n, n, 0, daverage, n);
		for (size_t row = tape->first[p]; row < tape->first[p + 1]; row++)
			for (size_t i = 0; i < n; i++)
				dhidden[row * n + i] = tape->share[row] * daverage[i];
	}
	bool done = evaluate_backward(pass, layer, dspread, dhidden, dz, dvalues);
	gnp_scratch_release(pass->scratch, mark);
	return done;
}
