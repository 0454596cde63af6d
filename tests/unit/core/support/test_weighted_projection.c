/* The weighted projection: what it reproduces exactly, its minimum, its derivatives by differences, its covariance by
 * draws. */
#include "core/fit/least_squares.h"
#include "core/support/weighted_projection.h"
#include "tests/unit/core/support/small_cloud.h"

enum {
	SIZE = GNP_TAYLOR_SIZE,
	STRIDE = GNP_TAYLOR_STRIDE,
	ORDERS = GNP_TAYLOR_DEGREE + 1,
	OUTPUTS = GNP_WEIGHTED_OUTPUTS
};

static struct gnp_support support;
static struct gnp_weighted_fit fit;

/* A support of 1296 points of a bent sheet with noise. */
static void make_support(void)
{
	static struct small_row row;
	struct gnp_ladder ladder;
	struct small_cloud cloud;
	small_cloud_make(1600, 0.01, false, &cloud);
	CHECK(small_cloud_support(&cloud, 700, 11, 0, &ladder, &row, &support));
	CHECK(support.nodes == GNP_SUPPORT_NODES);
	small_cloud_clear(&cloud);
}

/* Multiples of powers of two, so that floats hold steps of differences. */
static float draw(struct gnp_random *random, double mean, double deviation)
{
	return (float)(round(256 * (mean + deviation * gnp_random_normal(random))) / 256);
}

static void draw_inputs(struct gnp_random *random, float *outputs, float *logits)
{
	for (int o = 0; o < OUTPUTS; o++)
		outputs[o] = o < ORDERS ? draw(random, -1.5, 0.7) : draw(random, 0, 0.3);
	for (size_t i = 0; i < support.nodes; i++)
		logits[i] = draw(random, 0.5, 1.5);
}

/* ---- The solution ---- */

static void polynomials_are_reproduced(void)
{
	struct gnp_random random;
	double wanted[SIZE];
	float outputs[OUTPUTS] = {0}, logits[GNP_SUPPORT_NODES];
	make_support();
	gnp_random_seed(&random, 3, 0);
	for (size_t c = 0; c < SIZE; c++)
		wanted[c] = gnp_random_normal(&random);
	for (size_t i = 0; i < support.nodes; i++) {
		logits[i] = draw(&random, 1, 1);
		support.y[i] = 0;
		for (size_t c = 0; c < SIZE; c++)
			support.y[i] += wanted[c] * support.rows[i * STRIDE + c];
	}
	for (int j = 0; j < ORDERS; j++)
		outputs[j] = -9;
	outputs[GNP_WEIGHTED_REACH] = 0.5f;
	gnp_weighted_solve(&support, outputs, logits, &fit);
	CHECK(fit.solved);
	for (size_t c = 0; c < SIZE; c++)
		CHECK_NEAR(fit.coefficients[c], wanted[c], 1e-6);
	CHECK_AT_MOST(fit.misfit, 1e-18);
}

/* Weights by the definition, and the gradient of misfit and penalties, which vanishes. */
static void the_solution_is_the_minimum(void)
{
	struct gnp_random random;
	double factor[SIZE], slope[SIZE] = {0}, size[SIZE] = {0}, misfit = 0, total = 0, points = 0;
	unsigned order[SIZE];
	float outputs[OUTPUTS], logits[GNP_SUPPORT_NODES];
	make_support();
	gnp_random_seed(&random, 4, 0);
	gnp_taylor_indices(factor, order);
	draw_inputs(&random, outputs, logits);
	gnp_weighted_solve(&support, outputs, logits, &fit);
	CHECK(fit.solved);
	for (size_t i = 0; i < support.nodes; i++) {
		double share = 1 / (1 + exp(-(double)logits[i])), r = support.y[i];
		double window = 1 / (1 + pow(support.distance[i] / exp(2 * (double)outputs[GNP_WEIGHTED_REACH]), 4));
		double weight = support.weight[i] * share * window + 1e-9;
		CHECK_NEAR(fit.share[i], share, 1e-12);
		CHECK_NEAR(fit.window[i], window, 1e-12);
		CHECK_NEAR(fit.weight[i], weight, 1e-12 * weight);
		for (size_t c = 0; c < SIZE; c++)
			r -= fit.coefficients[c] * support.rows[i * STRIDE + c];
		for (size_t c = 0; c < SIZE; c++) {
			slope[c] += weight * r * support.rows[i * STRIDE + c];
			size[c] += weight * fabs(r * support.rows[i * STRIDE + c]);
		}
		misfit += weight * r * r;
		points += weight / support.weight[i];
		total += weight;
	}
	for (size_t c = 0; c < SIZE; c++) {
		double ridge = exp(4 * (double)outputs[order[c]]);
		CHECK_NEAR(fit.ridge[order[c]], ridge, 1e-12 * ridge);
		CHECK_NEAR(slope[c], ridge * factor[c] * fit.coefficients[c], 1e-9 * size[c]);
	}
	CHECK_NEAR(fit.misfit, misfit / points, 1e-10 * fit.misfit);
	CHECK_NEAR(fit.total, total, 1e-10 * total);
}

