/* What the model for every cloud is trained by: losses and their derivatives, gradients, and what it starts from. */
#include "core/linear/linalg.h"
#include "tests/unit/weights/train/any_scene.h"
#include "weights/train/any/any_batch.h"

static struct gnp_scratch *scratch;

/* ---- Losses ---- */

static void surface_loss_has_its_derivative(void)
{
	const struct gnp_any_truth curved = {{0.28, -0.1, 0.9548}, true, {0.4, -0.2, 1.1}};
	const struct gnp_any_truth bare = {{0.6, 0, 0.8}, false, {0}};
	const double sizes[3] = {1, 1e-2, 1e-4};
	for (int k = 0; k < 6; k++) {
		const struct gnp_any_truth *truth = k % 2 ? &bare : &curved;
		double size = sizes[k / 2], c[GNP_TAYLOR_SIZE] = {0}, d[GNP_TAYLOR_SIZE], unused[GNP_TAYLOR_SIZE];
		struct gnp_any_error made;
		c[1] = -truth->normal[0] / truth->normal[2] + 0.3 * size;
		c[2] = -truth->normal[1] / truth->normal[2] - 0.2 * size;
		c[3] = truth->hessian[0] / 2 + 0.1 * size;
		c[4] = truth->hessian[1] - 0.4 * size;
		c[5] = truth->hessian[2] / 2 + 0.2 * size;
		gnp_any_loss_surface(truth, c, d, &made);
		for (int i = 0; i < GNP_TAYLOR_SIZE; i++) {
			double step = 1e-5 * size, at = c[i], high, low;
			c[i] = at + step;
			high = gnp_any_loss_surface(truth, c, unused, &made);
			c[i] = at - step;
			low = gnp_any_loss_surface(truth, c, unused, &made);
			c[i] = at;
			CHECK_NEAR(d[i], (high - low) / (2 * step), 1e-4 * (fabs(d[i]) + 0.01));
		}
	}
}

static void surface_errors_are_those_made(void)
{
	const struct gnp_any_truth truth = {{0, 0, 1}, true, {0.9, 0, 0}};
	double c[GNP_TAYLOR_SIZE] = {0, 1, 0, 0.5, 0.2}, d[GNP_TAYLOR_SIZE];
	struct gnp_any_error made;
	gnp_any_loss_surface(&truth, c, d, &made);
	CHECK_NEAR(made.angle, M_PI / 4, 1e-12);
	CHECK_NEAR(made.hessian, 0.01 + 2 * 0.04, 1e-12);
	CHECK_NEAR(made.relative, 0.3, 1e-12); /* over 0.9 + 0.1 */
}

static void cross_entropy_has_its_derivative(void)
{
	double d, unused;
	for (int is = 0; is < 2; is++)
		for (float x = -3; x <= 3; x += 1.5f) {
			double p = 1 / (1 + exp(-(double)x));
			CHECK_NEAR(gnp_any_loss_logit(x, is, &d), -log(is ? p : 1 - p), 1e-12);
			double high = gnp_any_loss_logit(x + 0.0078125f, is, &unused);
			double low = gnp_any_loss_logit(x - 0.0078125f, is, &unused);
			CHECK_NEAR(d, (high - low) / 0.015625, 1e-5);
		}
	CHECK_NEAR(gnp_any_loss_logit(-200, true, &d), 200, 1e-9);
	CHECK_NEAR(d, -1, 1e-12);
}

static void likelihood_of_errors_has_its_derivative(void)
{
	const float at[4][2] = {{0.2f, -1}, {-1, -2}, {1.5f, 0.25f}, {0, -3}};
	for (int k = 0; k < 4; k++) {
		const float h = 0.0009765625f;
		double squared = 0.02 * (k + 1), noise = 0.01, d[2], unused[2];
		gnp_any_loss_errors(squared, 2, noise, at[k][0], at[k][1], &d[0], &d[1]);
		for (int i = 0; i < 2; i++) {
			float up[2] = {at[k][0], at[k][1]}, down[2] = {at[k][0], at[k][1]};
			up[i] += h;
			down[i] -= h;
			double high = gnp_any_loss_errors(squared, 2, noise, up[0], up[1], &unused[0], &unused[1]);
			double low = gnp_any_loss_errors(squared, 2, noise, down[0], down[1], &unused[0], &unused[1]);
			CHECK_NEAR(d[i], (high - low) / (2 * (double)h), 1e-3 * (fabs(d[i]) + 0.01));
		}
	}
}

