/* Models against another hand's: tests/oracles/oracle_projection.py made tests/oracles/data/projection.npz from every
 * file of weights/ and from three networks of a formula, and says how patches and parameters are made. When a file of
 * weights changes:
 * python3 tests/oracles/oracle_projection.py weights */
#include "core/estimators/projection_fit.h"
#include "core/fit/legendre.h"
#include "core/linear/linalg.h"
#include "core/model/models.h"
#include "core/network/pooled.h"
#include "tests/oracles/frozen.h"
#include "tests/unit/test.h"

enum { PATCHES = 4, SIZE = GNP_TAYLOR_SIZE, ORDERS = GNP_TAYLOR_DEGREE + 1, POINTS_MAX = 4096, DIGEST = 32 };

static struct frozen frozen = {.path = "tests/oracles/data/projection.npz"};

/* NULL and a failure where nothing is frozen, or something of another size. */
static const double *doubles(const char *model, const char *key, size_t count)
{
	char name[128];
	snprintf(name, sizeof name, "%s.%s", model, key);
	const double *values = frozen_doubles(&frozen, name, count);
	if (!values) {
		test_failures++;
		fprintf(stderr, "%s: %s: none that fits; run python3 tests/oracles/oracle_projection.py weights\n", frozen.path, name);
	}
	return values;
}

static double uniform(size_t row, size_t i)
{
	uint32_t x = (uint32_t)(1000003 * row + i);
	for (int round = 0; round < 2; round++)
		x = (x ^ x >> 16) * UINT32_C(0x45D9F3B);
	return (x ^ x >> 16) / 4294967296.0;
}

/* ---- Patches ---- */

struct point {
	double u, v, y;
};

static int by_distance(const void *a, const void *b)
{
	const struct point *p = a, *q = b;
	double s = p->u * p->u + p->v * p->v, t = q->u * q->u + q->v * q->v;
	return (s > t) - (s < t);
}

static size_t make_points(size_t p, size_t k, size_t count, struct point *points)
{
	static const double noises[PATCHES] = {2e-5, 0.002, 0.004, 0.03};
	count = p == 1 ? count / 3 : count;
	double half = sqrt(3.0 * (double)count / (double)k) / 2;
	for (size_t i = 0; i < count; i++) {
		double u = half * (2 * uniform(3 * p, i) - 1), v = half * (2 * uniform(3 * p + 1, i) - 1);
		u += p == 2 ? half * 0.7 : 0;
		points[i] = (struct point){u, v, 0.08 * u * u - 0.05 * u * v + 0.03 * v * v + 0.01 * u * v * v - 0.002 * u * u * u * v + 0.02 +
		                                     noises[p] * (2 * uniform(3 * p + 2, i) - 1)};
	}
	qsort(points, count, sizeof *points, by_distance);
	return count;
}

/* ---- Comparisons ---- */

/* Largest difference against the largest value, patch by patch. */
static void check_close(const char *model, const char *key, const double *got, const double *want, size_t each, double tolerance)
{
	for (size_t p = 0; p < PATCHES; p++) {
		double difference = 0, largest = 0;
		for (size_t i = p * each; i < (p + 1) * each; i++) {
			difference = fmax(difference, fabs(got[i] - want[i]));
			largest = fmax(largest, fabs(want[i]));
		}
		if (!(difference <= tolerance * largest)) {
			test_failures++;
			fprintf(stderr, "%s: %s: patch %zu: off by %g of %g\n", model, key, p, difference, largest);
		}
	}
}

static void check_floats(const char *model, const char *key, const float *got, size_t each, double tolerance)
{
	const double *want = doubles(model, key, PATCHES * each);
	double *values = malloc(PATCHES * each * sizeof *values);
	for (size_t i = 0; i < PATCHES * each; i++)
		values[i] = (double)got[i];
	if (want)
		check_close(model, key, values, want, each, tolerance);
	free(values);
}

/* Heights and their derivatives up to second order at places within the patch's disk, each in units of its largest. */
static void check_jets(const char *model, struct gnp_basis basis, const double *got, const double *want)
{
	static const double places[][2] = {{0, 0}, {0.5, -0.3}, {-0.6, 0.2}, {0.1, 0.8}};
	size_t size = gnp_basis_size(basis);
	for (int d = 0; d < 6; d++) {
		double values[2][PATCHES * 4];
		for (size_t i = 0; i < PATCHES * 4; i++)
			for (int side = 0; side < 2; side++) {
				const double *coefficients = (side ? want : got) + i / 4 * size;
				struct gnp_jet j = gnp_basis_jet(basis, coefficients, places[i % 4][0], places[i % 4][1]);
				values[side][i] = (double[]){j.f, j.u, j.v, j.uu, j.uv, j.vv}[d];
			}
		check_close(model, "jets", values[0], values[1], 4, 1e-5);
	}
}

