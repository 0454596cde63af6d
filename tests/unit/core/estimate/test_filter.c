/* Filtering outliers off analytic clouds whose outliers are known. */
#include "core/base/random.h"
#include "core/base/vector.h"
#include "core/estimate/filter.h"
#include "core/linear/linalg.h"
#include "core/model/models.h"
#include "core/shapes/shapes.h"
#include "tests/unit/test.h"

static struct gnp_pool *pool;
static struct gnp_models *models;

static struct gnp_sample sampled(const char *name, const struct gnp_sample_options *options)
{
	struct gnp_shape *shape;
	struct gnp_sample sample;
	CHECK(gnp_shape_create(name, 11, 6, &shape, NULL) == GNP_OK);
	CHECK(gnp_sample_create(shape, options, pool, NULL, &sample, NULL) == GNP_OK);
	gnp_shape_free(shape);
	return sample;
}

static struct gnp_filter_options gnp_with(const char *weights)
{
	struct gnp_filter_options options = gnp_filter_defaults();
	options.estimate.estimator = GNP_ESTIMATOR_GNP;
	options.estimate.models = models;
	CHECK(gnp_models_find(models, weights, &options.estimate.model, NULL) == GNP_OK);
	return options;
}

static struct gnp_filter filtered(const struct gnp_sample *sample, const struct gnp_filter_options *options)
{
	const struct gnp_cloud cloud = {sample->count, sample->points, sample->normals};
	struct gnp_filter filter = {0};
	struct gnp_error error = {0};
	if (gnp_filter_run(&cloud, options, pool, NULL, &filter, &error) != GNP_OK) {
		CHECK_STRING(error.text, "");
		filter = (struct gnp_filter){0};
	}
	return filter;
}

static void check_refused(const struct gnp_sample *sample, const struct gnp_filter_options *options, gnp_status status, const char *text)
{
	const struct gnp_cloud cloud = {sample->count, sample->points, sample->normals};
	struct gnp_filter filter = {0};
	struct gnp_error error = {0};
	CHECK(gnp_filter_run(&cloud, options, pool, NULL, &filter, &error) == status);
	CHECK_CONTAINS(error.text, text);
	CHECK(filter.keep == NULL);
}

static double off_surface(const struct gnp_sample *sample, const double *point, size_t i)
{
	const double *q = sample->exact + 3 * i, d[3] = {point[0] - q[0], point[1] - q[1], point[2] - q[2]};
	return fabs(gnp_dot(d, sample->normals + 3 * i));
}

/* ---- The rule ---- */

/* A share of outliers is displaced along the normal by more than `noise`: of those, how many were found; and how many good points. */
static void check_found(const struct gnp_sample *sample, const struct gnp_filter *filter, double noise)
{
	size_t outliers = 0, found = 0, good = 0, alarms = 0;
	for (size_t i = 0; i < sample->count; i++) {
		if (!sample->outlier[i]) {
			good++;
			alarms += !filter->keep[i];
		} else if (off_surface(sample, sample->points + 3 * i, i) > noise) {
			outliers++;
			found += !filter->keep[i];
		}
	}
	CHECK(outliers > 500);
	CHECK(found >= 0.97 * (double)outliers);
	CHECK(alarms <= 0.02 * (double)good);
}

static void check_consistent(const struct gnp_sample *sample, const struct gnp_filter *filter)
{
	size_t kept = 0;
	for (size_t i = 0; i < sample->count; i++) {
		CHECK(isfinite(filter->deviation[i]) && filter->deviation[i] >= 0);
		if (filter->keep[i]) {
			CHECK(kept < filter->kept && filter->index[kept] == i);
			kept++;
		}
	}
	CHECK(kept == filter->kept && filter->count == sample->count);
	CHECK(filter->dropped_gross + filter->dropped_deviation + filter->dropped_consensus == sample->count - kept);
}

