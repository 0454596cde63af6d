#include "core/support/weighted_projection.h"

#include <math.h>
#include <string.h>

#include "core/fit/least_squares.h"

enum { SIZE = GNP_TAYLOR_SIZE, STRIDE = GNP_TAYLOR_STRIDE, ORDERS = GNP_TAYLOR_DEGREE + 1 };

static const double RIDGE_SLOPE = 4, RIDGE_LOG_MAX = 60, LOGIT_MAX = 60, REACH_SLOPE = 2, REACH_MAX = 4;
static const double LEAST_WEIGHT = 1e-9; /* of a node, so that there is always something to fit */
static const double SMALLEST = 1e-15;    /* pivot; and the share by which a diagonal is lifted at first */

static double limited(double x, double most)
{
	return fmax(-most, fmin(most, x));
}

static void weigh(const struct gnp_support *support, const float *outputs, const float *logits,
                  struct gnp_weighted_fit *fit)
{
	double reach = exp(REACH_SLOPE * limited((double)outputs[GNP_WEIGHTED_REACH], REACH_MAX));
	fit->total = 0;
	for (size_t i = 0; i < support->nodes; i++) {
		double x = support->distance[i] / reach;
		fit->share[i] = 1 / (1 + exp(-limited((double)logits[i], LOGIT_MAX)));
		fit->window[i] = 1 / (1 + x * x * x * x);
		fit->weight[i] = support->weight[i] * fit->share[i] * fit->window[i] + LEAST_WEIGHT;
		fit->total += fit->weight[i];
	}
	for (int j = 0; j < ORDERS; j++)
		fit->ridge[j] = exp(limited(RIDGE_SLOPE * (double)outputs[GNP_WEIGHTED_RIDGE + j], RIDGE_LOG_MAX));
}

/* Of points: the residual of a node of m has 1 / m of their variance. */
static double mean_misfit(const struct gnp_support *support, const struct gnp_weighted_fit *fit)
{
	double sum = 0, count = 1e-300, left[GNP_SUPPORT_NODES];
	gnp_residuals(support->rows, support->y, support->nodes, STRIDE, fit->coefficients, left);
	for (size_t i = 0; i < support->nodes; i++) {
		sum += fit->weight[i] * left[i] * left[i];
		count += fit->weight[i] / support->weight[i];
	}
	return sum / count;
}

void gnp_weighted_solve(const struct gnp_support *support, const float *outputs, const float *logits,
                        struct gnp_weighted_fit *fit)
{
	_Alignas(64) double gram[STRIDE * STRIDE];
	double moment[STRIDE], factorial[SIZE];
	unsigned order[SIZE];
	gnp_taylor_indices(factorial, order);
	weigh(support, outputs, logits, fit);
	gnp_normal_equations(support->rows, fit->weight, support->y, support->nodes, STRIDE, gram, moment);
	fit->solved = false;
	for (double lift = SMALLEST; !fit->solved && lift < 1e-3; lift *= 100) {
		memcpy(fit->factor, gram, sizeof fit->factor);
		for (size_t i = 0; i < SIZE; i++) {
			double *diagonal = &fit->factor[i * STRIDE + i];
			*diagonal = (*diagonal + fit->ridge[order[i]] * factorial[i]) * (1 + lift);
		}
		fit->solved = gnp_cholesky_factor(fit->factor, SIZE, STRIDE, SMALLEST);
	}
	memset(fit->coefficients, 0, sizeof fit->coefficients);
	if (fit->solved) {
		gnp_cholesky_forward(fit->factor, SIZE, STRIDE, moment, fit->coefficients);
		gnp_cholesky_backward(fit->factor, SIZE, STRIDE, fit->coefficients, fit->coefficients);
	}
	fit->misfit = mean_misfit(support, fit);
}

/* The function of coefficients c (STRIDE, 0 past the last) at the nodes, with the sign turned. */
static void evaluate(const struct gnp_support *support, const double *c, double *value)
{
	static const double none[GNP_SUPPORT_NODES];
	gnp_residuals(support->rows, none, support->nodes, STRIDE, c, value);
}

