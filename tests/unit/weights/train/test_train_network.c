/* Operators in training: their gradient through loss and head by differences, their parameters to begin with. */
#include "core/estimators/projection_fit.h"
#include "core/estimators/sheets.h"
#include "core/linear/linalg.h"
#include "core/model/model.h"
#include "tests/unit/test.h"
#include "weights/train/initial.h"
#include "weights/train/loss.h"
#include "weights/train/train_fit.h"
#include "weights/train/train_network.h"

enum { POINTS = 3000, PATCHES = 3 };

static struct gnp_pool *pool;
static struct gnp_train_cloud cloud;
static struct gnp_scratch *scratch;
static struct gnp_train_patches patches;

static void set_up(void)
{
	const struct gnp_train_shape_key key = {.seed = 3, .degree = 10, .points = POINTS};
	const struct gnp_train_recipe recipe = {.k = 30, .delta0_ratio = 0.5, .buffer = 1.25, .reach = 150};
	struct gnp_train_shape shape;
	struct gnp_random random;
	char folder[64] = "/tmp/gnp-train-operator-XXXXXX", command[96];
	gnp_random_seed(&random, 1, 0);
	scratch = gnp_scratch_create();
	bool good = mkdtemp(folder) && gnp_pool_create(1, &pool, NULL) == GNP_OK &&
	            gnp_train_shape_load(folder, &key, pool, NULL, &shape, NULL) == GNP_OK &&
	            gnp_train_cloud_enter_take(&shape, GNP_REGIME_NOISE_70, 1e-3, 7, pool, &cloud, NULL) == GNP_OK &&
	            gnp_train_patches_draw(&cloud, &recipe, PATCHES, &random, scratch, &patches, NULL) == GNP_OK;
	snprintf(command, sizeof command, "rm -r %s", folder);
	if (!good || system(command) != 0)
		exit(1);
}

static struct gnp_architecture small(enum gnp_trunk_kind trunk, enum gnp_head_kind head)
{
	struct gnp_architecture a = {.trunk = trunk, .head = head, .features = 3, .width = 8, .channels = 2, .neurons = 8, .layers = 2,
	                             .quadrature = 8, .head_width = 8, .outputs = 16};
	if (head == GNP_HEAD_PROJECTION) {
		a.features = 4;
		a.shells = 2;
		a.shell[0] = 60;
		a.shell[1] = 120;
		a.ridge = 1e-5;
		if (trunk == GNP_TRUNK_NONE)
			a.features = a.width = a.channels = a.neurons = a.layers = a.quadrature = 0;
		a.outputs = (unsigned)gnp_projection_outputs(&a);
	}
	return a;
}

/* The loss of the patches, and its gradient when asked for. */
static double loss_of(struct gnp_trainable *network, const float *parameters, float *gradient)
{
	const struct gnp_loss_options options = gnp_loss_defaults();
	size_t size = gnp_basis_size(network->basis);
	double coefficients[PATCHES * GNP_BASIS_MAX], dcoefficients[PATCHES * GNP_BASIS_MAX] = {0}, loss = 0;
	struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
	void *tape;
	CHECK(network->load(network->state, parameters, NULL) == GNP_OK);
	CHECK(network->forward(network->state, &patches, coefficients, gradient ? &tape : NULL, scratch, NULL) == GNP_OK);
	for (size_t p = 0; p < PATCHES; p++) {
		size_t from = patches.truth_start[p], count = patches.truth_start[p + 1] - from;
		struct gnp_loss_scale scale = gnp_loss_scale_of(&cloud, &patches.patches[p]);
		struct gnp_jet jets[100], djets[100];
		double rows[6 * GNP_BASIS_MAX];
		CHECK(count > 20 && count <= 100);
		for (size_t i = 0; i < count; i++)
			jets[i] = gnp_train_fit_jet(network->basis, coefficients + p * size, &patches.patches[p], patches.truth[from + i].u,
			                            patches.truth[from + i].v, rows);
		loss += gnp_loss_patch(&options, &scale, patches.truth + from, jets, count, NULL, djets);
		for (size_t i = 0; i < count; i++) {
			gnp_train_fit_jet(network->basis, coefficients + p * size, &patches.patches[p], patches.truth[from + i].u,
			                  patches.truth[from + i].v, rows);
			gnp_train_fit_back(network->basis, rows, &djets[i], dcoefficients + p * size);
		}
	}
	if (gradient)
		CHECK(network->backward(network->state, &patches, tape, dcoefficients, gradient, scratch, NULL) == GNP_OK);
	gnp_scratch_release(scratch, mark);
	return loss;
}

