#include "core/support/first_fits.h"

#include <math.h>
#include <string.h>

#include "core/fit/least_squares.h"

enum { SIZE = GNP_TAYLOR_SIZE, STRIDE = GNP_TAYLOR_STRIDE, ORDERS = GNP_TAYLOR_DEGREE + 1 };

static const double RIDGE = 1e-6, SMALLEST = 1e-15;

void gnp_first_sums_add(struct gnp_first_sums *sums, const double *rows, const double *weights, const double *y,
                        size_t count)
{
	_Alignas(64) double gram[STRIDE * STRIDE];
	double moment[STRIDE];
	gnp_normal_equations(rows, weights, y, count, STRIDE, gram, moment);
	for (size_t i = 0; i < SIZE; i++)
		for (size_t c = i & ~(size_t)7; c < STRIDE; c++) /* the upper triangle, in whole vectors */
			sums->gram[i * STRIDE + c] += gram[i * STRIDE + c];
	for (size_t i = 0; i < STRIDE; i++)
		sums->moment[i] += moment[i];
	for (size_t i = 0; i < count; i++) {
		sums->square += weights[i] * y[i] * y[i];
		sums->count += weights[i];
	}
}

void gnp_first_fit_solve(const struct gnp_first_sums *sums, double radius, struct gnp_first_fit *out)
{
	_Alignas(64) double matrix[SIZE * STRIDE];
	double factor[SIZE], explained = 0;
	unsigned order[SIZE];
	gnp_taylor_indices(factor, order);
	out->power[0] = 1;
	for (int j = 1; j < ORDERS; j++)
		out->power[j] = out->power[j - 1] * radius;
	memcpy(matrix, sums->gram, sizeof matrix);
	for (size_t i = 0; i < SIZE; i++) {
		double power = out->power[order[i]] * out->power[order[i]];
		matrix[i * STRIDE + i] += power * (order[i] < 3 ? 1e-12 : RIDGE * (sums->count + 1) * factor[i]);
	}
	memset(out->mean, 0, sizeof out->mean);
	out->misfit = sums->square / (sums->count + 1);
	if (!gnp_cholesky_factor(matrix, SIZE, STRIDE, SMALLEST))
		return;
	gnp_cholesky_forward(matrix, SIZE, STRIDE, sums->moment, out->mean);
	for (size_t i = 0; i < SIZE; i++)
		explained += out->mean[i] * out->mean[i];
	gnp_cholesky_backward(matrix, SIZE, STRIDE, out->mean, out->mean);
	out->misfit = fmax(sums->square - explained, SMALLEST * sums->square) / (sums->count + 1);
}

void gnp_first_fit_summarise(const struct gnp_first_fit *fit, float *summary)
{
	double factor[SIZE], energy[ORDERS] = {0};
	unsigned order[SIZE];
	gnp_taylor_indices(factor, order);
	for (size_t i = 0; i < SIZE; i++) {
		double c = fit->mean[i] * fit->power[order[i]];
		energy[order[i]] += c * c * factor[i];
	}
	summary[0] = (float)(0.5 * log(fit->misfit + 1e-20));
	for (int j = 1; j < ORDERS; j++)
		summary[j] = (float)(0.5 * log(energy[j] + 1e-16));
}
