#include "weights/train/any/any_loss.h"

#include <math.h>
#include <string.h>

#include "core/base/vector.h"

enum { SIZE = GNP_TAYLOR_SIZE, SCALES = 3 };

static const double CHORD[SCALES] = {1e-4, 4e-3, 6e-2}, CHORD_FACTOR[SCALES] = {0.08, 0.3, 0.4}, CHORD_SQUARED = 5;
static const double FINE = 0.1, FINE_FLOOR = 1e-8, COARSE = 0.15, COARSE_FLOOR = 0.02; /* of the Hessian */
static const double LEAST_SIZE = 0.1;                                                  /* of a Hessian, in units of R */
static const double CREASE = 0.2, OUTLIER = 0.3, NODES = 0.5, NEAR = 0.5, ERRORS = 0.05;
static const double STEEPEST = 1; /* derivative of a loss of errors: a likelihood has steep walls */
static const double WORST = 100;    /* such a loss as it is reported, so that one does not hide the others */

/* ---- The surface ---- */

/* Of the slopes of a height against a true normal; dslope out. */
static double judge_normal(const double truth[3], const double slope[2], double dslope[2], double *angle)
{
	double length = 1 / sqrt(1 + slope[0] * slope[0] + slope[1] * slope[1]);
	double normal[3] = {-slope[0] * length, -slope[1] * length, length};
	double off[3], square = 0, loss, by_square = CHORD_SQUARED;
	for (int a = 0; a < 3; a++) {
		off[a] = normal[a] - truth[a];
		square += off[a] * off[a];
	}
	loss = CHORD_SQUARED * square;
	for (int k = 0; k < SCALES; k++) {
		loss += CHORD_FACTOR[k] / 2 * log(1 + square / (CHORD[k] * CHORD[k]));
		by_square += CHORD_FACTOR[k] / 2 / (CHORD[k] * CHORD[k] + square);
	}
	for (int k = 0; k < 2; k++) { /* d normal / d slope = -length (e_k + normal slope length) */
		double along = -off[k] * length - gnp_dot(off, normal) * slope[k] * length * length;
		dslope[k] = 2 * by_square * along;
	}
	*angle = 2 * asin(fmin(1, sqrt(square) / 2));
	return loss;
}

/* Frobenius, of entries uu, uv, vv */
static double square_of(const double h[3])
{
	return h[0] * h[0] + 2 * h[1] * h[1] + h[2] * h[2];
}

static double judge_hessian(const struct gnp_any_truth *truth, const double *c, double *dc, struct gnp_any_error *made)
{
	double off[3] = {2 * c[3] - truth->hessian[0], c[4] - truth->hessian[1], 2 * c[5] - truth->hessian[2]};
	double size = sqrt(square_of(truth->hessian)) + LEAST_SIZE, inverse = 1 / (size * size);
	made->hessian = square_of(off);
	double relative = made->hessian * inverse;
	double slope = FINE / 2 / (relative + FINE_FLOOR) + COARSE / 2 / (relative + COARSE_FLOOR);
	for (int k = 0; k < 3; k++)
		dc[3 + k] = slope * 4 * off[k] * inverse;
	made->relative = sqrt(relative);
	return FINE / 2 * log(relative + FINE_FLOOR) + COARSE / 2 * log(relative + COARSE_FLOOR);
}

double gnp_any_loss_surface(const struct gnp_any_truth *truth, const double *coefficients, double *dcoefficients,
                            struct gnp_any_error *made)
{
	memset(dcoefficients, 0, SIZE * sizeof *dcoefficients);
	*made = (struct gnp_any_error){0};
	double loss = judge_normal(truth->normal, coefficients + 1, dcoefficients + 1, &made->angle);
	return truth->curved ? loss + judge_hessian(truth, coefficients, dcoefficients, made) : loss;
}

double gnp_any_loss_near(const struct gnp_support *support, size_t node, const double normal[3],
                         const double *coefficients,
                         double *dcoefficients)
{
	double rows[6 * GNP_TAYLOR_STRIDE], slope[2] = {0}, dslope[2], angle;
	gnp_taylor_jets(GNP_TAYLOR_DEGREE, support->u[node], support->v[node], GNP_TAYLOR_STRIDE, rows);
	for (int k = 0; k < 2; k++)
		for (size_t i = 0; i < SIZE; i++)
			slope[k] += coefficients[i] * rows[(size_t)(1 + k) * GNP_TAYLOR_STRIDE + i];
	double loss = judge_normal(normal, slope, dslope, &angle);
	for (size_t i = 0; i < SIZE; i++)
		dcoefficients[i] = dslope[0] * rows[GNP_TAYLOR_STRIDE + i] + dslope[1] * rows[2 * GNP_TAYLOR_STRIDE + i];
	return loss;
}

/* ---- What the model says ---- */

double gnp_any_loss_logit(float logit, bool is, double *dlogit)
{
	double x = is ? -(double)logit : (double)logit; /* log(1 + e^x) without overflow */
	*dlogit = 1 / (1 + exp(-(double)logit)) - is;
	return fmax(x, 0) + log1p(exp(-fabs(x)));
}

double gnp_any_loss_errors(double squared, int dimensions, double noise, float scale, float bias, double *dscale,
                           double *dbias)
{
	static const double SMALLEST = 1e-18, SCALE_MAX = 2;
	float outputs[GNP_WEIGHTED_OUTPUTS] = {[GNP_WEIGHTED_SLOPE_SCALE] = scale, [GNP_WEIGHTED_SLOPE_BIAS] = bias};
	double by_bias = gnp_weighted_variance(outputs, (struct gnp_weighted_variance){0, 0}).slope;
	double by_scale = gnp_weighted_variance(outputs, (struct gnp_weighted_variance){noise, 0}).slope - by_bias;
	double variance = by_scale + by_bias + SMALLEST;
	double slope = dimensions / (2 * variance) - squared / (2 * variance * variance);
	*dscale = 4 * slope * by_scale;
	*dbias = 4 * slope * by_bias;
	if (fabs((double)scale) > SCALE_MAX && *dscale * (double)scale < 0)
		*dscale = 0;
	return squared / (2 * variance) + dimensions * log(variance) / 2;
}

