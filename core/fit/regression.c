#include "core/fit/regression.h"

#include <math.h>
#include <string.h>

#include "core/fit/least_squares.h"

enum { FREE = 6, FREE_ORDERS = 3 }; /* height, slopes and Hessian: not penalised */

void gnp_regression_fill(struct gnp_regression *regression, const double *u, const double *v, const double *y,
                         const double *ones, size_t count)
{
	regression->count = count;
	gnp_taylor_rows(GNP_TAYLOR_DEGREE, u, v, count, GNP_TAYLOR_STRIDE, regression->rows);
	gnp_normal_equations(regression->rows, ones, y, count, GNP_TAYLOR_STRIDE, regression->gram, regression->moment);
	regression->square = 0;
	for (size_t i = 0; i < count; i++)
		regression->square += y[i] * y[i];
}

void gnp_regression_clear(struct gnp_regression *regression)
{
	regression->count = 0;
	regression->square = 0;
	memset(regression->gram, 0, GNP_TAYLOR_STRIDE * GNP_TAYLOR_STRIDE * sizeof(double));
	memset(regression->moment, 0, GNP_TAYLOR_STRIDE * sizeof(double));
}

void gnp_regression_add(struct gnp_regression *regression, const double *u, const double *v, const double *y,
                        const double *ones, size_t count)
{
	_Alignas(64) double gram[GNP_TAYLOR_STRIDE * GNP_TAYLOR_STRIDE], moment[GNP_TAYLOR_STRIDE];
	gnp_taylor_rows(GNP_TAYLOR_DEGREE, u, v, count, GNP_TAYLOR_STRIDE, regression->rows);
	gnp_normal_equations(regression->rows, ones, y, count, GNP_TAYLOR_STRIDE, gram, moment);
	for (size_t i = 0; i < GNP_TAYLOR_SIZE; i++) {
		regression->moment[i] += moment[i];
		for (size_t j = i; j < GNP_TAYLOR_STRIDE; j++)
			regression->gram[i * GNP_TAYLOR_STRIDE + j] += gram[i * GNP_TAYLOR_STRIDE + j];
	}
	for (size_t i = 0; i < count; i++)
		regression->square += y[i] * y[i];
	regression->count += count;
}

void gnp_regression_rescale(const struct gnp_regression *regression, double share, struct gnp_regression *inner)
{
	double factor[GNP_TAYLOR_SIZE], power[GNP_TAYLOR_STRIDE] = {0};
	unsigned order[GNP_TAYLOR_SIZE];
	gnp_taylor_indices(factor, order);
	for (size_t i = 0; i < GNP_TAYLOR_SIZE; i++) {
		power[i] = 1;
		for (unsigned j = 0; j < order[i]; j++)
			power[i] /= share;
	}
	for (size_t i = 0; i < GNP_TAYLOR_SIZE; i++) {
		inner->moment[i] = regression->moment[i] * power[i] / share;
		for (size_t j = i; j < GNP_TAYLOR_STRIDE; j++)
			inner->gram[i * GNP_TAYLOR_STRIDE + j] = regression->gram[i * GNP_TAYLOR_STRIDE + j] * power[i] * power[j];
	}
	inner->count = regression->count;
	inner->square = regression->square / (share * share);
}

/* Ridge of each coefficient: noise variance over prior variance. Returns the sum of their logarithms over the penalised. */
static double ridges(struct gnp_prior prior, double *ridge)
{
	double factor[GNP_TAYLOR_SIZE], log_sum = 0, shrink = 1 / (prior.rho * prior.rho);
	unsigned order[GNP_TAYLOR_SIZE];
	gnp_taylor_indices(factor, order);
	double of_order[GNP_TAYLOR_DEGREE + 1];
	of_order[0] = 1 / (prior.tau * prior.tau);
	for (unsigned j = 1; j <= GNP_TAYLOR_DEGREE; j++)
		of_order[j] = of_order[j - 1] * shrink;
	for (size_t i = 0; i < GNP_TAYLOR_SIZE; i++)
		ridge[i] = order[i] < FREE_ORDERS ? 0 : factor[i] * of_order[order[i]];
	/* the logarithms in closed form: the factorials' sum is a constant, the rest is linear in the orders */
	static const double log_factorials = 122.36577516752709;
	static const double orders = 160, penalised = 30;
	log_sum = log_factorials + penalised * log(of_order[0]) + orders * log(shrink);
	return log_sum;
}

