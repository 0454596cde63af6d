#include "core/fit/least_squares.h"

#include <math.h>
#include <string.h>

#include "core/base/simd.h"

/* A tile of `high` rows r.. and two vectors of columns c.. of the Gram matrix, held in registers over all points. A target's registers
 * decide the tile: what does not fit is spilled at every point, ten times slower. */
#define GRAM_TILE(name, vector, unaligned, lanes, high)                                                             \
	GNP_INLINE void name(const double *phi, const double *weight, size_t count, size_t stride, size_t r, size_t c, \
	                     int wide, double *gram)                                                                   \
	{                                                                                                              \
		vector sum[2][high] = {{{0}}};                                                                             \
		for (size_t i = 0; i < count; i++) {                                                                       \
			const double *row = phi + i * stride;                                                                  \
			for (int w = 0; w < wide; w++) {                                                                       \
				vector right = *(const unaligned *)(row + c + (lanes) * w) * weight[i];                            \
				for (int k = 0; k < (high); k++)                                                                   \
					sum[w][k] += row[r + k] * right;                                                               \
			}                                                                                                      \
		}                                                                                                          \
		for (int w = 0; w < wide; w++)                                                                             \
			for (int k = 0; k < (high); k++)                                                                       \
				*(unaligned *)(gram + (r + k) * stride + c + (lanes) * w) = sum[w][k];                             \
	}
GRAM_TILE(gram_tile_8, gnp_v8, gnp_v8u, 8, 8)
GRAM_TILE(gram_tile_4, gnp_v4, gnp_v4u, 4, 4)

GNP_INLINE void moment_body(const double *phi, const double *weight, const double *y, size_t count, size_t stride,
                            double *moment)
{
	for (size_t c = 0; c < stride; c += 4) {
		gnp_v4 sum = {0};
		for (size_t i = 0; i < count; i++)
			sum += *(const gnp_v4u *)(phi + i * stride + c) * (weight[i] * y[i]);
		*(gnp_v4u *)(moment + c) = sum;
	}
}

GNP_INLINE void residuals_body(const double *phi, const double *y, size_t count, size_t stride, const double *c,
                               double *residual)
{
	for (size_t i = 0; i < count; i++) {
		gnp_v8 sum = {0};
		for (size_t k = 0; k < stride; k += GNP_SIMD_WIDTH)
			sum += *(const gnp_v8u *)(phi + i * stride + k) * *(const gnp_v8u *)(c + k);
		residual[i] = y[i] - (((sum[0] + sum[4]) + (sum[2] + sum[6])) + ((sum[1] + sum[5]) + (sum[3] + sum[7])));
	}
}

GNP_SIMD_DISPATCH(, gnp_residuals, residuals_body,
                  (const double *phi, const double *y, size_t count, size_t stride, const double *c, double *residual),
                  (phi, y, count, stride, c, residual))

/* 32 vector registers. */
GNP_INLINE void normal_equations_wide(const double *phi, const double *weight, const double *y, size_t count,
                                      size_t stride, double *gram, double *moment)
{
	for (size_t r = 0; r < stride; r += 8)
		for (size_t c = r; c < stride; c += 16)
			if (c + 8 < stride)
				gram_tile_8(phi, weight, count, stride, r, c, 2, gram);
			else
				gram_tile_8(phi, weight, count, stride, r, c, 1, gram);
	moment_body(phi, weight, y, count, stride, moment);
}

/* 16 of them. */
GNP_INLINE void normal_equations_narrow(const double *phi, const double *weight, const double *y, size_t count,
                                        size_t stride, double *gram, double *moment)
{
	for (size_t r = 0; r < stride; r += 4)
		for (size_t c = r & ~(size_t)7; c < stride; c += 8)
			gram_tile_4(phi, weight, count, stride, r, c, 2, gram);
	moment_body(phi, weight, y, count, stride, moment);
}

