#include "core/network/dense.h"

#include <string.h>

#include "core/base/simd.h"
#include "core/linear/linalg.h"

void gnp_dense_forward_add(size_t rows, size_t in, size_t out, const float *x, size_t ldx, const float *weight,
                           size_t ldw, float *y)
{
	gnp_linalg_gemm(GNP_PLAIN, GNP_TRANSPOSED, rows, out, in, 1, x, ldx, weight, ldw, 1, y, out);
}

void gnp_dense_forward(size_t rows, size_t in, size_t out, const float *x, size_t ldx, const float *weight, size_t ldw,
                       const float *bias, float *y)
{
	for (size_t r = 0; bias && r < rows; r++)
		memcpy(y + r * out, bias, out * sizeof *y);
	gnp_linalg_gemm(GNP_PLAIN, GNP_TRANSPOSED, rows, out, in, 1, x, ldx, weight, ldw, bias ? 1 : 0, y, out);
}

void gnp_dense_backward(size_t rows, size_t in, size_t out, const float *x, size_t ldx, const float *weight, size_t ldw,
                        const float *dy, float *dx, float *dweight, float *dbias)
{
	if (dx)
		gnp_linalg_gemm(GNP_PLAIN, GNP_PLAIN, rows, in, out, 1, dy, out, weight, ldw, 0, dx, ldx);
	if (dweight)
		gnp_linalg_gemm(GNP_TRANSPOSED, GNP_PLAIN, out, in, rows, 1, dy, out, x, ldx, 1, dweight, ldw);
	if (dbias)
		gnp_rows_sum(rows, out, dy, dbias);
}

GNP_INLINE void rows_sum(size_t rows, size_t width, const float *restrict x, float *restrict sum)
{
	for (size_t r = 0; r < rows; r++)
		for (size_t i = 0; i < width; i++)
			sum[i] += x[r * width + i];
}
GNP_SIMD_DISPATCH(, gnp_rows_sum, rows_sum, (size_t rows, size_t width, const float *x, float *sum), (rows, width, x, sum))

GNP_INLINE void bias_relu(size_t rows, size_t width, const float *restrict bias, float *restrict x)
{
	for (size_t r = 0; r < rows; r++)
		for (size_t i = 0; i < width; i++) {
			float sum = x[r * width + i] + bias[i];
			x[r * width + i] = sum > 0 ? sum : 0;
		}
}
GNP_SIMD_DISPATCH(, gnp_bias_relu, bias_relu, (size_t rows, size_t width, const float *bias, float *x), (rows, width, bias, x))

GNP_INLINE void relu(size_t count, float *x)
{
	for (size_t i = 0; i < count; i++)
		x[i] = x[i] > 0 ? x[i] : 0;
}
GNP_SIMD_DISPATCH(, gnp_relu, relu, (size_t count, float *x), (count, x))

GNP_INLINE void relu_backward(size_t count, const float *restrict x, float *restrict dx)
{
	for (size_t i = 0; i < count; i++)
		dx[i] = x[i] > 0 ? dx[i] : 0;
}
GNP_SIMD_DISPATCH(, gnp_relu_backward, relu_backward, (size_t count, const float *x, float *dx), (count, x, dx))
