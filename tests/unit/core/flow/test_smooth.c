/* Smoothing: noise goes, the surface, its volume and its open edges stay, and edges where that is asked for. */
#include <math.h>

#include "core/base/random.h"
#include "core/flow/smooth.h"
#include "core/linear/linalg.h"
#include "core/model/models.h"
#include "core/shapes/shapes.h"
#include "tests/laws/flow_laws.h"
#include "tests/unit/test.h"

static struct gnp_pool *pool;
static struct gnp_models *models;

/* ---- Clouds ---- */

static struct cloud sphere(size_t count, double noise)
{
	struct gnp_shape *shape;
	struct gnp_sample sample;
	struct cloud cloud = cloud_new(count);
	CHECK(gnp_shape_create("sphere", 1, 0, &shape, NULL) == GNP_OK);
	const struct gnp_sample_options options = {.count = count, .seed = 3, .noise = noise};
	CHECK(gnp_sample_create(shape, &options, pool, NULL, &sample, NULL) == GNP_OK);
	memcpy(cloud.points, sample.points, 3 * count * sizeof(double));
	memcpy(cloud.normals, sample.normals, 3 * count * sizeof(double));
	gnp_sample_clear(&sample);
	gnp_shape_free(shape);
	return cloud;
}

/* Two half planes whose normals are 60 degrees apart and that meet in the line x = z = 0. */
static struct cloud roof(size_t side, double noise)
{
	struct gnp_random random;
	struct cloud cloud = cloud_new(2 * side * side);
	gnp_random_seed(&random, 5, 0);
	for (size_t i = 0; i < cloud.count; i++) {
		size_t half = i / (side * side), at = i % (side * side);
		double along = ((double)(at % side) + 0.5) / (double)side, turn = half ? 1 : -1, *p = cloud.points + 3 * i;
		p[0] = turn * along * sqrt(0.75);
		p[1] = (double)(at / side) / (double)side;
		p[2] = -along / 2;
		for (int c = 0; c < 3; c++)
			p[c] += noise * gnp_random_normal(&random);
		cloud.normals[3 * i] = turn / 2;
		cloud.normals[3 * i + 2] = sqrt(0.75);
	}
	return cloud;
}

static struct gnp_smooth smoothed(const struct cloud *cloud, const struct gnp_smooth_options *options)
{
	struct gnp_smooth smooth = {0};
	struct gnp_error error = {0};
	const struct gnp_cloud c = {cloud->count, cloud->points, cloud->normals};
	if (gnp_smooth_run(&c, cloud->fixed, options, pool, NULL, &smooth, &error) != GNP_OK)
		CHECK_STRING(error.text, "");
	CHECK(smooth.count == cloud->count);
	return smooth;
}

/* Root mean square of radii less 1, and their mean cubed. */
static double off_sphere(const double *points, size_t count, double *volume)
{
	double sum = 0;
	*volume = 0;
	for (size_t i = 0; i < count; i++) {
		double radius = sqrt(gnp_dot(points + 3 * i, points + 3 * i));
		sum += pow(radius - 1, 2) / (double)count;
		*volume += pow(radius, 3) / (double)count;
	}
	return sqrt(sum);
}

/* Mean height of the points nearest to the ridge. */
static double ridge(const double *points, size_t count)
{
	double sum = 0, within = 0;
	for (size_t i = 0; i < count; i++)
		if (fabs(points[3 * i]) < 0.02 && fabs(points[3 * i + 1] - 0.5) < 0.4) {
			sum += points[3 * i + 2];
			within++;
		}
	CHECK(within > 0);
	return sum / within;
}

static struct gnp_smooth_options any(void)
{
	struct gnp_smooth_options options = gnp_smooth_defaults();
	options.estimate.estimator = GNP_ESTIMATOR_GNP;
	options.estimate.models = models;
	return options;
}

/* ---- Cases ---- */

static void noise_goes_and_the_volume_stays(void)
{
	struct cloud cloud = sphere(3000, 0.02);
	struct gnp_smooth_options options = any();
	double before, after;
	double rough = off_sphere(cloud.points, cloud.count, &before);
	struct gnp_smooth smooth = smoothed(&cloud, &options);
	CHECK_AT_MOST(off_sphere(smooth.points, smooth.count, &after), rough / 2.5);
	CHECK_NEAR(after, before, 0.003);
	CHECK_NEAR(smooth.noise, 0.02, 0.008);
	CHECK_NEAR(smooth.radius, sqrt(2 * smooth.noise * smooth.spacing), 1e-12);
	options.preserve = false;
	struct gnp_smooth shrunk = smoothed(&cloud, &options);
	off_sphere(shrunk.points, shrunk.count, &before);
	CHECK(before < after);
	gnp_smooth_clear(&shrunk);
	gnp_smooth_clear(&smooth);
	cloud_free(&cloud);
}