/* ---- Networks ---- */

static size_t all_usable(const void *context, const struct gnp_patch *patch, size_t most, uint32_t *positions)
{
	size_t count = patch->buffer_count < most ? patch->buffer_count : most;
	(void)context;
	for (size_t i = 0; i < count; i++)
		positions[i] = (uint32_t)i;
	return count;
}

/* A patch in scratch; its heights are kept in units of their own, to be undone. */
static struct gnp_patch take_patch(size_t p, size_t k, size_t count, double height, struct gnp_scratch *scratch)
{
	static struct point points[POINTS_MAX];
	CHECK(count <= POINTS_MAX);
	count = make_points(p, k, count, points);
	double *u = gnp_scratch_take(scratch, 3 * count, sizeof *u), *v = u + count, *w = v + count;
	struct gnp_patch patch = {.k = k, .buffer_count = count, .u = u, .v = v, .w = w, .scale_xy = 2, .scale_w = 2 * height};
	for (size_t i = 0; i < count; i++) {
		u[i] = points[i].u;
		v[i] = points[i].v;
		w[i] = points[i].y / height;
		patch.count += u[i] * u[i] + v[i] * v[i] <= 1;
	}
	return patch;
}

static void check_projection(const char *name, const struct gnp_network *network, size_t k)
{
	static const struct gnp_basis taylor = {GNP_BASIS_TAYLOR, GNP_TAYLOR_DEGREE};
	const struct gnp_architecture *a = &network->architecture;
	struct gnp_scratch *scratch = gnp_scratch_create();
	struct gnp_patch patches[PATCHES];
	struct gnp_projected projected;
	double coefficients[PATCHES * SIZE];
	float *mean = gnp_scratch_take(scratch, PATCHES, a->width * sizeof *mean);
	const double *want = doubles(name, "coefficients", PATCHES * SIZE);
	for (size_t p = 0; p < PATCHES; p++)
		patches[p] = take_patch(p, k, a->shell[a->shells - 1], 0.25, scratch);
	CHECK(gnp_projected_describe(a, patches, PATCHES, all_usable, NULL, &projected, scratch, NULL) == GNP_OK);
	CHECK(gnp_projected_solve(network, false, &projected, scratch, NULL) == GNP_OK);
	CHECK(gnp_trunk_forward(network, &projected.batch, mean, NULL, scratch, NULL) == GNP_OK);
	check_floats(name, "summary", projected.summary, gnp_projection_summary(a), 1e-6);
	if (a->width > 0)
		check_floats(name, "mean", mean, a->width, 1e-5);
	check_floats(name, "outputs", projected.outputs, gnp_projection_outputs(a), 1e-5);
	for (size_t p = 0; p < PATCHES; p++)
		memcpy(coefficients + p * SIZE, projected.fits[p].coefficients, SIZE * sizeof *coefficients);
	if (want)
		check_jets(name, taylor, coefficients, want);
	gnp_scratch_free(scratch);
}

static void check_pooled(const char *name, const struct gnp_model *model)
{
	static const struct gnp_basis legendre = {GNP_BASIS_TENSOR, 3};
	enum { OUTPUTS = 16 };
	struct gnp_scratch *scratch = gnp_scratch_create();
	size_t k = model->recipe.k, count = (size_t)((double)k * model->recipe.buffer * model->recipe.buffer) + 4;
	size_t start[PATCHES + 1] = {0}, inner[PATCHES];
	float *nodes = gnp_scratch_take(scratch, PATCHES * count, 3 * sizeof *nodes), *node = nodes, got[PATCHES * OUTPUTS];
	double coefficients[PATCHES * OUTPUTS];
	const double *want = doubles(name, "coefficients", PATCHES * OUTPUTS);
	for (size_t p = 0; p < PATCHES; p++) {
		struct gnp_patch patch = take_patch(p, k, count, 1, scratch);
		start[p + 1] = start[p] + patch.buffer_count;
		inner[p] = patch.count > 0 ? patch.count : 1;
		for (size_t i = 0; i < patch.buffer_count; i++, node += 3) {
			node[0] = (float)patch.u[i];
			node[1] = (float)patch.v[i];
			node[2] = (float)(10 * patch.w[i]);
		}
	}
	struct gnp_network_batch batch = {PATCHES, start, inner, nodes};
	CHECK(gnp_pooled_forward(model->network, &batch, got, NULL, scratch, NULL) == GNP_OK);
	for (size_t i = 0; i < PATCHES * OUTPUTS; i++)
		coefficients[i] = (double)got[i];
	if (want) {
		check_close(name, "coefficients", coefficients, want, OUTPUTS, 1e-5);
		check_jets(name, legendre, coefficients, want);
	}
	gnp_scratch_free(scratch);
}

