/* What an estimate says of itself: nothing on surfaces that are smooth and sampled evenly, the reason where it is not to be believed. */
#include "core/base/random.h"
#include "core/estimate/estimate.h"
#include "core/linear/linalg.h"
#include "core/model/models.h"
#include "tests/oracles/manufactured.h"
#include "tests/unit/test.h"

static struct gnp_pool *pools[2]; /* of one and of two workers */
static struct gnp_models *models;

enum { MOST = 20000 };
static struct {
	size_t count;
	double points[3 * MOST], normals[3 * MOST];
} cloud;

static void add(double x, double y, double z, double u, double v, double w)
{
	double *p = cloud.points + 3 * cloud.count, *n = cloud.normals + 3 * cloud.count++;
	p[0] = x, p[1] = y, p[2] = z;
	n[0] = u, n[1] = v, n[2] = w;
}

static void add_sphere(size_t count, double radius)
{
	for (size_t i = 0; i < count; i++) {
		double z = 1 - (2 * (double)i + 1) / (double)count, r = sqrt(1 - z * z), turn = 2.39996323 * (double)i;
		add(radius * r * cos(turn), radius * r * sin(turn), radius * z, r * cos(turn), r * sin(turn), z);
	}
}

static void make_sphere(size_t count)
{
	cloud.count = 0;
	add_sphere(count, 1);
}

static void make_sample(const char *shape, size_t count, double noise)
{
	struct gnp_sample sample = sample_of(shape, &(struct gnp_sample_options){.count = count, .seed = 7, .noise = noise}, pools[1]);
	memcpy(cloud.points, sample.points, 3 * count * sizeof(double));
	memcpy(cloud.normals, sample.normals, 3 * count * sizeof(double));
	cloud.count = count;
	gnp_sample_clear(&sample);
}

/* Rows eight times as far apart as the points in a row. */
static void make_scan_lines(double noise)
{
	struct gnp_random random;
	gnp_random_seed(&random, 5, 0);
	cloud.count = 0;
	for (int row = 0; row < 12; row++) {
		double shift = gnp_random_uniform(&random) - 0.5;
		for (int i = 0; i < 60; i++)
			add(i + shift, 8 * row, noise * gnp_random_normal(&random), 0, 0, 1);
	}
}

static void make_cube(int side)
{
	cloud.count = 0;
	for (int face = 0; face < 6; face++)
		for (int i = 0; i < side; i++)
			for (int j = 0; j < side; j++) {
				double p[3], n[3] = {0, 0, 0};
				p[face / 2] = n[face / 2] = face % 2 ? 1 : -1;
				p[(face / 2 + 1) % 3] = (2 * i + 1.0) / side - 1;
				p[(face / 2 + 2) % 3] = (2 * j + 1.0) / side - 1;
				add(p[0], p[1], p[2], n[0], n[1], n[2]);
			}
}

static void make_waves(int side)
{
	cloud.count = 0;
	for (int i = 0; i < side; i++)
		for (int j = 0; j < side; j++)
			add(i, j, 1.5 * sin(0.8 * i) * cos(0.7 * j), 0, 0, 1);
}

static uint64_t more_quantities;

/* The warnings of an estimate, the same for one and for two workers. */
static struct gnp_warnings warnings_of(int estimator, const char *model, bool with_normals)
{
	struct gnp_estimate_options options = gnp_estimate_defaults();
	struct gnp_warnings found[2];
	options.estimator = estimator;
	options.models = models;
	options.quantities |= more_quantities;
	if (model)
		CHECK(gnp_models_find(models, model, &options.model, NULL) == GNP_OK);
	for (int w = 0; w < 2; w++) {
		const struct gnp_cloud input = {cloud.count, cloud.points, with_normals ? cloud.normals : NULL};
		struct gnp_estimate estimate;
		struct gnp_task task;
		struct gnp_error error = {0};
		gnp_task_init(&task);
		CHECK(gnp_estimate_run(&input, &options, pools[w], &task, &estimate, &error) == GNP_OK);
		CHECK_STRING(error.text, "");
		found[w] = task.warnings;
		gnp_estimate_clear(&estimate);
	}
	for (int kind = 0; kind < GNP_WARNING_KINDS; kind++)
		CHECK_STRING(found[0].text[kind], found[1].text[kind]);
	return found[0];
}

