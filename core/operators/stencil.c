#include "core/operators/stencil.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "core/base/simd.h"
#include "core/fit/least_squares.h"
#include "core/fit/taylor.h"

struct work {
	size_t count;
	double *u, *v, *weight; /* (count) scaled coordinates, weights */
	double *phi;            /* (count, stride) */
	double *gram;           /* (stride, stride) */
	double *zero, *moment;  /* (count), (stride) */
	double radius;
};

static bool take(struct work *work, size_t count, size_t stride, struct gnp_scratch *scratch)
{
	work->count = count;
	work->u = gnp_scratch_take(scratch, count, sizeof(double));
	work->v = gnp_scratch_take(scratch, count, sizeof(double));
	work->weight = gnp_scratch_take(scratch, count, sizeof(double));
	work->phi = gnp_scratch_take(scratch, count * stride, sizeof(double));
	work->gram = gnp_scratch_take(scratch, stride * stride, sizeof(double));
	work->zero = gnp_scratch_take(scratch, count, sizeof(double));
	work->moment = gnp_scratch_take(scratch, stride, sizeof(double));
	return work->u && work->v && work->weight && work->phi && work->gram && work->zero && work->moment;
}

static void scale(const double *u, const double *v, struct work *work)
{
	double square = 0;
	for (size_t j = 0; j < work->count; j++)
		square = fmax(square, u[j] * u[j] + v[j] * v[j]);
	work->radius = sqrt(square);
	double inverse = square > 0 ? 1 / work->radius : 0;
	for (size_t j = 0; j < work->count; j++) {
		work->u[j] = u[j] * inverse;
		work->v[j] = v[j] * inverse;
		double r = work->u[j] * work->u[j] + work->v[j] * work->v[j], t = fmax(0, 1 - r);
		work->weight[j] = t * t * t * t / (r + 1e-3);
		work->zero[j] = 0;
	}
}

static bool factor(unsigned degree, struct work *work)
{
	size_t size = gnp_taylor_size(degree), stride = GNP_SIMD_PAD(size);
	if (work->count < size || !(work->radius > 0))
		return false;
	gnp_taylor_rows(degree, work->u, work->v, work->count, stride, work->phi);
	gnp_normal_equations(work->phi, work->weight, work->zero, work->count, stride, work->gram, work->moment);
	return gnp_cholesky_factor(work->gram, size, stride, GNP_SMALLEST_PIVOT);
}

/* The functional of one part: weight_j phi_j . G^-1 e, e the part's derivative of each basis function at the centre. */
static void write_part(enum gnp_stencil_part part, unsigned degree, const struct work *work, double *weights)
{
	static const double factorial[GNP_STENCIL_PARTS] = {1, 1, 1, 2, 1, 2};
	static const int order[GNP_STENCIL_PARTS] = {0, 1, 1, 2, 2, 2};
	size_t size = gnp_taylor_size(degree), stride = GNP_SIMD_PAD(size);
	double *dual = work->moment;
	if ((size_t)part >= size) { /* beyond the polynomial's degree */
		memset(weights, 0, work->count * sizeof *weights);
		return;
	}
	memset(dual, 0, stride * sizeof *dual);
	dual[part] = factorial[part] / pow(work->radius, order[part]);
	gnp_cholesky_forward(work->gram, size, stride, dual, dual);
	gnp_cholesky_backward(work->gram, size, stride, dual, dual);
	for (size_t j = 0; j < work->count; j++) {
		double sum = 0;
		for (size_t i = 0; i < size; i++)
			sum += work->phi[j * stride + i] * dual[i];
		weights[j] = work->weight[j] * sum;
	}
}

/* A factor near singular leaves few digits. What is lost shows in functions that must come out exactly: of the constant
 * 1 the value is 1 and every derivative 0. */
static bool keeps_constants(const struct work *work, double *const weights[GNP_STENCIL_PARTS])
{
	static const double close = 1e-8;
	for (int part = 0; part < GNP_STENCIL_PARTS; part++) {
		double sum = part == GNP_STENCIL_VALUE ? -1 : 0, size = 0;
		for (size_t j = 0; weights[part] && j < work->count; j++) {
			sum += weights[part][j];
			size += fabs(weights[part][j]);
		}
		if (weights[part] && !(fabs(sum) <= close * size))
			return false;
	}
	return true;
}

static bool fit(unsigned degree, struct work *work, double *const weights[GNP_STENCIL_PARTS])
{
	if (!factor(degree, work))
		return false;
	for (int part = 0; part < GNP_STENCIL_PARTS; part++)
		if (weights[part])
			write_part((enum gnp_stencil_part)part, degree, work, weights[part]);
	return keeps_constants(work, weights);
}

gnp_status gnp_stencil_fit(unsigned degree, unsigned lowest, const double *u, const double *v, size_t count,
                           struct gnp_scratch *scratch, double *const weights[GNP_STENCIL_PARTS], unsigned *used,
                           struct gnp_error *error)
{
	struct work work;
	if (!take(&work, count, GNP_SIMD_PAD(gnp_taylor_size(degree)), scratch))
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "stencil: no memory for %zu neighbours", count);
	scale(u, v, &work);
	while (!fit(degree, &work, weights)) {
		if (degree == lowest)
			return gnp_error_set(error, GNP_DEGENERATE,
			                     "stencil: %zu neighbours do not determine a polynomial of degree %u", count,
			                     lowest);
		degree--;
	}
	*used = degree;
	return GNP_OK;
}