/* Relative L2 errors of H and K of plain least squares at the good points. index NULL: the points are the sample's. */
static void curvature_errors(const struct gnp_sample *sample, const struct gnp_cloud *cloud, const uint32_t *index, double errors[2])
{
	struct gnp_estimate_options options = gnp_estimate_defaults();
	struct gnp_estimate found;
	double sums[4] = {0};
	CHECK(gnp_estimate_run(cloud, &options, pool, NULL, &found, NULL) == GNP_OK);
	for (size_t i = 0; i < cloud->count; i++) {
		size_t at = index ? index[i] : i;
		double h = sample->mean_curvature[at], k = sample->gaussian_curvature[at];
		if (sample->outlier[at])
			continue;
		sums[0] += pow(found.values[GNP_MEAN_CURVATURE][i] - h, 2);
		sums[1] += h * h;
		sums[2] += pow(found.values[GNP_GAUSSIAN_CURVATURE][i] - k, 2);
		sums[3] += k * k;
	}
	errors[0] = sqrt(sums[0] / sums[1]);
	errors[1] = sqrt(sums[2] / sums[3]);
	gnp_estimate_clear(&found);
}

static void outliers_are_found_and_least_squares_gain(void)
{
	static const char *const families[] = {"radial", "torus"};
	for (size_t f = 0; f < 2; f++) {
		/* 12,000 points: as far in spacings as 5e-3 is at 100,000 */
		struct gnp_sample sample = sampled(families[f], &(struct gnp_sample_options){.count = 12000, .seed = 3, .outlier_fraction = 0.1, .outlier_noise = 0.015});
		struct gnp_filter_options options = gnp_with("fit_outlier_50k");
		struct gnp_filter filter = filtered(&sample, &options);
		double before[2], after[2];
		check_consistent(&sample, &filter);
		check_found(&sample, &filter, 3e-4); /* three times what the surface bends away from fits */
		curvature_errors(&sample, &(struct gnp_cloud){sample.count, sample.points, sample.normals}, NULL, before);
		curvature_errors(&sample, &(struct gnp_cloud){filter.kept, filter.points, filter.normals}, filter.index, after);
		CHECK_AT_MOST(after[0], before[0] / 5);
		CHECK_AT_MOST(after[1], before[1] / 5);
		gnp_filter_clear(&filter);
		gnp_sample_clear(&sample);
	}
}

/* Without consensus the deviation alone decides. */
static void alpha_is_the_papers_rule(void)
{
	struct gnp_sample sample = sampled("radial", &(struct gnp_sample_options){.count = 6000, .seed = 3, .outlier_fraction = 0.1, .outlier_noise = 0.02});
	struct gnp_filter_options options = gnp_with("fit_outlier_50k");
	options.consensus = false;
	options.gross = 0;
	size_t before = 0;
	for (double alpha = 0.4; alpha > 0.02; alpha /= 2) {
		options.alpha = alpha;
		struct gnp_filter filter = filtered(&sample, &options);
		for (size_t i = 0; i < sample.count; i++)
			CHECK(filter.keep[i] == (filter.deviation[i] <= alpha));
		CHECK(filter.dropped_consensus == 0 && filter.dropped_gross == 0 && filter.dropped_deviation > before);
		before = filter.dropped_deviation;
		gnp_filter_clear(&filter);
	}
	gnp_sample_clear(&sample);
}

