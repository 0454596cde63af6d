#include "core/equations/geodesic.h"
#include "core/linear/linalg.h"
#include "tests/oracles/manufactured.h"
#include "tests/unit/test.h"

static struct gnp_pool *pool;

static struct gnp_geodesic *create(const struct gnp_cloud *cloud)
{
	struct gnp_domain_options options = {.estimate = gnp_estimate_defaults()};
	struct gnp_geodesic *geodesic = NULL;
	CHECK(gnp_geodesic_create(cloud, &options, pool, NULL, &geodesic, NULL) == GNP_OK);
	return geodesic;
}

static double angle_between(const double *a, const double *b)
{
	return acos(fmin(1, fmax(-1, gnp_dot(a, b))));
}

/* Great circles, to the nearest of the sources. */
static void distances_on_a_sphere_are_great_circles(void)
{
	enum { N = 10000 };
	static const uint32_t sources[] = {17, 4000, 9000};
	struct gnp_sample sample = sample_of("sphere", &(struct gnp_sample_options){.count = N, .seed = 7}, pool);
	struct gnp_cloud cloud = {N, sample.points, sample.normals};
	struct gnp_geodesic *geodesic = create(&cloud);
	double *distance = malloc(N * sizeof *distance);
	for (size_t count = 1; count <= 3; count += 2) {
		CHECK(gnp_geodesic_distance(geodesic, sources, count, pool, NULL, distance, NULL) == GNP_OK);
		double worst = 0, error = 0, mean = 0;
		for (size_t i = 0; i < N; i++) {
			double want = INFINITY;
			for (size_t s = 0; s < count; s++)
				want = fmin(want, angle_between(sample.points + 3 * i, sample.points + 3 * sources[s]));
			mean += want / N;
			error += fabs(distance[i] - want) / N;
			worst = fmax(worst, fabs(distance[i] - want));
		}
		/* where the fronts of two sources meet, the gradient turns and the mean of a cell is felt */
		CHECK_AT_MOST(error, (count == 1 ? 0.01 : 0.015) * mean);
		CHECK_AT_MOST(worst, count == 1 ? 0.05 : 0.06);
		for (size_t s = 0; s < count; s++)
			CHECK(distance[sources[s]] == 0);
	}
	CHECK(gnp_geodesic_bytes(geodesic) > N * 100);
	gnp_geodesic_free(geodesic);
	gnp_sample_clear(&sample);
	free(distance);
}

static void parts_without_a_source_are_out_of_reach(void)
{
	enum { N = 2000 };
	static const uint32_t source = 3;
	struct gnp_sample sample = sample_of("sphere", &(struct gnp_sample_options){.count = N, .seed = 7}, pool);
	double *points = malloc(12 * N * sizeof *points), *normals = points + 6 * N, *distance = malloc(2 * N * sizeof *distance);
	for (size_t i = 0; i < 6 * N; i++) {
		points[i] = sample.points[i % (3 * N)] + (i >= 3 * N && i % 3 == 0 ? 10 : 0);
		normals[i] = sample.normals[i % (3 * N)];
	}
	struct gnp_cloud cloud = {2 * N, points, normals};
	struct gnp_geodesic *geodesic = create(&cloud);
	CHECK(gnp_geodesic_distance(geodesic, &source, 1, pool, NULL, distance, NULL) == GNP_OK);
	for (size_t i = 0; i < N; i++)
		CHECK(distance[i] <= 3.3 && isinf(distance[N + i]));
	gnp_geodesic_free(geodesic);
	gnp_sample_clear(&sample);
	free(points);
	free(distance);
}

static void sources_that_are_none_are_refused(void)
{
	static const uint32_t sources[] = {1, 500};
	struct gnp_sample sample = sample_of("sphere", &(struct gnp_sample_options){.count = 500, .seed = 7}, pool);
	struct gnp_cloud cloud = {500, sample.points, sample.normals};
	struct gnp_geodesic *geodesic = create(&cloud);
	double distance[500];
	struct gnp_error error = {0}, none = {0};
	CHECK(gnp_geodesic_distance(geodesic, sources, 2, pool, NULL, distance, &error) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "sources[1]: got point 500, the cloud has 500");
	CHECK(gnp_geodesic_distance(geodesic, sources, 0, pool, NULL, distance, &none) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(none.text, "sources: got none, need at least 1");
	gnp_geodesic_free(geodesic);
	gnp_sample_clear(&sample);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(distances_on_a_sphere_are_great_circles), TEST(parts_without_a_source_are_out_of_reach),
	                                    TEST(sources_that_are_none_are_refused)};
	gnp_linalg_init();
	if (gnp_pool_create(0, &pool, NULL) != GNP_OK)
		return 1;
	int status = RUN_TESTS(tests);
	gnp_pool_free(pool);
	return status;
}