/* Beyond its limits a scale is not pushed on, but may come back. The best variance is squared / dimensions. */
static void scales_of_errors_keep_to_their_limits(void)
{
	double dscale, dbias, best;
	gnp_any_loss_errors(1e6, 2, 0.01, 2.5f, -3, &dscale, &dbias);
	CHECK(dscale == 0);
	gnp_any_loss_errors(1e-6, 2, 0.01, 2.5f, -3, &dscale, &dbias);
	CHECK(dscale > 0);
	gnp_any_loss_errors(1e-12, 2, 1, -2.5f, -8, &dscale, &dbias);
	CHECK(dscale == 0);
	best = gnp_any_loss_errors(2 * exp(-4), 2, 0, 0, -1, &dscale, &dbias);
	CHECK_NEAR(best, 1 - 4, 1e-6);
	CHECK_NEAR(dbias, 0, 1e-6);
}

static void frames_cost_what_they_turn(void)
{
	CHECK_NEAR(gnp_any_loss_frame(1), 0, 1e-12);
	CHECK_NEAR(gnp_any_loss_frame(-1), 0, 1e-12);
	CHECK_NEAR(gnp_any_loss_frame(0), 0.15 * log(1 + 2 / 0.0036) + 6, 1e-9);
	CHECK(gnp_any_loss_frame(0.9) < gnp_any_loss_frame(0.8));
}

/* ---- Gradients ---- */

/* Length of a gradient against the difference of the loss along it. */
static void check_along(struct gnp_network *network, const float *gradient,
                        double (*loss)(struct gnp_network *, float *), double step, double tolerance)
{
	size_t total = network->layout.total;
	float *parameters = malloc(total * sizeof *parameters), *unused = calloc(total, sizeof *unused);
	double square = 0, sides[2];
	for (size_t i = 0; i < total; i++)
		square += (double)gradient[i] * (double)gradient[i];
	for (int side = 0; side < 2; side++) {
		struct gnp_network *moved;
		for (size_t i = 0; i < total; i++)
			parameters[i] =
				(float)((double)network->parameters[i] + (side ? step : -step) * (double)gradient[i] / sqrt(square));
		CHECK(gnp_network_create(&network->architecture, parameters, &moved, NULL) == GNP_OK);
		sides[side] = loss(moved, unused);
		gnp_network_free(moved);
	}
	CHECK(square > 0);
	CHECK_NEAR((sides[1] - sides[0]) / (2 * step), sqrt(square), tolerance * sqrt(square));
	free(parameters);
	free(unused);
}

static struct gnp_any_cloud drawn_from;

static double frames_loss(struct gnp_network *network, float *gradient)
{
	const struct gnp_any_pick from = {&drawn_from, 1};
	struct gnp_random random;
	double loss = 0;
	gnp_random_seed(&random, 4, 0);
	CHECK(gnp_any_batch_frames(network, &from, 32, &random, scratch, &loss, gradient, NULL) == GNP_OK);
	return loss;
}

static double supports_loss(struct gnp_network *network, float *gradient)
{
	const struct gnp_any_pick from = {&drawn_from, 1};
	struct gnp_any_terms terms = {0};
	struct gnp_random random;
	gnp_random_seed(&random, 4, 0);
	CHECK(gnp_any_batch_supports(network, &from, 8, 8, &random, scratch, &terms, gradient, NULL) == GNP_OK);
	return gnp_any_loss_total(&terms);
}

