#include "core/geodesic/geodesic.h"
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
		CHECK_AT_MOST(error, 0.003 * mean);
		CHECK_AT_MOST(worst, 0.03);
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

/* The distance of each pair is that from either of its points; the side of fewer points is taken, whichever it is. */
static void pairs_have_the_distance_from_one_of_them(void)
{
	enum { N = 4000, PAIRS = 60 };
	struct gnp_sample sample = sample_of("torus", &(struct gnp_sample_options){.count = N, .seed = 7}, pool);
	struct gnp_cloud cloud = {N, sample.points, sample.normals};
	struct gnp_geodesic *geodesic = create(&cloud);
	double *distance = malloc(N * sizeof *distance), got[2][PAIRS];
	uint32_t pairs[PAIRS][2], turned[PAIRS][2];
	for (uint32_t p = 0; p < PAIRS; p++) {
		pairs[p][0] = turned[p][1] = p % 3 * 1000;
		pairs[p][1] = turned[p][0] = p * 61 % N;
	}
	CHECK(gnp_geodesic_pairs(geodesic, (const uint32_t(*)[2])pairs, PAIRS, pool, NULL, got[0], NULL) == GNP_OK);
	CHECK(gnp_geodesic_pairs(geodesic, (const uint32_t(*)[2])turned, PAIRS, pool, NULL, got[1], NULL) == GNP_OK);
	for (uint32_t source = 0; source < 3; source++) {
		CHECK(gnp_geodesic_distance(geodesic, &(uint32_t){source * 1000}, 1, pool, NULL, distance, NULL) == GNP_OK);
		for (uint32_t p = source; p < PAIRS; p += 3)
			CHECK(got[0][p] == distance[pairs[p][1]] && got[1][p] == got[0][p]);
	}
	CHECK(got[0][0] == 0 && gnp_geodesic_pairs(geodesic, NULL, 0, pool, NULL, got[0], NULL) == GNP_OK);
	struct gnp_error error = {0};
	pairs[5][1] = N;
	CHECK(gnp_geodesic_pairs(geodesic, (const uint32_t(*)[2])pairs, PAIRS, pool, NULL, got[0],
	                         &error) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "pairs[5]: got point 4000, the cloud has 4000");
	gnp_geodesic_free(geodesic);
	gnp_sample_clear(&sample);
	free(distance);
}

/* On a sphere the log of a point is its great circle's direction and length; a vector keeps its angle with that
 * circle. */
static void the_log_map_is_as_long_as_the_way(void)
{
	enum { N = 5000, SOURCE = 40 };
	struct gnp_sample sample = sample_of("sphere", &(struct gnp_sample_options){.count = N, .seed = 7}, pool);
	struct gnp_cloud cloud = {N, sample.points, sample.normals};
	struct gnp_geodesic *geodesic = create(&cloud);
	double *distance = malloc(9 * N * sizeof *distance), *log = distance + N;
	double *vectors = log + 2 * N, *parallel = vectors + 3 * N;
	double basis[2][3], off[2] = {0};
	const double *o = sample.points + 3 * SOURCE;
	CHECK(gnp_geodesic_distance(geodesic, &(uint32_t){SOURCE}, 1, pool, NULL, distance, NULL) == GNP_OK);
	CHECK(gnp_geodesic_log(geodesic, SOURCE, pool, NULL, log, basis, NULL) == GNP_OK);
	for (size_t c = 0; c < 3 * N; c++)
		vectors[c] = c / 3 == SOURCE ? 2 * basis[0][c % 3] + 5 * o[c % 3] : NAN; /* whose normal part is dropped */
	CHECK(gnp_geodesic_parallel(geodesic, &(uint32_t){SOURCE}, 1, vectors, NULL, parallel, NULL) == GNP_OK);
	for (size_t i = 0; i < N; i++) {
		const double *p = sample.points + 3 * i, *v = parallel + 3 * i, angle = angle_between(o, p);
		double on[3];
		CHECK_NEAR(hypot(log[2 * i], log[2 * i + 1]), distance[i], 1e-9);
		CHECK_NEAR(sqrt(gnp_dot(v, v)), 2, 1e-3);
		if (i == SOURCE || angle > 2.8)
			continue;
		double want = atan2(gnp_dot(p, basis[1]), gnp_dot(p, basis[0]));
		off[0] += fabs(remainder(atan2(log[2 * i + 1], log[2 * i]) - want, 6.283185307179586)) / N;
		for (int c = 0; c < 3; c++)
			on[c] = (p[c] * cos(angle) - o[c]) / sin(angle);
		off[1] += fabs(gnp_dot(on, v) / 2 - cos(want)) / N;
	}
	CHECK_AT_MOST(off[0], 0.004);
	CHECK_AT_MOST(off[1], 0.004);
	gnp_geodesic_free(geodesic);
	gnp_sample_clear(&sample);
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
	                                    TEST(pairs_have_the_distance_from_one_of_them),
	                                    TEST(the_log_map_is_as_long_as_the_way),
	                                    TEST(sources_that_are_none_are_refused)};
	gnp_linalg_init();
	if (gnp_pool_create(0, &pool, NULL) != GNP_OK)
		return 1;
	int status = RUN_TESTS(tests);
	gnp_pool_free(pool);
	return status;
}