static void check_silent(const char *what, int estimator, bool with_normals)
{
	struct gnp_warnings warnings = warnings_of(estimator, NULL, with_normals);
	for (int kind = 0; kind < GNP_WARNING_KINDS; kind++)
		if (warnings.text[kind][0])
			fprintf(stderr, "%s by %d: %s\n", what, estimator, warnings.text[kind]);
	CHECK(gnp_warnings_count(&warnings) == 0);
}

static void check_warns(int estimator, const char *model, bool with_normals, enum gnp_warning_kind kind)
{
	struct gnp_warnings warnings = warnings_of(estimator, model, with_normals);
	if (!warnings.text[kind][0])
		fprintf(stderr, "no %s\n", gnp_warning_name(kind));
	CHECK(warnings.text[kind][0] != '\0');
}

/* By default models, without normals. */
static void check_lacks(int estimator, enum gnp_warning_kind kind)
{
	struct gnp_warnings warnings = warnings_of(estimator, NULL, false);
	CHECK_STRING(warnings.text[kind], "");
}

static void smooth_surfaces_warn_of_nothing(void)
{
	static const char *const shapes[] = {"sphere", "torus", "bumpy_torus", "genus2"};
	for (size_t s = 0; s < sizeof shapes / sizeof *shapes; s++)
		for (size_t count = 4000; count <= 12000; count *= 3) {
			make_sample(shapes[s], count, 0);
			for (int estimator = GNP_ESTIMATOR_GNP; estimator <= GNP_ESTIMATOR_ADAPTIVE; estimator++) {
				check_silent(shapes[s], estimator, false);
				check_silent(shapes[s], estimator, true);
			}
		}
	make_sphere(1000);
	check_silent("1,000 points", GNP_ESTIMATOR_GNP, false);
}

static void noise_that_is_modelled_warns_of_nothing(void)
{
	make_sample("torus", 10000, 1e-3);
	check_silent("noise", GNP_ESTIMATOR_GNP, false);
	check_silent("noise", GNP_ESTIMATOR_ADAPTIVE, false);
}

static void scan_lines_are_told(void)
{
	make_scan_lines(0.1);
	check_warns(GNP_ESTIMATOR_GNP, NULL, false, GNP_WARNING_ROWS);
	check_warns(GNP_ESTIMATOR_GNP, "fit_clean_30k", false, GNP_WARNING_NORMALS);
	check_lacks(GNP_ESTIMATOR_GNP, GNP_WARNING_NORMALS); /* its support reaches over as many rows as it takes */
	check_warns(GNP_ESTIMATOR_GNP, NULL, true, GNP_WARNING_ROWS);
	make_scan_lines(0);
	check_warns(GNP_ESTIMATOR_GMLS, NULL, false, GNP_WARNING_ROWS);
}

static void numbers_too_coarse_are_told(void)
{
	make_sphere(4000);
	for (size_t i = 0; i < 3 * cloud.count; i++)
		cloud.points[i] = (double)(float)(cloud.points[i] + (i % 3 == 1 ? 4651234. : 512345.));
	check_warns(GNP_ESTIMATOR_GNP, NULL, false, GNP_WARNING_PRECISION);
	make_sphere(4000);
	for (size_t i = 0; i < 3 * cloud.count; i++) /* as of a file of few digits: steps of 0.05, the points are 0.056 apart */
		cloud.points[i] = round(cloud.points[i] * 20) / 20;
	size_t kept = 0;
	for (size_t i = 0; i < cloud.count; i++) {
		bool known = false;
		for (size_t k = 0; k < kept && !known; k++)
			known = memcmp(cloud.points + 3 * k, cloud.points + 3 * i, 3 * sizeof(double)) == 0;
		if (!known)
			memmove(cloud.points + 3 * kept++, cloud.points + 3 * i, 3 * sizeof(double));
	}
	cloud.count = kept;
	check_warns(GNP_ESTIMATOR_GMLS, NULL, false, GNP_WARNING_PRECISION);
}