static void every_estimator_filters(void)
{
	struct gnp_sample sample = sampled("torus", &(struct gnp_sample_options){.count = 12000, .seed = 3, .outlier_fraction = 0.1, .outlier_noise = 0.015});
	struct gnp_filter_options options = gnp_filter_defaults();
	options.estimate.k = 50;
	options.estimate.estimator = GNP_ESTIMATOR_ADAPTIVE;
	struct gnp_filter filter = filtered(&sample, &options);
	check_found(&sample, &filter, 3e-4);
	CHECK(filter.dropped_consensus > 0);
	gnp_filter_clear(&filter);
	options.estimate.estimator = GNP_ESTIMATOR_GMLS;
	options.alpha = 0.1;
	filter = filtered(&sample, &options); /* outliers pull its fits, so that good points deviate too; consensus finds the rest */
	check_consistent(&sample, &filter);
	CHECK(filter.dropped_consensus > 0 && filter.dropped_deviation > 800);
	for (size_t i = 0; i < sample.count; i++)
		CHECK(!filter.keep[i] || off_surface(&sample, sample.points + 3 * i, i) < 0.005);
	gnp_filter_clear(&filter);
	gnp_sample_clear(&sample);
}

static void clean_clouds_are_kept_whole(void)
{
	struct gnp_sample sample = sampled("torus", &(struct gnp_sample_options){.count = 8000, .seed = 3});
	struct gnp_filter_options options = gnp_with("fit_outlier_50k");
	struct gnp_filter filter = filtered(&sample, &options);
	CHECK(filter.kept == sample.count);
	CHECK(memcmp(filter.points, sample.points, 3 * sample.count * sizeof(double)) == 0);
	CHECK(!filter.normals_estimated && filter.iterations == 0 && filter.stop == GNP_FILTER_NOT_PROJECTED);
	gnp_filter_clear(&filter);
	gnp_sample_clear(&sample);
}

/* ---- Gross outliers and clusters ---- */

/* Far points, one by one and in a cluster of 30, are dropped with the pre-filter; without it they fit surfaces of their own. */
static void far_points_and_clusters_are_dropped(void)
{
	struct gnp_sample sample = sampled("torus", &(struct gnp_sample_options){.count = 8000, .seed = 3});
	struct gnp_filter_options options = gnp_with("fit_outlier_50k");
	struct gnp_random random;
	gnp_random_seed(&random, 9, 0);
	for (size_t i = 0; i < 60; i++) { /* 0..29: singles on all sides; 30..59: a cluster at (0, 0, 1) */
		size_t at = 131 * i;
		sample.outlier[at] = 1;
		for (size_t c = 0; c < 3; c++)
			sample.points[3 * at + c] = i < 30 ? 4 * gnp_random_normal(&random) + 4 : (c == 2) + 0.02 * gnp_random_normal(&random);
	}
	struct gnp_filter filter = filtered(&sample, &options);
	check_consistent(&sample, &filter);
	for (size_t i = 0; i < sample.count; i++)
		CHECK(filter.keep[i] == !sample.outlier[i]);
	CHECK(filter.dropped_gross == 60);
	CHECK(filter.deviation[131 * 59] > 4);
	gnp_filter_clear(&filter);
	options.cluster = 20; /* thirty points are enough, but scattered in space these are no surface */
	filter = filtered(&sample, &options);
	CHECK(filter.dropped_gross == 60);
	gnp_filter_clear(&filter);
	options.gross = 0;
	filter = filtered(&sample, &options);
	CHECK(filter.dropped_gross == 0 && filter.kept > sample.count - 60);
	gnp_filter_clear(&filter);
	gnp_sample_clear(&sample);
}

/* One point in ten anywhere in a box about the surface. */
static void clutter_is_dropped(void)
{
	struct gnp_sample sample = sampled("torus", &(struct gnp_sample_options){.count = 12000, .seed = 3});
	struct gnp_filter_options options = gnp_with("fit_outlier_50k");
	struct gnp_random random;
	size_t far = 0, found = 0, alarms = 0;
	gnp_random_seed(&random, 9, 0);
	for (size_t i = 0; i < sample.count; i += 10) {
		double *p = sample.points + 3 * i, away;
		sample.outlier[i] = 1;
		for (size_t c = 0; c < 3; c++)
			p[c] = 3 * gnp_random_uniform(&random) - 1.5;
		away = fabs(hypot(hypot(p[0], p[1]) - 2.0 / 3, p[2]) - 1.0 / 3);
		if (away < 0.06) /* two spacings: may count as the surface's */
			sample.outlier[i] = 2;
	}
	struct gnp_filter filter = filtered(&sample, &options);
	for (size_t i = 0; i < sample.count; i++) {
		far += sample.outlier[i] == 1;
		found += sample.outlier[i] == 1 && !filter.keep[i];
		alarms += sample.outlier[i] == 0 && !filter.keep[i];
	}
	CHECK(far > 900 && found >= 0.99 * (double)far);
	CHECK(alarms <= 0.02 * (double)sample.count);
	gnp_filter_clear(&filter);
	gnp_sample_clear(&sample);
}

