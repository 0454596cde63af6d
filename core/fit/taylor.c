#include "core/fit/taylor.h"

#include <string.h>

#include "core/base/simd.h"

size_t gnp_taylor_size(unsigned degree)
{
	return (size_t)(degree + 1) * (degree + 2) / 2;
}

GNP_INLINE void rows_body(unsigned degree, const double *u, const double *v, size_t count, size_t stride, double *rows)
{
	for (size_t i = 0; i < count; i++, rows += stride) {
		/* each degree from the one before: u times all of it, then v times its last */
		double *row = rows;
		row[0] = 1;
		size_t n = 1;
		for (unsigned d = 1; d <= degree; d++) {
			const double *last = row + n - d;
			for (unsigned b = 0; b < d; b++)
				row[n + b] = u[i] * last[b];
			row[n + d] = v[i] * last[d - 1];
			n += d + 1;
		}
		for (; n < stride; n++)
			row[n] = 0;
	}
}

GNP_INLINE void rows_choose(unsigned degree, const double *u, const double *v, size_t count, size_t stride, double *rows)
{
	if (degree == GNP_TAYLOR_DEGREE && stride == GNP_TAYLOR_STRIDE)
		rows_body(GNP_TAYLOR_DEGREE, u, v, count, GNP_TAYLOR_STRIDE, rows);
	else
		rows_body(degree, u, v, count, stride, rows);
}

GNP_SIMD_DISPATCH(, gnp_taylor_rows, rows_choose,
                  (unsigned degree, const double *u, const double *v, size_t count, size_t stride, double *rows),
                  (degree, u, v, count, stride, rows))

/* A lane is a set. The constant is 1 at absent points too: it is not summed. */
GNP_INLINE void means_body(const double *u, const double *v, size_t many, const double *share, size_t sets,
                           double *rows)
{
	gnp_v8 sum[GNP_TAYLOR_SIZE] = {{0}}, row[GNP_TAYLOR_SIZE];
	row[0] = (gnp_v8){1, 1, 1, 1, 1, 1, 1, 1};
	for (size_t i = 0; i < many; i++) {
		gnp_v8 x = *(const gnp_v8u *)(u + GNP_SIMD_WIDTH * i), y = *(const gnp_v8u *)(v + GNP_SIMD_WIDTH * i);
		size_t n = 1;
#pragma GCC unroll 8
		for (size_t d = 1; d <= GNP_TAYLOR_DEGREE; d++) {
#pragma GCC unroll 8
			for (size_t b = 0; b < d; b++)
				row[n + b] = x * row[n - d + b];
			row[n + d] = y * row[n - 1];
			n += d + 1;
		}
		for (n = 1; n < GNP_TAYLOR_SIZE; n++)
			sum[n] += row[n];
	}
	for (size_t s = 0; s < sets; s++, rows += GNP_TAYLOR_STRIDE) {
		rows[0] = 1;
		for (size_t n = 1; n < GNP_TAYLOR_SIZE; n++)
			rows[n] = sum[n][s] * share[s];
		for (size_t n = GNP_TAYLOR_SIZE; n < GNP_TAYLOR_STRIDE; n++)
			rows[n] = 0;
	}
}

GNP_SIMD_DISPATCH(, gnp_taylor_means, means_body,
                  (const double *u, const double *v, size_t many, const double *share, size_t sets, double *rows),
                  (u, v, many, share, sets, rows))

void gnp_taylor_indices(double *factor, unsigned *order)
{
	static const double factorial[] = {1, 1, 2, 6, 24, 120, 720, 5040};
	size_t n = 0;
	for (unsigned d = 0; d <= GNP_TAYLOR_DEGREE; d++)
		for (unsigned b = 0; b <= d; b++, n++) {
			factor[n] = factorial[d - b] * factorial[b];
			order[n] = d;
		}
}

void gnp_taylor_jets(unsigned degree, double u, double v, size_t stride, double *rows)
{
	double pu[GNP_TAYLOR_DEGREE + 3] = {0}, pv[GNP_TAYLOR_DEGREE + 3] = {0}; /* pu[i + 2] = u^i; negative powers read as 0 */
	pu[2] = pv[2] = 1;
	for (unsigned i = 0; i < degree; i++) {
		pu[i + 3] = pu[i + 2] * u;
		pv[i + 3] = pv[i + 2] * v;
	}
	memset(rows, 0, 6 * stride * sizeof *rows);
	size_t n = 0;
	for (unsigned d = 0; d <= degree; d++)
		for (unsigned b = 0; b <= d; b++, n++) {
			double a = d - b, bb = b;
			const double *x = pu + (d - b), *y = pv + b; /* x[2] = u^a, x[1] = u^(a-1), x[0] = u^(a-2) */
			rows[n] = x[2] * y[2];
			rows[stride + n] = a * x[1] * y[2];
			rows[2 * stride + n] = bb * x[2] * y[1];
			rows[3 * stride + n] = a * (a - 1) * x[0] * y[2];
			rows[4 * stride + n] = a * bb * x[1] * y[1];
			rows[5 * stride + n] = bb * (bb - 1) * x[2] * y[0];
		}
}

struct gnp_jet gnp_taylor_jet(unsigned degree, const double *coefficients, double u, double v)
{
	double rows[6 * GNP_TAYLOR_STRIDE], jet[6] = {0};
	gnp_taylor_jets(degree, u, v, GNP_TAYLOR_STRIDE, rows);
	for (size_t k = 0; k < 6; k++)
		for (size_t i = 0; i < gnp_taylor_size(degree); i++)
			jet[k] += coefficients[i] * rows[k * GNP_TAYLOR_STRIDE + i];
	return (struct gnp_jet){jet[0], jet[1], jet[2], jet[3], jet[4], jet[5]};
}
