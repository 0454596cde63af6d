/* Our GMLS against an independent implementation: tests/oracles/oracle_gmls.py made the cloud and the answers in tests/data. */
#include "tests/unit/test.h"

#include "core/estimate/estimate.h"
#include "proto/file/file.h"

static struct gnp_tensors frozen;
static unsigned char body[65536]; /* what frozen may borrow from */

static void load(void)
{
	FILE *file = fopen("tests/oracles/data/gmls_parity.npz", "rb"); /* tests run in the repository's root */
	CHECK(file != NULL);
	if (!file)
		return;
	size_t size = fread(body, 1, sizeof body, file);
	fclose(file);
	CHECK(size < sizeof body);
	CHECK(gnp_file_decode_all(&gnp_format_npz, body, size, &frozen, NULL) == GNP_OK);
}

static const double *doubles(const char *name, size_t count)
{
	const struct gnp_tensor *tensor = gnp_tensors_find(&frozen, name);
	bool good = tensor && tensor->datatype == GNP_FP64 && tensor->size == count * sizeof(double);
	CHECK(good);
	return good ? tensor->data : NULL;
}

/* The largest difference, as a ratio to the largest of what is wanted. */
static void compare(const struct gnp_estimate *estimate, enum gnp_quantity quantity, const char *name)
{
	size_t count = estimate->count * gnp_quantity_info(quantity)->width;
	const double *got = estimate->values[quantity], *want = doubles(name, count);
	double difference = 0, largest = 0;
	for (size_t i = 0; got && want && i < count; i++) {
		difference = fmax(difference, fabs(got[i] - want[i]));
		largest = fmax(largest, fabs(want[i]));
		CHECK(isfinite(got[i]));
	}
	if (!(difference <= 1e-8 * largest))
		fprintf(stderr, "%s:\n", name);
	CHECK_AT_MOST(difference / largest, 1e-8);
}

static void every_point_agrees_with_the_oracle(void)
{
	load();
	const struct gnp_tensor *points = gnp_tensors_find(&frozen, "points");
	size_t count = points ? points->shape[0] : 0;
	CHECK(count == 400);
	struct gnp_cloud cloud = {count, doubles("points", 3 * count), doubles("normals", 3 * count)};
	struct gnp_estimate_options options = gnp_estimate_defaults();
	options.cover = GNP_COVER_ALL;
	options.quantities = GNP_QUANTITY_BIT(GNP_POINTS) | GNP_QUANTITY_BIT(GNP_NORMALS) |
	                     GNP_QUANTITY_BIT(GNP_GAUSSIAN_CURVATURE) | GNP_QUANTITY_BIT(GNP_MEAN_CURVATURE) |
	                     GNP_QUANTITY_BIT(GNP_METRIC_DETERMINANT) | GNP_QUANTITY_BIT(GNP_RESIDUAL);
	struct gnp_estimate estimate = {0};
	struct gnp_pool *pool = NULL;
	CHECK(gnp_pool_create(2, &pool, NULL) == GNP_OK);
	CHECK(cloud.points && cloud.normals && gnp_estimate_run(&cloud, &options, pool, NULL, &estimate, NULL) == GNP_OK);
	CHECK(estimate.count == count && estimate.degenerate == 0);
	compare(&estimate, GNP_POINTS, "expected_points");
	compare(&estimate, GNP_NORMALS, "expected_normals");
	compare(&estimate, GNP_GAUSSIAN_CURVATURE, "gaussian_curvature");
	compare(&estimate, GNP_MEAN_CURVATURE, "mean_curvature");
	compare(&estimate, GNP_METRIC_DETERMINANT, "metric_determinant");
	compare(&estimate, GNP_RESIDUAL, "residual");
	gnp_estimate_clear(&estimate);
	gnp_pool_free(pool);
	gnp_tensors_clear(&frozen);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(every_point_agrees_with_the_oracle)};
	return RUN_TESTS(tests);
}
