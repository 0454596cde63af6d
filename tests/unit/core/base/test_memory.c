/* What happens when memory is exhausted: each allocation of a run through memory.h fails once. The functions below stand in for
 * core/base/memory.c. Leaks show under SAN=address. */
#include "core/base/memory.h"

#include <stdatomic.h>
#include <stdint.h>
#include <unistd.h>

#include "core/cloud/isolated.h"
#include "core/cloud/thin.h"
#include "core/estimate/filter.h"
#include "core/flow/conformal.h"
#include "core/flow/flow.h"
#include "core/model/model.h"
#include "tests/unit/test.h"

static atomic_long asked; /* allocations so far */
static atomic_long doomed = -1;

bool gnp_size_multiply(size_t a, size_t b, size_t *product)
{
	return !__builtin_mul_overflow(a, b, product);
}

void *gnp_array_new(size_t count, size_t size)
{
	size_t bytes;
	if (atomic_fetch_add(&asked, 1) == atomic_load(&doomed) || !gnp_size_multiply(count, size, &bytes))
		return NULL;
	return malloc(bytes ? bytes : 1);
}

void *gnp_array_zero(size_t count, size_t size)
{
	if (atomic_fetch_add(&asked, 1) == atomic_load(&doomed))
		return NULL;
	return calloc(count ? count : 1, size ? size : 1);
}

enum { COUNT = 260 };
static struct gnp_pool *pool;
static double points[3 * COUNT], normals[3 * COUNT];

static void sphere(void)
{
	for (size_t i = 0; i < COUNT; i++) {
		double z = 1 - (2 * (double)i + 1) / COUNT, r = sqrt(1 - z * z), turn = 2.399963229728653 * (double)i;
		const double p[3] = {r * cos(turn), r * sin(turn), z};
		memcpy(normals + 3 * i, p, sizeof p);
		memcpy(points + 3 * i, p, sizeof p);
	}
}

/* Runs once to count, then once for each allocation; run returns whether its results are as before where it fails. */
static void fail_each(gnp_status (*run)(struct gnp_error *error, bool *unchanged))
{
	bool unchanged = true;
	atomic_store(&doomed, -1);
	atomic_store(&asked, 0);
	struct gnp_error first = {0};
	CHECK(run(&first, &unchanged) == GNP_OK);
	CHECK_STRING(first.text, "");
	long all = atomic_load(&asked);
	CHECK(all > 0);
	for (long n = 0; n < all; n++) {
		struct gnp_error error = {0};
		unchanged = true;
		atomic_store(&asked, 0);
		atomic_store(&doomed, n);
		gnp_status status = run(&error, &unchanged);
		if (status != GNP_OUT_OF_MEMORY || !unchanged)
			fprintf(stderr, "allocation %ld of %ld: %s, %s\n", n, all, gnp_status_name(status), error.text);
		CHECK(status == GNP_OUT_OF_MEMORY && error.status == status && unchanged);
		CHECK_CONTAINS(error.text, "memory");
	}
	atomic_store(&doomed, -1);
}

static gnp_status run_thin(struct gnp_error *error, bool *unchanged)
{
	unsigned char keep[COUNT];
	size_t kept;
	(void)unchanged;
	return gnp_thin(points, COUNT, 0.1, NULL, 0, NULL, keep, &kept, error);
}

static void thinning_fails_cleanly(void)
{
	sphere();
	fail_each(run_thin);
}

static struct gnp_filter_options filter_options;

static gnp_status run_filter(struct gnp_error *error, bool *unchanged)
{
	const struct gnp_cloud cloud = {COUNT, points, normals};
	struct gnp_filter filter = {0};
	gnp_status status = gnp_filter_run(&cloud, &filter_options, pool, NULL, &filter, error);
	*unchanged = status == GNP_OK || (!filter.keep && !filter.points);
	gnp_filter_clear(&filter);
	return status;
}

static void filtering_fails_cleanly(void)
{
	sphere();
	points[3 * 100] = 20;
	filter_options = gnp_filter_defaults();
	filter_options.project = true;
	filter_options.iterations = 2;
	filter_options.tolerance = 0;
	fail_each(run_filter);
}

static struct gnp_flow_options flow_options;

static gnp_status run_flow(struct gnp_error *error, bool *unchanged)
{
	const struct gnp_cloud cloud = {COUNT, points, normals};
	struct gnp_flow flow = {0};
	gnp_status status = gnp_flow_run(&cloud, NULL, &flow_options, pool, NULL, &flow, error);
	*unchanged = status == GNP_OK || (!flow.points && !flow.records);
	gnp_flow_clear(&flow);
	return status;
}

/* Turning normals to the side of those given went on without the room for what it turns. */
static void flows_fail_cleanly(void)
{
	sphere();
	for (size_t i = 0; i < 3 * COUNT; i++)
		normals[i] = -normals[i];
	for (size_t c = 0; c < 3; c++) { /* a doubled point is thinned; without three others there is a hole */
		points[3 * 40 + c] = points[3 * 41 + c];
		points[3 * 130 + c] = points[3 * 140 + c] = points[3 * 143 + c] = points[3 * 151 + c] = points[3 * 150 + c];
	}
	for (int scheme = GNP_FLOW_EXPLICIT; scheme <= GNP_FLOW_CONFORMAL; scheme++) {
		flow_options = gnp_flow_defaults();
		flow_options.scheme = scheme;
		flow_options.steps = 2;
		flow_options.singularity = 100;
		flow_options.snapshot_every = 1;
		flow_options.tangential = 0.2;
		flow_options.insertion = scheme == GNP_FLOW_EXPLICIT ? 0.25 : 0;
		fail_each(run_flow);
	}
}

static char model_path[] = "/tmp/gnp-test-XXXXXX.safetensors";

static gnp_status run_model(struct gnp_error *error, bool *unchanged)
{
	struct gnp_model *model = NULL;
	gnp_status status = gnp_model_load(model_path, &model, error);
	*unchanged = status == GNP_OK || !model;
	gnp_model_free(model);
	return status;
}

/* Without memory for the layout of a network its file was called wrong. */
static void models_fail_cleanly(void)
{
	const struct gnp_architecture edge = {.trunk = GNP_TRUNK_EDGE, .head = GNP_HEAD_POOLED, .features = 3, .width = 8, .channels = 2,
	                                      .neurons = 5, .layers = 2, .quadrature = 4, .head_width = 6, .outputs = 16};
	const struct gnp_recipe recipe = {.k = 30, .buffer = 1.25, .height_scale = 2, .delta0_ratio = 0.13};
	static struct gnp_layout layout;
	CHECK(gnp_architecture_layout(&edge, &layout, NULL) == GNP_OK);
	float *parameters = calloc(layout.total, sizeof *parameters);
	int fd = mkstemps(model_path, 12);
	CHECK(fd >= 0 && close(fd) == 0);
	CHECK(gnp_model_save(model_path, &(struct gnp_model_source){edge, recipe, "clean", NULL, 0, parameters}, NULL) == GNP_OK);
	fail_each(run_model);
	unlink(model_path);
	free(parameters);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(thinning_fails_cleanly), TEST(filtering_fails_cleanly), TEST(flows_fail_cleanly),
	                                    TEST(models_fail_cleanly)};
	CHECK(gnp_pool_create(2, &pool, NULL) == GNP_OK);
	int failed = RUN_TESTS(tests);
	gnp_pool_free(pool);
	return failed;
}