/* The slope along random directions, by differences of the loss. Single precision allows no more. */
static void check_gradient(enum gnp_trunk_kind trunk, enum gnp_head_kind head)
{
	struct gnp_architecture architecture = small(trunk, head);
	struct gnp_trainable network;
	CHECK(gnp_train_network_open(&architecture, NULL, &network, NULL) == GNP_OK);
	size_t count = network.parameter_count;
	float *at = calloc(count, sizeof *at), *to = calloc(count, sizeof *to), *gradient = calloc(count, sizeof *gradient);
	network.initialize(network.state, 5, at);
	if (network.calibrate)
		CHECK(network.calibrate(network.state, &patches, 1, at, scratch, NULL) == GNP_OK);
	loss_of(&network, at, gradient);
	for (uint64_t trial = 0; trial < 12; trial++) {
		struct gnp_random random;
		double step = 2e-3, slope = 0, sides[2], size = 0;
		for (int side = 0; side < 2; side++) {
			gnp_random_seed(&random, 9, trial);
			slope = size = 0;
			for (size_t i = 0; i < count; i++) {
				double direction = gradient[i] == 0 ? 0 : gnp_random_normal(&random) / sqrt((double)count);
				to[i] = (float)(at[i] + (side ? step : -step) * direction);
				slope += gradient[i] * direction;
				size += (double)gradient[i] * gradient[i] / (double)count;
			}
			sides[side] = loss_of(&network, to, NULL);
		}
		CHECK(size > 0);
		CHECK_NEAR((sides[1] - sides[0]) / (2 * step), slope, 0.03 * sqrt(size));
	}
	free(at);
	free(to);
	free(gradient);
	gnp_train_network_close(&network);
}

static void gradients_of_the_pooled_head_are_the_slope_of_the_loss(void)
{
	for (int trunk = 0; trunk < GNP_TRUNK_NONE; trunk++)
		check_gradient((enum gnp_trunk_kind)trunk, GNP_HEAD_POOLED);
}

static void gradients_of_the_projection_head_are_the_slope_of_the_loss(void)
{
	for (int trunk = 0; trunk < GNP_TRUNKS; trunk++)
		check_gradient((enum gnp_trunk_kind)trunk, GNP_HEAD_PROJECTION);
}

static size_t usable(const void *context, const struct gnp_patch *patch, size_t most, uint32_t *positions)
{
	(void)context;
	return gnp_sheets_usable(cloud.prepared.normals, cloud.outlier, patch, most, positions);
}

/* Over the patches they are calibrated on, inputs have mean 0 and spread 1 (but for a floor of 0.01). */
static void summaries_are_calibrated(void)
{
	struct gnp_architecture a = small(GNP_TRUNK_EDGE, GNP_HEAD_PROJECTION);
	struct gnp_trainable network;
	struct gnp_layout layout;
	struct gnp_projected projected;
	struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
	size_t width = gnp_projection_summary(&a);
	CHECK(gnp_architecture_layout(&a, &layout, NULL) == GNP_OK &&
	      gnp_train_network_open(&a, NULL, &network, NULL) == GNP_OK);
	float *parameters = calloc(layout.total, sizeof *parameters);
	network.initialize(network.state, 5, parameters);
	CHECK(network.calibrate(network.state, &patches, 1, parameters, scratch, NULL) == GNP_OK);
	CHECK(gnp_projected_describe(&a, patches.patches, PATCHES, usable, NULL, &projected, scratch, NULL) == GNP_OK);
	const float *mean = parameters + gnp_layout_find(&layout, "head.mean")->offset;
	const float *deviation = parameters + gnp_layout_find(&layout, "head.deviation")->offset;
	for (size_t i = 0; i < width; i++) {
		double sum = 0, square = 0;
		for (size_t p = 0; p < PATCHES; p++) {
			double x = ((double)projected.summary[p * width + i] - (double)mean[i]) / (double)deviation[i];
			sum += x / PATCHES;
			square += x * x / PATCHES;
		}
		CHECK_NEAR(sum, 0, 1e-3);
		CHECK(square < 1.01 && (square > 0.95 || deviation[i] < 0.05f));
	}
	free(parameters);
	gnp_scratch_release(scratch, mark);
	gnp_train_network_close(&network);
}

static void parameters_begin_as_described(void)
{
	struct gnp_architecture a = small(GNP_TRUNK_EDGE, GNP_HEAD_POOLED);
	struct gnp_layout layout;
	a.width = 32;
	a.neurons = 64;
	CHECK(gnp_architecture_layout(&a, &layout, NULL) == GNP_OK);
	float *one = calloc(layout.total, sizeof *one), *other = calloc(layout.total, sizeof *other);
	gnp_initial_parameters(&a, &layout, 1, one);
	gnp_initial_parameters(&a, &layout, 2, other);
	static const struct {
		const char *name;
		double deviation;
	} rows[] = {{"model.lift.weight", 1 / 3.0},
	            {"model.lift.bias", 1 / 3.0},
	            {"model.convs.0.nn.layers.0.weight", 1 / sqrt(18)},
	            {"model.convs.1.nn.layers.1.weight", 1 / 32.0},
	            {"model.convs.1.nn.layers.1.bias", 0},
	            {"model.mixes.1.weight", 1 / sqrt(96)}};
	for (size_t r = 0; r < sizeof rows / sizeof *rows; r++) {
		const struct gnp_parameter_row *row = gnp_layout_find(&layout, rows[r].name);
		double square = 0;
		for (size_t i = 0; i < row->count; i++) {
			square += (double)one[row->offset + i] * one[row->offset + i] / (double)row->count;
			CHECK(rows[r].deviation == 0 || one[row->offset + i] != other[row->offset + i]);
		}
		CHECK_NEAR(sqrt(square), rows[r].deviation, 0.2 * rows[r].deviation);
	}
	free(one);
	free(other);
}