static void batches_have_their_gradients(void)
{
	struct gnp_any_recipe recipe = recipe_of(GNP_ANY_SOLID, 0.3);
	recipe.outliers = 0.1;
	drawn_from = make_cloud(&recipe, 3);
	struct gnp_network *network = make_network();
	float *gradient = calloc(network->layout.total, sizeof *gradient);
	frames_loss(network, gradient);
	check_along(network, gradient, frames_loss, 1e-2, 0.01);
	memset(gradient, 0, network->layout.total * sizeof *gradient);
	supports_loss(network, gradient);
	const struct gnp_parameter_row *weight = gnp_layout_find(&network->layout, "head.4.weight");
	const struct gnp_parameter_row *bias = gnp_layout_find(&network->layout, "head.4.bias");
	for (int o = GNP_WEIGHTED_SLOPE_SCALE; o <= GNP_WEIGHTED_SECOND_BIAS; o++) { /* of errors: not in the sum */
		CHECK(gradient[bias->offset + (size_t)o] != 0);
		memset(gradient + weight->offset + (size_t)o * weight->shape[1], 0, weight->shape[1] * sizeof *gradient);
		gradient[bias->offset + (size_t)o] = 0;
	}
	check_along(network, gradient, supports_loss, 1e-3, 0.03);
	free(gradient);
	gnp_network_free(network);
	gnp_any_cloud_clear(&drawn_from);
}

static double largest(const struct gnp_network *network, const char *name)
{
	double most = 0;
	for (size_t i = 0; i < gnp_layout_find(&network->layout, name)->count; i++)
		most = fmax(most, fabs((double)gnp_network_tensor(network, name)[i]));
	return most;
}

static void parameters_start_within_their_bounds(void)
{
	struct gnp_network *network = make_network();
	const struct {
		const char *name;
		double bound;
	} rows[] = {{"lift.weight", 1 / sqrt(10)},          {"lift.bias", 0.2},
	            {"convs.0.kernel1.layers.0.bias", 0.2}, {"convs.0.kernel2.layers.1.weight", 1 / sqrt(8)},
	            {"convs.0.kernel2.layers.2.weight", sqrt(12.0 / 64)}, {"head.2.weight", 1 / sqrt(8)},
	            {"node.2.weight", 0.1},                 {"frame.0.weight", 1.5 / sqrt(GNP_LADDER_LOOKS)}};
	for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
		double most = largest(network, rows[i].name);
		CHECK_AT_MOST(most, rows[i].bound * 1.0001);
		CHECK(most > 0.5 * rows[i].bound);
	}
	CHECK(largest(network, "convs.0.kernel1.layers.2.bias") == 0 && largest(network, "head.4.weight") == 0);
	CHECK(largest(network, "head.mean") == 0 && gnp_network_tensor(network, "frame.deviation")[3] == 1);
	CHECK_NEAR(gnp_network_tensor(network, "head.4.bias")[GNP_WEIGHTED_RIDGE + 3], log(1e-5) / 4, 1e-6);
	gnp_network_free(network);
}

static void spreads_are_means_and_deviations(void)
{
	struct gnp_network *network = make_network();
	struct gnp_any_spread spread;
	float *parameters = malloc(network->layout.total * sizeof *parameters), row[GNP_LADDER_LOOKS] = {0};
	CHECK(gnp_any_spread_begin(GNP_LADDER_LOOKS, scratch, &spread, NULL) == GNP_OK);
	for (int i = 0; i < 4; i++) {
		row[0] = (float)(3 + 2 * (i % 2));
		gnp_any_spread_add(&spread, row);
	}
	gnp_any_spread_write(&spread, &network->layout, "frame", parameters);
	const float *mean = parameters + gnp_layout_find(&network->layout, "frame.mean")->offset;
	const float *deviation = parameters + gnp_layout_find(&network->layout, "frame.deviation")->offset;
	CHECK_NEAR(mean[0], 4, 1e-6);
	CHECK_NEAR(deviation[0], sqrt(1.01), 1e-6);
	CHECK_NEAR(mean[1], 0, 0);
	CHECK_NEAR(deviation[1], 0.1, 1e-6);
	free(parameters);
	gnp_network_free(network);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(surface_loss_has_its_derivative),
		TEST(surface_errors_are_those_made),
		TEST(cross_entropy_has_its_derivative),
		TEST(likelihood_of_errors_has_its_derivative),
		TEST(scales_of_errors_keep_to_their_limits),
		TEST(frames_cost_what_they_turn),
		TEST(batches_have_their_gradients),
		TEST(parameters_start_within_their_bounds),
		TEST(spreads_are_means_and_deviations),
	};
	gnp_linalg_init();
	scratch = gnp_scratch_create();
	if (!scratch || gnp_pool_create(1, &pool, NULL) != GNP_OK)
		return 1;
	int result = RUN_TESTS(tests);
	gnp_pool_free(pool);
	gnp_scratch_free(scratch);
	return result;
}