/* A point displaced along the surface is on the surface. */
static void points_displaced_along_the_surface_are_kept(void)
{
	struct gnp_sample sample = sampled("sphere", &(struct gnp_sample_options){.count = 8000, .seed = 3});
	struct gnp_filter_options options = gnp_with("fit_outlier_50k");
	struct gnp_random random;
	gnp_random_seed(&random, 9, 0);
	for (size_t i = 0; i < sample.count; i += 10) {
		double *p = sample.points + 3 * i, *n = sample.normals + 3 * i, r = 0;
		for (size_t c = 0; c < 3; c++)
			p[c] += 0.02 * gnp_random_normal(&random);
		r = sqrt(gnp_dot(p, p));
		for (size_t c = 0; c < 3; c++)
			n[c] = p[c] /= r;
	}
	struct gnp_filter filter = filtered(&sample, &options);
	CHECK(filter.kept == sample.count);
	gnp_filter_clear(&filter);
	gnp_sample_clear(&sample);
}

/* ---- Projection ---- */

static double off_surface_rms(const struct gnp_sample *sample, const struct gnp_filter *filter, const double *points)
{
	double sum = 0;
	for (size_t i = 0; i < filter->kept; i++)
		sum += pow(off_surface(sample, points ? points + 3 * (size_t)filter->index[i] : filter->points + 3 * i, filter->index[i]), 2);
	return sqrt(sum / (double)filter->kept);
}

/* The model for noise looks for no outliers itself, and isolated points without normals turn from all about them. */
static void strays_in_noise_are_found(void)
{
	struct gnp_sample sample = sampled("torus", &(struct gnp_sample_options){.count = 12000, .seed = 3, .noise = 3e-3, .outlier_fraction = 0.03, .outlier_noise = 0.06});
	struct gnp_filter_options options = gnp_with("fit_noise_70k");
	const struct gnp_cloud cloud = {sample.count, sample.points, NULL};
	struct gnp_filter filter;
	CHECK(gnp_filter_run(&cloud, &options, pool, NULL, &filter, NULL) == GNP_OK);
	CHECK(filter.dropped_consensus > 0);
	size_t isolated = 0, kept = 0;
	for (size_t i = 0; i < sample.count; i++) {
		bool far = off_surface(&sample, sample.points + 3 * i, i) > 0.02;
		isolated += far;
		kept += far && filter.keep[i];
	}
	CHECK(isolated > 200 && kept <= 0.03 * (double)isolated);
	gnp_filter_clear(&filter);
	gnp_sample_clear(&sample);
}

static void projection_takes_noise_away(void)
{
	struct gnp_sample sample = sampled("radial", &(struct gnp_sample_options){.count = 12000, .seed = 3, .noise = 3e-3});
	struct gnp_filter_options options = gnp_with("fit_noise_70k");
	options.project = true;
	struct gnp_filter once = filtered(&sample, &options);
	CHECK(once.iterations == 1 && once.stop == GNP_FILTER_ITERATIONS && once.moved > 1e-3);
	CHECK_AT_MOST(off_surface_rms(&sample, &once, NULL), off_surface_rms(&sample, &once, sample.points) / 5);
	options.iterations = 20;
	struct gnp_filter often = filtered(&sample, &options);
	CHECK(often.iterations > 1 && often.iterations < 20);
	CHECK(often.stop == GNP_FILTER_TOLERANCE || often.stop == GNP_FILTER_NO_PROGRESS);
	CHECK(often.moved < once.moved / 10);
	CHECK_AT_MOST(off_surface_rms(&sample, &often, NULL), 1.1 * off_surface_rms(&sample, &once, NULL));
	gnp_filter_clear(&once);
	gnp_filter_clear(&often);
	gnp_sample_clear(&sample);
}