/* The layer that ends a separable kernel begins as the edge kernel's does. */
static void kernels_of_both_trunks_begin_alike(void)
{
	struct gnp_architecture a = small(GNP_TRUNK_SEPARABLE, GNP_HEAD_POOLED);
	struct gnp_layout layout;
	a.width = 32;
	a.neurons = 64;
	CHECK(gnp_architecture_layout(&a, &layout, NULL) == GNP_OK);
	float *parameters = calloc(layout.total, sizeof *parameters);
	gnp_initial_parameters(&a, &layout, 1, parameters);
	for (int kernel = 1; kernel <= 2; kernel++) {
		char name[64];
		double square = 0;
		snprintf(name, sizeof name, "convs.1.kernel%d.layers.2.weight", kernel);
		const struct gnp_parameter_row *weight = gnp_layout_find(&layout, name), *bias = weight + 1;
		for (size_t i = 0; i < weight->count; i++)
			square += (double)parameters[weight->offset + i] * parameters[weight->offset + i] / (double)weight->count;
		CHECK_NEAR(sqrt(square), 1 / 32.0, 0.2 / 32);
		for (size_t i = 0; i < bias->count; i++)
			CHECK(parameters[bias->offset + i] == 0);
	}
	free(parameters);
}

/* Written to a file and begun from it, parameters are those of the file; a file of another network is refused. */
static void a_training_begins_from_a_model(void)
{
	struct gnp_architecture a = small(GNP_TRUNK_NONE, GNP_HEAD_PROJECTION), other = a;
	struct gnp_trainable network;
	struct gnp_layout layout;
	struct gnp_error error = {0};
	const char *path = "/tmp/gnp-train-network-from.safetensors";
	CHECK(gnp_architecture_layout(&a, &layout, NULL) == GNP_OK);
	float *own = calloc(layout.total, sizeof *own), *begun = calloc(layout.total, sizeof *begun);
	gnp_initial_parameters(&a, &layout, 9, own);
	for (size_t i = 0; i < layout.total; i++)
		own[i] += (float)i;
	const struct gnp_model_source source = {.architecture = a,
	                                        .recipe = {.k = 30, .buffer = 1.25, .height_scale = 2, .delta0_ratio = 0.1},
	                                        .regime = "clean",
	                                        .parameters = own};
	CHECK(gnp_model_save(path, &source, NULL) == GNP_OK);
	CHECK(gnp_train_network_open(&a, path, &network, NULL) == GNP_OK && !network.calibrate);
	network.initialize(network.state, 5, begun);
	CHECK(memcmp(own, begun, layout.total * sizeof *own) == 0);
	gnp_train_network_close(&network);
	other.head_width = 12;
	CHECK(gnp_train_network_open(&other, path, &network, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "--from: /tmp/gnp-train-network-from.safetensors is \"none projection");
	CHECK(gnp_train_network_open(&a, "/proc/none.safetensors", &network, NULL) != GNP_OK);
	CHECK(remove(path) == 0);
	free(own);
	free(begun);
}

static void what_cannot_be_trained_is_refused(void)
{
	struct gnp_architecture architecture = small(GNP_TRUNK_EDGE, GNP_HEAD_POOLED);
	struct gnp_trainable network;
	struct gnp_error error = {0};
	architecture.width = 9;
	CHECK(gnp_train_network_open(&architecture, NULL, &network, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "width: got 9");
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(gradients_of_the_pooled_head_are_the_slope_of_the_loss),
		TEST(gradients_of_the_projection_head_are_the_slope_of_the_loss),
		TEST(summaries_are_calibrated),
		TEST(parameters_begin_as_described),
		TEST(kernels_of_both_trunks_begin_alike),
		TEST(a_training_begins_from_a_model), TEST(what_cannot_be_trained_is_refused),
	};
	gnp_linalg_init();
	set_up();
	int failed = RUN_TESTS(tests);
	gnp_scratch_free(scratch);
	gnp_train_cloud_clear(&cloud);
	gnp_pool_free(pool);
	return failed;
}