static float step_of(double share, double derivative)
{
	return (float)(share * fmax(-STEEPEST, fmin(STEEPEST, ERRORS * derivative)));
}

static double judge_errors(const struct gnp_support *support, const struct gnp_weighted_fit *fit, const float *outputs,
                           const struct gnp_any_truth *truth, const struct gnp_any_error *made, double share,
                           float *doutputs)
{
	const struct gnp_weighted_variance error = gnp_weighted_error(support, fit);
	const struct {
		double squared, expected;
		int dimensions, scale, bias;
	} parts[2] = {{made->angle * made->angle, error.slope, 2, GNP_WEIGHTED_SLOPE_SCALE, GNP_WEIGHTED_SLOPE_BIAS},
	              {made->hessian, error.second, 3, GNP_WEIGHTED_SECOND_SCALE, GNP_WEIGHTED_SECOND_BIAS}};
	double sum = 0;
	for (int i = 0; i < (truth->curved ? 2 : 1); i++) {
		double dscale, dbias;
		double loss = gnp_any_loss_errors(parts[i].squared, parts[i].dimensions, parts[i].expected,
		                                  outputs[parts[i].scale], outputs[parts[i].bias], &dscale, &dbias);
		sum += fmin(loss, WORST);
		doutputs[parts[i].scale] = step_of(share, dscale);
		doutputs[parts[i].bias] = step_of(share, dbias);
	}
	return ERRORS * sum;
}

static double judge_logit(float logit, bool is, double factor, double share, float *doutput)
{
	double dlogit, loss = gnp_any_loss_logit(logit, is, &dlogit);
	*doutput = (float)(share * factor * dlogit);
	return share * factor * loss;
}

static double judge_nodes(const struct gnp_any_cloud *cloud, const struct gnp_support *support,
                          const struct gnp_weighted_fit *fit, double share, double *strange, double *dshares)
{
	double sum = 0;
	gnp_any_truth_label(cloud, support, strange);
	for (size_t n = 0; n < support->nodes; n++) {
		dshares[n] = share * NODES * strange[n] / (double)support->nodes;
		sum += dshares[n] * fit->share[n];
	}
	return sum;
}

/* The surface is to hold near its centre, too: at one of the nearest points, another for every centre. */
static double judge_near(const struct gnp_any_cloud *cloud, const struct gnp_support *support,
                         const struct gnp_weighted_fit *fit, double share, double *dcoefficients)
{
	enum { NEAREST = 20 };
	size_t node = 1 + (size_t)support->centre * 7919 % NEAREST;
	double normal[3], d[SIZE];
	if (node >= support->nodes || !gnp_any_truth_near(cloud, support, node, normal))
		return 0;
	double loss = gnp_any_loss_near(support, node, normal, fit->coefficients, d);
	for (size_t i = 0; i < SIZE; i++)
		dcoefficients[i] += share * NEAR * d[i];
	return share * NEAR * loss;
}

void gnp_any_loss_support(const struct gnp_any_cloud *cloud, const struct gnp_support *support,
                          const struct gnp_weighted_fit *fit, const float *outputs, double share, double *strange,
                          struct gnp_any_terms *terms, double *dcoefficients, double *dshares, float *doutputs)
{
	enum gnp_any_outlier outlier = cloud->outlier[support->centre];
	struct gnp_any_truth truth;
	struct gnp_any_error made;
	memset(dcoefficients, 0, SIZE * sizeof *dcoefficients);
	memset(dshares, 0, support->nodes * sizeof *dshares);
	memset(doutputs, 0, GNP_WEIGHTED_OUTPUTS * sizeof *doutputs);
	if (outlier != GNP_ANY_UNSURE)
		terms->outlier += judge_logit(outputs[GNP_WEIGHTED_OUTLIER], outlier == GNP_ANY_OUTLIER, OUTLIER, share,
		                              &doutputs[GNP_WEIGHTED_OUTLIER]);
	if (outlier != GNP_ANY_GOOD)
		return;
	gnp_any_truth_find(cloud, support, &truth);
	terms->surface += share * gnp_any_loss_surface(&truth, fit->coefficients, dcoefficients, &made);
	for (size_t i = 0; i < SIZE; i++)
		dcoefficients[i] *= share;
	terms->surface += judge_near(cloud, support, fit, share, dcoefficients);
	if (!cloud->faceted)
		terms->crease += judge_logit(outputs[GNP_WEIGHTED_CREASE], cloud->edge[support->centre] < 1, CREASE, share,
		                             &doutputs[GNP_WEIGHTED_CREASE]);
	terms->nodes += judge_nodes(cloud, support, fit, share, strange, dshares);
	terms->errors += share * judge_errors(support, fit, outputs, &truth, &made, share, doutputs);
	terms->angle += made.angle * made.angle;
	terms->judged++;
}

double gnp_any_loss_total(const struct gnp_any_terms *terms)
{
	return terms->surface + terms->crease + terms->outlier + terms->nodes;
}

double gnp_any_loss_frame(double cosine)
{
	static const double WIDE = 6e-2, FACTOR = 0.3, SQUARED = 3;
	double square = fmax(0, 2 - 2 * fabs(cosine));
	return FACTOR / 2 * log(1 + square / (WIDE * WIDE)) + SQUARED * square;
}