/* ---- What holds of every filter ---- */

static void bytes_do_not_depend_on_workers(void)
{
	struct gnp_sample sample = sampled("torus", &(struct gnp_sample_options){.count = 4000, .seed = 3, .outlier_fraction = 0.1, .outlier_noise = 0.02});
	struct gnp_filter_options options = gnp_with("fit_outlier_50k");
	struct gnp_pool *shared = pool;
	struct gnp_filter one, many;
	options.project = true;
	options.iterations = 3;
	CHECK(gnp_pool_create(1, &pool, NULL) == GNP_OK);
	one = filtered(&sample, &options);
	gnp_pool_free(pool);
	CHECK(gnp_pool_create(3, &pool, NULL) == GNP_OK);
	many = filtered(&sample, &options);
	gnp_pool_free(pool);
	pool = shared;
	CHECK(one.kept == many.kept && one.kept > 0 && one.iterations == many.iterations);
	CHECK(memcmp(one.keep, many.keep, one.count) == 0);
	CHECK(memcmp(one.deviation, many.deviation, one.count * sizeof(double)) == 0);
	CHECK(memcmp(one.points, many.points, 3 * one.kept * sizeof(double)) == 0);
	CHECK(memcmp(one.normals, many.normals, 3 * one.kept * sizeof(double)) == 0);
	gnp_filter_clear(&one);
	gnp_filter_clear(&many);
	gnp_sample_clear(&sample);
}

static void units_do_not_matter(void)
{
	struct gnp_sample sample = sampled("torus", &(struct gnp_sample_options){.count = 6000, .seed = 3, .outlier_fraction = 0.1, .outlier_noise = 0.02});
	struct gnp_filter_options options = gnp_with("fit_outlier_50k");
	struct gnp_filter filter = filtered(&sample, &options);
	for (int power = -3; power <= 3; power += 6) {
		size_t differ = 0;
		for (size_t i = 0; i < 3 * sample.count; i++)
			sample.points[i] = pow(10, power) * sample.exact[i] + pow(10, power) * (sample.points[i] - sample.exact[i]);
		struct gnp_filter other = filtered(&sample, &options);
		for (size_t i = 0; i < sample.count; i++)
			differ += other.keep[i] != filter.keep[i];
		CHECK(differ <= 2); /* rounding may tip one that lies on the threshold */
		for (size_t i = 0; i < 3 * sample.count; i++)
			sample.points[i] = sample.exact[i] + (sample.points[i] / pow(10, power) - sample.exact[i]);
		gnp_filter_clear(&other);
	}
	gnp_filter_clear(&filter);
	gnp_sample_clear(&sample);
}

static void clouds_without_normals_get_some(void)
{
	struct gnp_sample sample = sampled("torus", &(struct gnp_sample_options){.count = 8000, .seed = 3, .outlier_fraction = 0.05, .outlier_noise = 0.015});
	struct gnp_filter_options options = gnp_with("fit_outlier_50k");
	const struct gnp_cloud cloud = {sample.count, sample.points, NULL};
	struct gnp_filter filter;
	CHECK(gnp_filter_run(&cloud, &options, pool, NULL, &filter, NULL) == GNP_OK);
	CHECK(filter.normals_estimated && filter.components == 1);
	for (size_t i = 0; i < filter.kept; i++)
		CHECK(gnp_dot(filter.normals + 3 * i, sample.normals + 3 * (size_t)filter.index[i]) > 0.9);
	gnp_filter_clear(&filter);
	gnp_sample_clear(&sample);
}

