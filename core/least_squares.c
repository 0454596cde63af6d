#include "least_squares.h"

#include <math.h>
#include <string.h>

#include "simd.h"

/* A tile of 8 rows r.. and 8 * wide columns c.. of the Gram matrix, held in registers over all points. */
GNP_INLINE void gram_tile(const double *phi, const double *weight, size_t count, size_t stride, size_t r, size_t c,
                          int wide, double *gram)
{
	gnp_v8 sum[2][8] = {{{0}}};
	for (size_t i = 0; i < count; i++) {
		const double *row = phi + i * stride;
		for (int w = 0; w < wide; w++) {
			gnp_v8 right = *(const gnp_v8u *)(row + c + 8 * w) * weight[i];
			for (int k = 0; k < 8; k++)
				sum[w][k] += row[r + k] * right;
		}
	}
	for (int w = 0; w < wide; w++)
		for (int k = 0; k < 8; k++)
			*(gnp_v8u *)(gram + (r + k) * stride + c + 8 * w) = sum[w][k];
}

GNP_INLINE void normal_equations_body(const double *phi, const double *weight, const double *y, size_t count,
                                      size_t stride, double *gram, double *moment)
{
	for (size_t r = 0; r < stride; r += 8)
		for (size_t c = r; c < stride; c += 16)
			if (c + 8 < stride)
				gram_tile(phi, weight, count, stride, r, c, 2, gram);
			else
				gram_tile(phi, weight, count, stride, r, c, 1, gram);
	for (size_t c = 0; c < stride; c += 8) {
		gnp_v8 sum = {0};
		for (size_t i = 0; i < count; i++)
			sum += *(const gnp_v8u *)(phi + i * stride + c) * (weight[i] * y[i]);
		*(gnp_v8u *)(moment + c) = sum;
	}
}

GNP_SIMD_DISPATCH(, gnp_normal_equations, normal_equations_body,
                  (const double *phi, const double *weight, const double *y, size_t count, size_t stride, double *gram,
                   double *moment),
                  (phi, weight, y, count, stride, gram, moment))

/* Right-looking: each finished row is taken off the rows below it, in whole vectors from the one that holds the diagonal. */
GNP_INLINE void factor_body(double *gram, size_t size, size_t stride, double smallest_pivot, bool *regular)
{
	double floor[64];
	*regular = false;
	for (size_t i = 0; i < size; i++)
		floor[i] = smallest_pivot * gram[i * stride + i];
	for (size_t k = 0; k < size; k++) {
		double *pivot_row = gram + k * stride, pivot = pivot_row[k];
		if (!(pivot > floor[k]) || !(pivot > 0) || !isfinite(pivot))
			return;
		double inverse = 1 / sqrt(pivot);
		for (size_t c = k & ~(size_t)7; c < stride; c += 8)
			*(gnp_v8u *)(pivot_row + c) *= inverse;
		for (size_t i = k + 1; i < size; i++) {
			double factor = pivot_row[i], *row = gram + i * stride;
			for (size_t c = i & ~(size_t)7; c < stride; c += 8)
				*(gnp_v8u *)(row + c) -= factor * *(const gnp_v8u *)(pivot_row + c);
		}
		pivot_row[k] = inverse; /* the inverse is what all uses need */
	}
	*regular = true;
}

GNP_SIMD_DISPATCH(static, factor, factor_body,
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
