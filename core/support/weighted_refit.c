#include "core/support/weighted_refit.h"

#include <math.h>
#include <string.h>

#include "core/base/select.h"
#include "core/fit/least_squares.h"

enum { ROUNDS = 4, NEAREST = 6 };

static const double PLAINLY = 8, LITTLE = 0.02; /* deviations; spacings */
static const double CUT = 4.685, LEAST = 1e-6;  /* deviations; what is left of a share */

double gnp_weighted_deviation(const struct gnp_support *support, const double *residual)
{
	double size[GNP_SUPPORT_SINGLES];
	size_t count = gnp_support_singles(support);
	for (size_t i = 0; i < count; i++)
		size[i] = fabs(residual[i]);
	return gnp_median_deviation(size, count);
}

static double farthest(const struct gnp_support *support, const double *residual)
{
	double worst = 0;
	for (size_t i = 0; i < gnp_support_singles(support); i++)
		worst = fmax(worst, fabs(residual[i]));
	return worst;
}

/* Logits of shares (nodes) times the biweight of residuals. */
static void weigh_down(const struct gnp_support *support, const double *share, const double *residual, double deviation,
                       float *logits)
{
	for (size_t n = 0; n < support->nodes; n++) {
		double t = fabs(residual[n]) * sqrt(support->weight[n]) / (CUT * deviation + 1e-300);
		double inner = t < 1 ? 1 - t * t : 0;
		double left = fmax(fmin(share[n], 1 - 1e-12) * inner * inner, LEAST * share[n]);
		logits[n] = (float)log(left / (1 - left));
	}
}

int gnp_weighted_refit(const struct gnp_support *support, const float *outputs, struct gnp_weighted_fit *fit)
{
	size_t near = support->nodes - 1 < NEAREST ? support->nodes - 1 : NEAREST;
	double residual[GNP_SUPPORT_NODES], share[GNP_SUPPORT_NODES];
	double spacing = support->distance[near] / 1.5; /* six neighbours about a point of an even cloud, twelve beyond */
	float logits[GNP_SUPPORT_NODES];
	memcpy(share, fit->share, support->nodes * sizeof *share);
	for (int round = 0; round < ROUNDS; round++) {
		gnp_residuals(support->rows, support->y, support->nodes, GNP_TAYLOR_STRIDE, fit->coefficients, residual);
		double deviation = gnp_weighted_deviation(support, residual), worst = farthest(support, residual);
		if (!fit->solved || worst < PLAINLY * deviation || worst < LITTLE * spacing)
			return round;
		weigh_down(support, share, residual, deviation, logits);
		gnp_weighted_solve(support, outputs, logits, fit);
	}
	return ROUNDS;
}