/* ---- Derivatives ---- */

static double loss(const float *outputs, const float *logits, const double *dcoefficients, const double *dshare)
{
	static struct gnp_weighted_fit at;
	double sum = 0;
	gnp_weighted_solve(&support, outputs, logits, &at);
	CHECK(at.solved);
	for (size_t c = 0; c < SIZE; c++)
		sum += dcoefficients[c] * at.coefficients[c];
	for (size_t i = 0; i < support.nodes; i++)
		sum += dshare[i] * at.share[i];
	return sum;
}

/* Of fourth order, by a value that is among those the loss reads. */
static double slope_by(float *value, const float *outputs, const float *logits, const double *dcoefficients,
                       const double *dshare)
{
	const float was = *value, h = 0x1p-7f;
	double difference[2];
	for (int far = 0; far < 2; far++) {
		*value = was + (float)(far + 1) * h;
		difference[far] = loss(outputs, logits, dcoefficients, dshare);
		*value = was - (float)(far + 1) * h;
		difference[far] -= loss(outputs, logits, dcoefficients, dshare);
	}
	*value = was;
	return (8 * difference[0] - difference[1]) / (12 * (double)h);
}

static void derivatives_are_differences(void)
{
	struct gnp_random random;
	make_support();
	gnp_random_seed(&random, 5, 0);
	for (int trial = 0; trial < 4; trial++) {
		float outputs[OUTPUTS], logits[GNP_SUPPORT_NODES], doutputs[OUTPUTS], dlogits[GNP_SUPPORT_NODES];
		double dcoefficients[SIZE], dshare[GNP_SUPPORT_NODES];
		draw_inputs(&random, outputs, logits);
		for (size_t c = 0; c < SIZE; c++)
			dcoefficients[c] = gnp_random_normal(&random);
		for (size_t i = 0; i < support.nodes; i++)
			dshare[i] = trial % 2 ? 0.01 * gnp_random_normal(&random) : 0;
		for (int o = 0; o < OUTPUTS; o++)
			doutputs[o] = 77;
		gnp_weighted_solve(&support, outputs, logits, &fit);
		gnp_weighted_solve_backward(&support, outputs, &fit, dcoefficients, dshare, doutputs, dlogits);
		for (int o = 0; o < OUTPUTS; o++) {
			double want = o <= GNP_WEIGHTED_REACH ? slope_by(&outputs[o], outputs, logits, dcoefficients, dshare) : 77;
			CHECK_NEAR(doutputs[o], want, 2e-5 * fabs(want) + 1e-7);
		}
		for (size_t i = (size_t)trial; i < support.nodes; i += 5) {
			double want = slope_by(&logits[i], outputs, logits, dcoefficients, dshare);
			CHECK_NEAR(dlogits[i], want, 2e-5 * fabs(want) + 1e-7);
		}
	}
}