GNP_SIMD_DISPATCH_TWO(, gnp_normal_equations, normal_equations_wide, normal_equations_narrow,
                  (const double *phi, const double *weight, const double *y, size_t count, size_t stride, double *gram,
                   double *moment),
                  (phi, weight, y, count, stride, gram, moment))

/* Right-looking: each finished row is taken off the rows below it, in whole vectors from the one that holds the diagonal. */
#define FACTOR(name, unaligned, lanes)                                                                             \
	GNP_INLINE void name(double *gram, size_t size, size_t stride, double smallest_pivot, bool *regular)           \
	{                                                                                                              \
		double floor[64];                                                                                          \
		*regular = false;                                                                                          \
		for (size_t i = 0; i < size; i++)                                                                          \
			floor[i] = smallest_pivot * gram[i * stride + i];                                                      \
		for (size_t k = 0; k < size; k++) {                                                                        \
			double *pivot_row = gram + k * stride, pivot = pivot_row[k];                                           \
			if (!(pivot > floor[k]) || !(pivot > 0) || !isfinite(pivot))                                           \
				return;                                                                                            \
			double inverse = 1 / sqrt(pivot);                                                                      \
			for (size_t c = k & ~(size_t)((lanes) - 1); c < stride; c += (lanes))                                  \
				*(unaligned *)(pivot_row + c) *= inverse;                                                          \
			for (size_t i = k + 1; i < size; i++) {                                                                \
				double share = pivot_row[i], *row = gram + i * stride;                                             \
				for (size_t c = i & ~(size_t)((lanes) - 1); c < stride; c += (lanes))                              \
					*(unaligned *)(row + c) -= share * *(const unaligned *)(pivot_row + c);                        \
			}                                                                                                      \
			pivot_row[k] = inverse; /* the inverse is what all uses need */                                        \
		}                                                                                                          \
		*regular = true;                                                                                           \
	}
FACTOR(factor_wide, gnp_v8u, 8)
FACTOR(factor_narrow, gnp_v4u, 4)

GNP_SIMD_DISPATCH_TWO(static, factor, factor_wide, factor_narrow,
                  (double *gram, size_t size, size_t stride, double smallest_pivot, bool *regular),
                  (gram, size, stride, smallest_pivot, regular))

bool gnp_cholesky_factor(double *gram, size_t size, size_t stride, double smallest_pivot)
{
	bool regular;
	factor(gram, size, stride, smallest_pivot, &regular);
	return regular;
}

GNP_INLINE void forward_body(const double *u, size_t size, size_t stride, const double *b, double *z)
{
	if (z != b)
		memcpy(z, b, stride * sizeof *z);
	for (size_t k = 0; k < size; k++) {
		const double *row = u + k * stride;
		double value = z[k] * row[k];
		for (size_t j = k + 1; j < size; j++)
			z[j] -= value * row[j];
		z[k] = value;
	}
}

GNP_SIMD_DISPATCH(, gnp_cholesky_forward, forward_body,
                  (const double *u, size_t size, size_t stride, const double *b, double *z), (u, size, stride, b, z))

GNP_INLINE void backward_body(const double *u, size_t size, size_t stride, const double *z, double *x)
{
	for (size_t i = size; i-- > 0;) {
		const double *row = u + i * stride;
		double sum = z[i];
		for (size_t j = i + 1; j < size; j++)
			sum -= row[j] * x[j];
		x[i] = sum * row[i];
	}
}

GNP_SIMD_DISPATCH(, gnp_cholesky_backward, backward_body,
                  (const double *u, size_t size, size_t stride, const double *z, double *x), (u, size, stride, z, x))

double gnp_cholesky_log_determinant(const double *u, size_t size, size_t stride)
{
	double log_sum = 0, product = 1;
	for (size_t i = 0; i < size; i++) {
		product *= u[i * stride + i];
		if (product < 1e-200 || product > 1e200) {
			log_sum += log(product);
			product = 1;
		}
	}
	return -2 * (log_sum + log(product));
}
