#include "core/network/blocks.h"

#include <string.h>

#include "core/linear/linalg.h"

void gnp_blocks_spread(const struct gnp_blocks *blocks, size_t rows, const float *y, float *spread)
{
	size_t h = blocks->side, n = blocks->neurons, width = blocks->channels * h;
	for (size_t c = 0; c < blocks->channels; c++)
		gnp_linalg_gemm(GNP_PLAIN, GNP_PLAIN, rows, h * n, h, 1, y + c * h, width, blocks->weight + c * h * h * n, h * n, 0,
		                spread + c * h * n, width * n);
}

void gnp_blocks_slice(const struct gnp_blocks *blocks, size_t step, float *sliced)
{
	size_t n = blocks->neurons, outputs = blocks->channels * blocks->side * blocks->side;
	for (size_t p = 0; p < n; p += step) {
		size_t count = n - p < step ? n - p : step;
		for (size_t i = 0; i < outputs; i++)
			memcpy(sliced + outputs * p + i * count, blocks->weight + i * n + p, count * sizeof *sliced);
	}
}

void gnp_blocks_spread_slice(const struct gnp_blocks *blocks, const float *slice, size_t count, size_t rows,
                             const float *y, float *spread)
{
	size_t h = blocks->side, width = blocks->channels * h;
	for (size_t c = 0; c < blocks->channels; c++)
		gnp_linalg_gemm(GNP_TRANSPOSED, GNP_TRANSPOSED, h * count, rows, h, 1, slice + c * h * h * count, h * count, y + c * h,
		                width, 0, spread + c * h * count * rows, rows);
}

void gnp_blocks_spread_backward(const struct gnp_blocks *blocks, size_t rows, const float *y, const float *dspread,
                                float *dy, float *dweight)
{
	size_t h = blocks->side, n = blocks->neurons, width = blocks->channels * h;
	for (size_t c = 0; c < blocks->channels; c++) {
		const float *d = dspread + c * h * n;
		gnp_linalg_gemm(GNP_TRANSPOSED, GNP_PLAIN, h, h * n, rows, 1, y + c * h, width, d, width * n, 1,
		                dweight + c * h * h * n, h * n);
		gnp_linalg_gemm(GNP_PLAIN, GNP_TRANSPOSED, rows, h, h * n, 1, d, width * n, blocks->weight + c * h * h * n, h * n, 1,
		                dy + c * h, width);
	}
}

void gnp_blocks_gather(const struct gnp_blocks *blocks, size_t rows, const float *moments, float *z)
{
	size_t h = blocks->side, n = blocks->neurons, width = blocks->channels * h;
	for (size_t in = 0; in < width; in++)
		gnp_linalg_gemm(GNP_PLAIN, GNP_TRANSPOSED, rows, h, n, 1, moments + in * n, width * n, blocks->weight + in * h * n, n,
		                in % h ? 1 : 0, z + in / h * h, width);
}

void gnp_blocks_gather_backward(const struct gnp_blocks *blocks, size_t rows, const float *moments, const float *dz,
                                float *dmoments, float *dweight)
{
	size_t h = blocks->side, n = blocks->neurons, width = blocks->channels * h;
	for (size_t in = 0; in < width; in++) {
		const float *d = dz + in / h * h;
		gnp_linalg_gemm(GNP_PLAIN, GNP_PLAIN, rows, n, h, 1, d, width, blocks->weight + in * h * n, n, 0, dmoments + in * n,
		                width * n);
		gnp_linalg_gemm(GNP_TRANSPOSED, GNP_PLAIN, h, n, rows, 1, d, width, moments + in * n, width * n, 1,
		                dweight + in * h * n, n);
	}
}

void gnp_blocks_bias(const struct gnp_blocks *blocks, size_t rows, const float *y, float *z)
{
	size_t h = blocks->side, width = blocks->channels * h;
	for (size_t c = 0; c < blocks->channels; c++)
		gnp_linalg_gemm(GNP_PLAIN, GNP_PLAIN, rows, h, h, 1, y + c * h, width, blocks->bias + c * h * h, h, 1, z + c * h, width);
}

void gnp_blocks_bias_backward(const struct gnp_blocks *blocks, size_t rows, const float *y, const float *dz, float *dy,
                              float *dbias)
{
	size_t h = blocks->side, width = blocks->channels * h;
	for (size_t c = 0; c < blocks->channels; c++) {
		gnp_linalg_gemm(GNP_TRANSPOSED, GNP_PLAIN, h, h, rows, 1, y + c * h, width, dz + c * h, width, 1, dbias + c * h * h, h);
		gnp_linalg_gemm(GNP_PLAIN, GNP_TRANSPOSED, rows, h, h, 1, dz + c * h, width, blocks->bias + c * h * h, h, 1, dy + c * h,
		                width);
	}
}