/* ---- The tests ---- */

static void check_formula(enum gnp_trunk_kind trunk, const char *name)
{
	struct gnp_architecture a = {.trunk = trunk, .head = GNP_HEAD_PROJECTION, .features = 5, .width = 12, .channels = 3, .neurons = 10,
		.layers = 3, .quadrature = 9, .head_width = 14, .outputs = ORDERS + 3, .shells = 3, .shell = {60, 120, 240}, .ridge = 2e-5};
	struct gnp_layout layout;
	struct gnp_network *network = NULL;
	if (trunk == GNP_TRUNK_NONE)
		a.features = a.width = a.channels = a.neurons = a.layers = a.quadrature = 0;
	CHECK(gnp_architecture_layout(&a, &layout, NULL) == GNP_OK);
	float *parameters = malloc(layout.total * sizeof *parameters);
	for (size_t r = 0; r < layout.rows; r++) {
		const struct gnp_parameter_row *row = &layout.row[r];
		double bound = row->rank == 2 ? 1.7 / sqrt((double)row->shape[1]) : 0.3;
		for (size_t i = 0; i < row->count; i++)
			parameters[row->offset + i] = strcmp(row->name, "head.mean") == 0        ? -4
			                              : strcmp(row->name, "head.deviation") == 0 ? 3
			                              : strcmp(row->name, "head.4.bias") == 0    ? -1
			                                                                         : (float)(bound * (2 * uniform(r, i) - 1));
	}
	CHECK(gnp_network_create(&a, parameters, &network, NULL) == GNP_OK);
	check_projection(name, network, 30);
	gnp_network_free(network);
	free(parameters);
}

static void networks_of_a_formula_give_what_is_frozen(void)
{
	check_formula(GNP_TRUNK_EDGE, "formula_edge");
	check_formula(GNP_TRUNK_SEPARABLE, "formula_separable");
	check_formula(GNP_TRUNK_NONE, "formula_none");
}

/* The frozen digest is that of the file. */
static bool digest_fits(const struct gnp_model *model)
{
	const double *want = doubles(model->name, "sha256", DIGEST);
	char text[2 * DIGEST + 1] = "";
	for (size_t i = 0; want && i < DIGEST; i++)
		snprintf(text + 2 * i, 3, "%02x", (unsigned)want[i]);
	if (want && strcmp(text, model->sha256) != 0) {
		test_failures++;
		fprintf(stderr, "%s: what is frozen is of another file; run python3 tests/oracles/oracle_projection.py weights\n", model->name);
	}
	return want && strcmp(text, model->sha256) == 0;
}

static void the_shipped_models_give_what_is_frozen(void)
{
	struct gnp_models *models = NULL;
	struct gnp_error error = {0};
	if (gnp_models_load("weights", &models, &error) != GNP_OK)
		fprintf(stderr, "%s\n", error.text);
	CHECK(error.status == GNP_OK);
	for (size_t i = 0; i < gnp_models_count(models); i++) {
		const struct gnp_model *model = gnp_models_at(models, i);
		if (model->architecture.head == GNP_HEAD_WEIGHTED || !digest_fits(model)) /* test_weighted_head has the first */
			continue;
		if (model->architecture.head == GNP_HEAD_PROJECTION)
			check_projection(model->name, model->network, model->recipe.k);
		else
			check_pooled(model->name, model);
	}
	gnp_models_release(models);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(networks_of_a_formula_give_what_is_frozen), TEST(the_shipped_models_give_what_is_frozen)};
	gnp_linalg_init();
	int failed = RUN_TESTS(tests);
	gnp_tensors_clear(&frozen.tensors);
	return failed;
}
