#include "least_squares.h"

#include <math.h>

#include "simd.h"

/* One 8 x 8 tile: rows r.., columns c.. of the Gram matrix, held in registers over all points. */
GNP_INLINE void gram_tile(const double *phi, const double *weight, size_t count, size_t stride, size_t r, size_t c,
                          double *gram)
{
	gnp_v8 sum[8] = {{0}};
	for (size_t i = 0; i < count; i++) {
		const double *row = phi + i * stride;
		gnp_v8 right = *(const gnp_v8u *)(row + c) * weight[i];
		for (int k = 0; k < 8; k++)
			sum[k] += row[r + k] * right;
	}
	for (int k = 0; k < 8; k++)
		*(gnp_v8u *)(gram + (r + k) * stride + c) = sum[k];
}

GNP_INLINE void normal_equations_body(const double *phi, const double *weight, const double *y, size_t count,
                                      size_t stride, double *gram, double *moment)
{
	for (size_t r = 0; r < stride; r += 8)
		for (size_t c = 0; c <= r; c += 8)
			gram_tile(phi, weight, count, stride, r, c, gram);
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

static const double smallest_pivot = 1e-11;

GNP_INLINE void factor_body(double *gram, size_t size, size_t stride, double *scale, bool *regular)
{
	*regular = false;
	for (size_t i = 0; i < size; i++) {
		double diagonal = gram[i * stride + i];
		if (!(diagonal > 0) || !isfinite(diagonal))
			return;
		scale[i] = 1 / sqrt(diagonal);
	}
	for (size_t i = 0; i < size; i++) {
		double *row = gram + i * stride;
		for (size_t j = 0; j <= i; j++)
			row[j] *= scale[i] * scale[j];
		for (size_t j = 0; j < i; j++) {
			const double *other = gram + j * stride;
			double sum = 0;
			for (size_t k = 0; k < j; k++)
				sum += row[k] * other[k];
			row[j] = (row[j] - sum) * other[j];
		}
		double pivot = row[i];
		for (size_t k = 0; k < i; k++)
			pivot -= row[k] * row[k];
		if (!(pivot > smallest_pivot))
			return;
		row[i] = 1 / sqrt(pivot); /* the inverse is what both uses need */
	}
	*regular = true;
}

GNP_SIMD_DISPATCH(static, factor, factor_body,
                  (double *gram, size_t size, size_t stride, double *scale, bool *regular),
                  (gram, size, stride, scale, regular))

bool gnp_cholesky_factor(double *gram, size_t size, size_t stride, double *scale)
{
	bool regular;
	factor(gram, size, stride, scale, &regular);
	return regular;
}

void gnp_cholesky_solve(const double *factor, const double *scale, size_t size, size_t stride, const double *b, double *x)
{
	for (size_t i = 0; i < size; i++) {
		double sum = b[i] * scale[i];
		for (size_t j = 0; j < i; j++)
			sum -= factor[i * stride + j] * x[j];
		x[i] = sum * factor[i * stride + i];
	}
	for (size_t i = size; i-- > 0;) {
		x[i] *= factor[i * stride + i];
		for (size_t j = 0; j < i; j++)
			x[j] -= factor[i * stride + j] * x[i];
		x[i] *= scale[i];
	}
}