static void a_clean_cloud_is_left_alone(void)
{
	struct cloud cloud = sphere(2000, 0);
	const struct gnp_smooth_options options = any();
	double volume;
	struct gnp_smooth smooth = smoothed(&cloud, &options);
	CHECK_AT_MOST(off_sphere(smooth.points, smooth.count, &volume), 1e-3);
	gnp_smooth_clear(&smooth);
	cloud_free(&cloud);
}

/* Detail that is larger than the noise that was given stays, and so do points that are held. */
static void no_point_goes_farther_than_the_noise(void)
{
	struct cloud cloud = sphere(2000, 0.02);
	struct gnp_smooth_options options = any();
	options.noise = 0.001;
	for (size_t i = 0; i < 100; i++)
		cloud.fixed[i] = 1;
	struct gnp_smooth smooth = smoothed(&cloud, &options);
	double most = 0;
	for (size_t i = 0; i < smooth.count; i++)
		most = fmax(most, fabs(smooth.moved[i]));
	CHECK(most > 0.003 && most <= 4.001 * options.noise);
	CHECK(memcmp(smooth.points, cloud.points, 300 * sizeof(double)) == 0);
	CHECK(smooth.noise == options.noise);
	gnp_smooth_clear(&smooth);
	cloud_free(&cloud);
}

static void edges_are_kept_on_request(void)
{
	struct cloud cloud = roof(40, 0.004);
	struct gnp_smooth_options options = any();
	options.noise = 0.05;
	options.preserve = false;
	struct gnp_smooth round = smoothed(&cloud, &options);
	options.features = GNP_SMOOTH_KEEP;
	struct gnp_smooth kept = smoothed(&cloud, &options);
	CHECK_AT_MOST(ridge(round.points, round.count), ridge(kept.points, kept.count) - 0.005);
	for (size_t i = 0; i < round.count; i++)
		CHECK(round.points[3 * i + 1] > -0.03 && round.points[3 * i + 1] < 1.03);
	gnp_smooth_clear(&round);
	gnp_smooth_clear(&kept);
	cloud_free(&cloud);
}

static void bytes_do_not_depend_on_workers(void)
{
	struct cloud cloud = sphere(1500, 0.02);
	const struct gnp_smooth_options options = any();
	struct gnp_pool *all = pool, *one;
	struct gnp_smooth a = smoothed(&cloud, &options);
	CHECK(gnp_pool_create(1, &one, NULL) == GNP_OK);
	pool = one;
	struct gnp_smooth b = smoothed(&cloud, &options);
	pool = all;
	CHECK(memcmp(a.points, b.points, 3 * a.count * sizeof(double)) == 0);
	CHECK(memcmp(a.normals, b.normals, 3 * a.count * sizeof(double)) == 0);
	gnp_pool_free(one);
	gnp_smooth_clear(&a);
	gnp_smooth_clear(&b);
	cloud_free(&cloud);
}

static void bad_options_are_refused_with_the_limit(void)
{
	struct cloud cloud = sphere(20, 0);
	struct gnp_smooth_options options = gnp_smooth_defaults();
	const struct gnp_cloud c = {cloud.count, cloud.points, cloud.normals};
	struct gnp_smooth none;
	struct gnp_error few = {0}, negative = {0}, rounds = {0}, unknown = {0};
	CHECK(gnp_smooth_run(&c, NULL, &options, pool, NULL, &none, &few) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(few.text, "points: got 20, need at least 30");
	options.noise = -1;
	CHECK(gnp_smooth_run(&c, NULL, &options, pool, NULL, &none, &negative) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(negative.text, "noise: got -1, need a number above 0");
	options.noise = NAN;
	options.rounds = 21;
	CHECK(gnp_smooth_run(&c, NULL, &options, pool, NULL, &none, &rounds) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(rounds.text, "rounds: got 21, need 1..20");
	options.rounds = 1;
	options.features = 2;
	CHECK(gnp_smooth_run(&c, NULL, &options, pool, NULL, &none, &unknown) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(unknown.text, "features: got 2, need 0..1");
	cloud_free(&cloud);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(noise_goes_and_the_volume_stays), TEST(a_clean_cloud_is_left_alone),
		TEST(no_point_goes_farther_than_the_noise),
		TEST(edges_are_kept_on_request), TEST(bytes_do_not_depend_on_workers),
		TEST(bad_options_are_refused_with_the_limit)};
	gnp_linalg_init();
	CHECK(gnp_pool_create(2, &pool, NULL) == GNP_OK);
	CHECK(gnp_models_load("weights", &models, NULL) == GNP_OK);
	int failed = RUN_TESTS(tests);
	gnp_models_release(models);
	gnp_pool_free(pool);
	return failed;
}