/* ---- Bad input ---- */

static void bad_options_are_refused_with_the_limit(void)
{
	struct gnp_sample sample = sampled("torus", &(struct gnp_sample_options){.count = 2000, .seed = 3});
	const struct gnp_filter_options good = gnp_filter_defaults();
	struct gnp_filter_options bad = good;
	bad.alpha = -1;
	check_refused(&sample, &bad, GNP_INVALID_ARGUMENT, "alpha: got -1, need");
	bad.alpha = NAN;
	check_refused(&sample, &bad, GNP_INVALID_ARGUMENT, "alpha: got nan");
	bad.alpha = 1e-200;
	check_refused(&sample, &bad, GNP_DEGENERATE, "filter: alpha leaves 0 of 2000 points, need at least 30, a neighbourhood");
	bad = good;
	bad.gross = 0.5;
	check_refused(&sample, &bad, GNP_INVALID_ARGUMENT, "gross: got 0.5, need 1..1e6 local spacings, or 0 for none");
	bad = good;
	bad.cluster = 0;
	check_refused(&sample, &bad, GNP_INVALID_ARGUMENT, "cluster: got 0, need 1..1e+06");
	bad = good;
	bad.iterations = 101;
	check_refused(&sample, &bad, GNP_INVALID_ARGUMENT, "iterations: got 101, need 1..100");
	bad = good;
	bad.tolerance = -1;
	check_refused(&sample, &bad, GNP_INVALID_ARGUMENT, "tolerance: got -1, need 0..1e+06");
	bad = good;
	bad.estimate.k = 7;
	check_refused(&sample, &bad, GNP_INVALID_ARGUMENT, "k: got 7, need 12..500");
	sample.points[301] = NAN;
	check_refused(&sample, &good, GNP_INVALID_ARGUMENT, "points: coordinate 1 of point 100 is nan");
	sample.points[301] = 0;
	sample.count = 20;
	check_refused(&sample, &good, GNP_INVALID_ARGUMENT, "points: got 20, need at least 30");
	sample.count = 2000;
	gnp_sample_clear(&sample);
}

static void filter_stops_when_cancelled(void)
{
	struct gnp_sample sample = sampled("torus", &(struct gnp_sample_options){.count = 2000, .seed = 3});
	const struct gnp_filter_options options = gnp_filter_defaults();
	const struct gnp_cloud cloud = {sample.count, sample.points, sample.normals};
	struct gnp_filter filter = {0};
	struct gnp_task task;
	gnp_task_init(&task);
	gnp_task_cancel(&task);
	CHECK(gnp_filter_run(&cloud, &options, pool, &task, &filter, NULL) == GNP_CANCELLED && !filter.keep);
	gnp_sample_clear(&sample);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(outliers_are_found_and_least_squares_gain),
		TEST(alpha_is_the_papers_rule),
		TEST(every_estimator_filters),
		TEST(clean_clouds_are_kept_whole),
		TEST(far_points_and_clusters_are_dropped),
		TEST(clutter_is_dropped),
		TEST(points_displaced_along_the_surface_are_kept),
		TEST(strays_in_noise_are_found),
		TEST(projection_takes_noise_away),
		TEST(bytes_do_not_depend_on_workers),
		TEST(units_do_not_matter),
		TEST(clouds_without_normals_get_some),
		TEST(bad_options_are_refused_with_the_limit),
		TEST(filter_stops_when_cancelled),
	};
	gnp_linalg_init();
	CHECK(gnp_pool_create(0, &pool, NULL) == GNP_OK);
	CHECK(gnp_models_load("weights", &models, NULL) == GNP_OK); /* tests run in the repository's root */
	int failed = RUN_TESTS(tests);
	gnp_models_release(models);
	gnp_pool_free(pool);
	return failed;
}