static void normals_that_contradict_the_points_are_told(void)
{
	struct gnp_random random;
	make_sphere(3000);
	for (size_t i = 0; i < cloud.count; i += 2)
		for (int c = 0; c < 3; c++)
			cloud.normals[3 * i + (size_t)c] *= -1;
	check_warns(GNP_ESTIMATOR_GNP, NULL, true, GNP_WARNING_GIVEN_NORMALS);
	gnp_random_seed(&random, 3, 0);
	for (size_t i = 0; i < 3 * cloud.count; i++)
		cloud.normals[i] = (double)gnp_random_below(&random, 256);
	check_warns(GNP_ESTIMATOR_GMLS, NULL, true, GNP_WARNING_GIVEN_NORMALS);
}

static void sheets_too_close_are_told(void)
{
	double spacing = sqrt(12.566370614359172 / 10000);
	make_sphere(10000);
	add_sphere(8200, 1 - 4 * spacing);
	check_warns(GNP_ESTIMATOR_GNP, NULL, false, GNP_WARNING_SHEETS);
}

static void too_few_points_for_the_curvature_are_told(void)
{
	make_sample("torus", 300, 0);
	check_warns(GNP_ESTIMATOR_GNP, NULL, false, GNP_WARNING_RESOLUTION);
}

static void detail_that_is_smoothed_away_is_told(void)
{
	make_waves(50);
	check_warns(GNP_ESTIMATOR_GNP, "fit_noise_70k", false, GNP_WARNING_DETAIL);
	check_lacks(GNP_ESTIMATOR_ADAPTIVE, GNP_WARNING_DETAIL); /* which the warning recommends */
	make_cube(30);
	check_lacks(GNP_ESTIMATOR_GNP, GNP_WARNING_DETAIL); /* it knows edges */
	check_warns(GNP_ESTIMATOR_GMLS, NULL, false, GNP_WARNING_DETAIL);
}

static void standard_errors_under_noise_are_told(void)
{
	more_quantities = GNP_QUANTITY_BIT(GNP_MEAN_CURVATURE_STDERR);
	make_sample("sphere", 5000, 1e-3);
	check_warns(GNP_ESTIMATOR_ADAPTIVE, NULL, false, GNP_WARNING_STDERR);
	make_sample("sphere", 5000, 0);
	check_silent("standard errors", GNP_ESTIMATOR_ADAPTIVE, false);
	make_sample("sphere", 5000, 1e-3);
	check_lacks(GNP_ESTIMATOR_GNP, GNP_WARNING_STDERR); /* its standard errors know of bias */
	more_quantities = 0;
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(smooth_surfaces_warn_of_nothing), TEST(noise_that_is_modelled_warns_of_nothing), TEST(scan_lines_are_told),
	                                    TEST(numbers_too_coarse_are_told), TEST(normals_that_contradict_the_points_are_told),
	                                    TEST(sheets_too_close_are_told), TEST(too_few_points_for_the_curvature_are_told),
	                                    TEST(detail_that_is_smoothed_away_is_told), TEST(standard_errors_under_noise_are_told)};
	gnp_linalg_init();
	if (gnp_models_load("weights", &models, NULL) != GNP_OK || gnp_pool_create(1, &pools[0], NULL) != GNP_OK || gnp_pool_create(2, &pools[1], NULL) != GNP_OK)
		return 1;
	int status = RUN_TESTS(tests);
	gnp_pool_free(pools[0]);
	gnp_pool_free(pools[1]);
	gnp_models_release(models);
	return status;
}