bool gnp_regression_condition(const struct gnp_regression *regression, struct gnp_prior prior, struct gnp_posterior *posterior)
{
	static const double pivot = 1e-14;
	double ridge[GNP_TAYLOR_SIZE], z[GNP_TAYLOR_STRIDE];
	double log_ridges = ridges(prior, ridge);
	memcpy(posterior->factor, regression->gram, GNP_TAYLOR_SIZE * GNP_TAYLOR_STRIDE * sizeof(double));
	for (size_t i = 0; i < GNP_TAYLOR_SIZE; i++)
		posterior->factor[i * GNP_TAYLOR_STRIDE + i] += ridge[i];
	if (regression->count <= FREE || !gnp_cholesky_factor(posterior->factor, GNP_TAYLOR_SIZE, GNP_TAYLOR_STRIDE, pivot))
		return false;
	gnp_cholesky_forward(posterior->factor, GNP_TAYLOR_SIZE, GNP_TAYLOR_STRIDE, regression->moment, z);
	double explained = 0, freedom = (double)(regression->count - FREE);
	for (size_t i = 0; i < GNP_TAYLOR_SIZE; i++)
		explained += z[i] * z[i];
	double misfit = fmax(regression->square - explained, 1e-15 * regression->square);
	posterior->variance = misfit / freedom;
	if (!(posterior->variance > 0))
		posterior->variance = 1e-300;
	posterior->evidence = 0.5 * (log_ridges - freedom * log(posterior->variance) -
	                             gnp_cholesky_log_determinant(posterior->factor, GNP_TAYLOR_SIZE, GNP_TAYLOR_STRIDE));
	memcpy(posterior->mean, z, GNP_TAYLOR_SIZE * sizeof *z);
	return true;
}

void gnp_regression_mean(struct gnp_posterior *posterior)
{
	gnp_cholesky_backward(posterior->factor, GNP_TAYLOR_SIZE, GNP_TAYLOR_STRIDE, posterior->mean, posterior->mean);
}

void gnp_regression_round(struct gnp_prior prior, struct gnp_posterior *posterior)
{
	enum { SECOND = 3, FOURTH = 10, FOURTHS = 5 }; /* where coefficients of these orders begin */
	double ridge[GNP_TAYLOR_SIZE], step[GNP_TAYLOR_STRIDE] = {0};
	const double *c = posterior->mean + SECOND;
	const double squared[FOURTHS] = {c[0] * c[0], 2 * c[0] * c[1], c[1] * c[1] + 2 * c[0] * c[2], 2 * c[1] * c[2],
	                                 c[2] * c[2]};
	double bend = 4 * c[0] * c[0] + 2 * c[1] * c[1] + 4 * c[2] * c[2], mean = (c[0] + c[2]) / 2 / (1 + bend * bend);
	ridges(prior, ridge);
	for (size_t i = 0; i < FOURTHS; i++)
		step[FOURTH + i] = ridge[FOURTH + i] * mean * squared[i];
	gnp_cholesky_forward(posterior->factor, GNP_TAYLOR_SIZE, GNP_TAYLOR_STRIDE, step, step);
	gnp_cholesky_backward(posterior->factor, GNP_TAYLOR_SIZE, GNP_TAYLOR_STRIDE, step, step);
	for (size_t i = 0; i < GNP_TAYLOR_SIZE; i++)
		posterior->mean[i] += step[i];
}

void gnp_regression_covariance(const double *factor, const double *rows, double covariance[36])
{
	double z[6][GNP_TAYLOR_STRIDE];
	for (size_t k = 0; k < 6; k++)
		gnp_cholesky_forward(factor, GNP_TAYLOR_SIZE, GNP_TAYLOR_STRIDE, rows + k * GNP_TAYLOR_STRIDE, z[k]);
	for (size_t k = 0; k < 6; k++)
		for (size_t l = 0; l <= k; l++) {
			double sum = 0;
			for (size_t i = 0; i < GNP_TAYLOR_SIZE; i++)
				sum += z[k][i] * z[l][i];
			covariance[6 * k + l] = covariance[6 * l + k] = sum;
		}
}

double gnp_regression_variance(const double *factor, size_t coefficient)
{
	double z[GNP_TAYLOR_STRIDE] = {0}, sum = 0;
	z[coefficient] = 1;
	gnp_cholesky_forward(factor, GNP_TAYLOR_SIZE, GNP_TAYLOR_STRIDE, z, z);
	for (size_t i = coefficient; i < GNP_TAYLOR_SIZE; i++)
		sum += z[i] * z[i];
	return sum;
}