static void outputs_beyond_their_limits_change_nothing(void)
{
	struct gnp_random random;
	float outputs[OUTPUTS], logits[GNP_SUPPORT_NODES], doutputs[OUTPUTS], dlogits[GNP_SUPPORT_NODES];
	double dcoefficients[SIZE], dshare[GNP_SUPPORT_NODES] = {0};
	make_support();
	gnp_random_seed(&random, 6, 0);
	draw_inputs(&random, outputs, logits);
	for (size_t c = 0; c < SIZE; c++)
		dcoefficients[c] = 1;
	for (int sign = -1; sign <= 1; sign += 2) {
		static struct gnp_weighted_fit farther;
		const float limits[2] = {15.5f * (float)sign, 4.5f * (float)sign};
		for (int j = 0; j <= ORDERS; j++)
			outputs[j] = limits[j == ORDERS];
		gnp_weighted_solve(&support, outputs, logits, &fit);
		gnp_weighted_solve_backward(&support, outputs, &fit, dcoefficients, dshare, doutputs, dlogits);
		CHECK(fit.solved);
		for (int j = 0; j <= ORDERS; j++)
			CHECK(doutputs[j] == 0);
		for (int j = 0; j <= ORDERS; j++)
			outputs[j] *= 100;
		gnp_weighted_solve(&support, outputs, logits, &farther);
		CHECK(memcmp(farther.coefficients, fit.coefficients, sizeof fit.coefficients) == 0 &&
		      farther.misfit == fit.misfit);
		CHECK(memcmp(farther.weight, fit.weight, sizeof fit.weight) == 0 &&
		      memcmp(farther.ridge, fit.ridge, sizeof fit.ridge) == 0);
		for (size_t i = 0; i < support.nodes; i++)
			CHECK(isfinite(dlogits[i]) && isfinite(fit.weight[i]));
	}
	CHECK(fit.ridge[0] == exp(60) && fabs(fit.coefficients[1]) < 1e-10);
}

/* Nodes of no weight at all, or all at the centre, still have a solution: penalties decide. */
static void extremes_are_solved(void)
{
	float outputs[OUTPUTS] = {0}, logits[GNP_SUPPORT_NODES];
	for (int kind = 0; kind < 12; kind++) {
		make_support();
		for (size_t i = 0; i < support.nodes; i++)
			logits[i] = kind % 3 == 0 ? -1e30f : kind % 3 == 1 ? 1e30f : i % 2 ? 100 : -100;
		for (int j = 0; j < ORDERS; j++)
			outputs[j] = kind / 3 % 2 ? -100 : -1;
		outputs[GNP_WEIGHTED_REACH] = kind % 2 ? -50 : 50;
		for (size_t i = 0; kind >= 6 && i < support.nodes * STRIDE; i++)
			support.rows[i] = i % STRIDE == 0;
		gnp_weighted_solve(&support, outputs, logits, &fit);
		CHECK(fit.solved);
		for (size_t c = 0; c < SIZE; c++)
			CHECK(isfinite(fit.coefficients[c]));
		struct gnp_weighted_variance noise = gnp_weighted_error(&support, &fit);
		struct gnp_weighted_variance all = gnp_weighted_variance(outputs, noise);
		CHECK(isfinite(noise.slope) && isfinite(noise.second) && noise.slope >= 0 && noise.second >= 0);
		CHECK(all.slope > 0 && all.second > 0 && fit.misfit >= 0 && isfinite(fit.misfit));
	}
}

static void what_determines_nothing_says_so(void)
{
	float outputs[OUTPUTS] = {0}, logits[GNP_SUPPORT_NODES] = {0}, doutputs[OUTPUTS], dlogits[GNP_SUPPORT_NODES];
	double dcoefficients[SIZE], dshare[GNP_SUPPORT_NODES];
	make_support();
	for (size_t i = 0; i < support.nodes; i++) {
		support.rows[i * STRIDE + 7] = 1e200; /* its square is no number */
		dshare[i] = 0.25;
	}
	for (size_t c = 0; c < SIZE; c++)
		dcoefficients[c] = 1;
	gnp_weighted_solve(&support, outputs, logits, &fit);
	CHECK(!fit.solved);
	for (size_t c = 0; c < STRIDE; c++)
		CHECK(fit.coefficients[c] == 0);
	struct gnp_weighted_variance noise = gnp_weighted_error(&support, &fit);
	CHECK(noise.slope == 1 && noise.second == 1);
	gnp_weighted_solve_backward(&support, outputs, &fit, dcoefficients, dshare, doutputs, dlogits);
	for (int j = 0; j <= ORDERS; j++)
		CHECK(doutputs[j] == 0);
	for (size_t i = 0; i < support.nodes; i++)
		CHECK_NEAR(dlogits[i], 0.0625, 1e-7); /* of the share alone: s (1 - s) / 4 */
}

/* ---- Errors ---- */