void gnp_weighted_solve_backward(const struct gnp_support *support, const float *outputs,
                                 const struct gnp_weighted_fit *fit, const double *dcoefficients, const double *dshare,
                                 float *doutputs, float *dlogits)
{
	double adjoint[STRIDE] = {0}, dridge[ORDERS] = {0}, dreach = 0, factorial[SIZE];
	double left[GNP_SUPPORT_NODES], along[GNP_SUPPORT_NODES];
	unsigned order[SIZE];
	gnp_taylor_indices(factorial, order);
	if (fit->solved) {
		memcpy(adjoint, dcoefficients, SIZE * sizeof *adjoint);
		gnp_cholesky_forward(fit->factor, SIZE, STRIDE, adjoint, adjoint);
		gnp_cholesky_backward(fit->factor, SIZE, STRIDE, adjoint, adjoint);
	}
	for (size_t i = 0; i < SIZE; i++)
		dridge[order[i]] -= adjoint[i] * fit->coefficients[i] * factorial[i];
	for (int j = 0; j < ORDERS; j++) {
		bool flat = fabs(RIDGE_SLOPE * (double)outputs[GNP_WEIGHTED_RIDGE + j]) > RIDGE_LOG_MAX;
		doutputs[GNP_WEIGHTED_RIDGE + j] = flat ? 0 : (float)(RIDGE_SLOPE * fit->ridge[j] * dridge[j]);
	}
	gnp_residuals(support->rows, support->y, support->nodes, STRIDE, fit->coefficients, left);
	evaluate(support, adjoint, along);
	for (size_t i = 0; i < support->nodes; i++) {
		double s = fit->share[i], window = fit->window[i], dweight = -along[i] * left[i] * support->weight[i];
		dlogits[i] = (float)((dweight * window + dshare[i]) * s * (1 - s));
		dreach += dweight * s * 4 * window * (1 - window);
	}
	doutputs[GNP_WEIGHTED_REACH] =
		fabs((double)outputs[GNP_WEIGHTED_REACH]) > REACH_MAX ? 0 : (float)(REACH_SLOPE * dreach);
}

/* By how much the penalties pull a coefficient towards 0, going by the fit's own: column is that of the inverse. */
static double pull_on(const struct gnp_weighted_fit *fit, const double *column)
{
	double factorial[SIZE], sum = 0;
	unsigned order[SIZE];
	gnp_taylor_indices(factorial, order);
	for (size_t i = 0; i < SIZE; i++)
		sum += column[i] * fit->ridge[order[i]] * factorial[i] * fit->coefficients[i];
	return sum;
}

struct gnp_weighted_variance gnp_weighted_error(const struct gnp_support *support, const struct gnp_weighted_fit *fit)
{
	enum { FIRST = 1, LAST = 5 }; /* coefficients of u, v, u^2, u v, v^2 */
	double column[LAST + 1][STRIDE], noise[LAST + 1] = {0}, bias[LAST + 1], along[GNP_SUPPORT_NODES];
	if (!fit->solved)
		return (struct gnp_weighted_variance){1, 1};
	memset(column, 0, sizeof column);
	for (int j = FIRST; j <= LAST; j++) {
		column[j][j] = 1;
		gnp_cholesky_forward(fit->factor, SIZE, STRIDE, column[j], column[j]);
		gnp_cholesky_backward(fit->factor, SIZE, STRIDE, column[j], column[j]);
	}
	for (int j = FIRST; j <= LAST; j++) {
		evaluate(support, column[j], along);
		for (size_t i = 0; i < support->nodes; i++)
			noise[j] += along[i] * along[i] * fit->weight[i] * fit->weight[i] / support->weight[i];
		bias[j] = pull_on(fit, column[j]);
		bias[j] *= bias[j];
	}
	return (struct gnp_weighted_variance){
		fit->misfit * (noise[1] + noise[2]) / 2 + bias[1] + bias[2],
		fit->misfit * (4 * noise[3] + 2 * noise[4] + 4 * noise[5]) / 3 + 4 * bias[3] + 2 * bias[4] + 4 * bias[5]};
}

static double with_bias(double variance, float scale, float bias)
{
	return variance * exp(4 * limited((double)scale, 2)) + exp(4 * fmax(-8, fmin(2, (double)bias)));
}

struct gnp_weighted_variance gnp_weighted_variance(const float *outputs, struct gnp_weighted_variance error)
{
	return (struct gnp_weighted_variance){
		with_bias(error.slope, outputs[GNP_WEIGHTED_SLOPE_SCALE], outputs[GNP_WEIGHTED_SLOPE_BIAS]),
		with_bias(error.second, outputs[GNP_WEIGHTED_SECOND_SCALE], outputs[GNP_WEIGHTED_SECOND_BIAS])};
}