/* Noise on every point, so that a node of m has 1 / m of its variance. */
static void covariance_is_that_of_draws_of_noise(void)
{
	enum { DRAWS = 3000 };
	const double sigma = 0.03;
	struct gnp_random random;
	float outputs[OUTPUTS] = {0}, logits[GNP_SUPPORT_NODES];
	double slope = 0, second = 0, misfit = 0, ratio = 0;
	make_support();
	gnp_random_seed(&random, 8, 0);
	for (size_t i = 0; i < support.nodes; i++)
		logits[i] = draw(&random, 1, 2);
	for (int j = 0; j < ORDERS; j++)
		outputs[j] = j < 3 ? -5 : 1;
	for (int d = 0; d < DRAWS; d++) {
		for (size_t i = 0; i < support.nodes; i++)
			support.y[i] = sigma / sqrt(support.weight[i]) * gnp_random_normal(&random);
		gnp_weighted_solve(&support, outputs, logits, &fit);
		const double *c = fit.coefficients;
		slope += (c[1] * c[1] + c[2] * c[2]) / 2 / DRAWS;
		second += (4 * c[3] * c[3] + 2 * c[4] * c[4] + 4 * c[5] * c[5]) / 3 / DRAWS;
		misfit += fit.misfit / DRAWS;
	}
	struct gnp_weighted_variance noise = gnp_weighted_error(&support, &fit);
	ratio = sigma * sigma / fit.misfit;
	CHECK_NEAR(noise.slope * ratio / slope, 1, 0.1);
	CHECK_NEAR(noise.second * ratio / second, 1, 0.1);
	CHECK_NEAR(misfit / (sigma * sigma), 1, 0.15); /* the fit takes some of the noise */
}

/* Heights of a polynomial without noise: what is off is what the penalties took, and that is what is said. */
static void the_pull_of_penalties_is_part_of_the_error(void)
{
	float outputs[OUTPUTS] = {0}, logits[GNP_SUPPORT_NODES] = {0};
	double truth[STRIDE] = {0.1, 0.2, -0.3, 0.5, 0.2, 0.4};
	make_support();
	for (size_t i = 0; i < support.nodes; i++) {
		support.y[i] = 0;
		for (size_t c = 0; c < SIZE; c++)
			support.y[i] += truth[c] * support.rows[i * STRIDE + c];
	}
	for (int j = 0; j < ORDERS; j++)
		outputs[j] = j == 0 ? -5 : j == 1 ? -1.2f : j == 2 ? -0.6f : 2;
	gnp_weighted_solve(&support, outputs, logits, &fit);
	double off[6], slope, second;
	for (int c = 1; c < 6; c++)
		off[c] = (fit.coefficients[c] - truth[c]) * (fit.coefficients[c] - truth[c]);
	slope = off[1] + off[2];
	second = 4 * off[3] + 2 * off[4] + 4 * off[5];
	struct gnp_weighted_variance error = gnp_weighted_error(&support, &fit);
	CHECK(sqrt(slope) > 1e-4 && sqrt(second) > 1e-3);
	CHECK_NEAR(sqrt(error.slope / slope), 1, 0.2);
	CHECK_NEAR(sqrt(error.second / second), 1, 0.2);
}

static void networks_scale_errors_and_add_to_them(void)
{
	float outputs[OUTPUTS] = {0};
	outputs[GNP_WEIGHTED_SLOPE_SCALE] = 0.25f;
	outputs[GNP_WEIGHTED_SLOPE_BIAS] = -1;
	outputs[GNP_WEIGHTED_SECOND_SCALE] = 9;
	outputs[GNP_WEIGHTED_SECOND_BIAS] = -99;
	struct gnp_weighted_variance all = gnp_weighted_variance(outputs, (struct gnp_weighted_variance){0.1, 0.2});
	CHECK_NEAR(all.slope, 0.1 * exp(1) + exp(-4), 1e-12);
	CHECK_NEAR(all.second, 0.2 * exp(8) + exp(-32), 1e-9);
	outputs[GNP_WEIGHTED_SECOND_SCALE] = -9;
	outputs[GNP_WEIGHTED_SECOND_BIAS] = 99;
	CHECK_NEAR(gnp_weighted_variance(outputs, all).second, all.second * exp(-8) + exp(8), 1e-9 * exp(8));
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(polynomials_are_reproduced),
	                                    TEST(the_solution_is_the_minimum),
	                                    TEST(derivatives_are_differences),
	                                    TEST(outputs_beyond_their_limits_change_nothing),
	                                    TEST(extremes_are_solved),
	                                    TEST(what_determines_nothing_says_so),
	                                    TEST(covariance_is_that_of_draws_of_noise),
	                                    TEST(the_pull_of_penalties_is_part_of_the_error),
	                                    TEST(networks_scale_errors_and_add_to_them)};
	return RUN_TESTS(tests);
}
