/* The adaptive estimator: how close, how honest its error bars are, and what it makes of the faults of scans. */
#include "core/base/random.h"
#include "core/base/vector.h"
#include "core/estimate/estimate.h"
#include "core/shapes/shapes.h"
#include "tests/unit/test.h"

static struct gnp_pool *pool;

/* A cloud of the test's own making. */
struct scene {
	size_t count;
	double *points, *normals; /* (count, 3) each */
};

static struct scene scene_new(size_t count)
{
	struct scene scene = {count, malloc(3 * count * sizeof(double)), malloc(3 * count * sizeof(double))};
	if (!scene.points || !scene.normals)
		abort();
	return scene;
}

static void scene_clear(struct scene *scene)
{
	free(scene->points);
	free(scene->normals);
}

/* The mean distance of neighbours on a square grid as dense as the sample. */
static double spacing_of(const struct gnp_shape *shape, size_t count)
{
	return sqrt(gnp_shape_area(shape) / (double)count);
}

/* Noise and outliers in units of the spacing; *spacing out. */
static struct gnp_sample sample_of(const char *name, struct gnp_sample_options options, double *spacing)
{
	struct gnp_shape *shape = NULL;
	struct gnp_sample sample = {0};
	struct gnp_error error = {0};
	gnp_status status = gnp_shape_create(name, 400, 8, &shape, &error);
	if (status == GNP_OK) {
		*spacing = spacing_of(shape, options.count);
		options.noise *= *spacing;
		options.outlier_noise *= *spacing;
		status = gnp_sample_create(shape, &options, pool, NULL, &sample, &error);
	}
	if (status != GNP_OK) {
		fprintf(stderr, "%s: %s\n", name, error.text);
		CHECK(!"the sample was made");
	}
	gnp_shape_free(shape);
	return sample;
}

static struct gnp_sample noisy(const char *name, size_t count, uint64_t seed, double noise, double *spacing)
{
	return sample_of(name, (struct gnp_sample_options){.count = count, .seed = seed, .noise = noise}, spacing);
}

static struct gnp_estimate run_on(const double *points, const double *normals, size_t count, int estimator, int cover,
                                  struct gnp_pool *workers)
{
	struct gnp_cloud cloud = {count, points, normals};
	struct gnp_estimate_options options = gnp_estimate_defaults();
	struct gnp_estimate estimate = {0};
	struct gnp_error error = {0};
	options.estimator = estimator;
	options.cover = cover;
	options.k = count < 30 ? (int)count : 30;
	if (estimator == GNP_ESTIMATOR_ADAPTIVE)
		options.quantities = GNP_QUANTITY_ALL;
	if (gnp_estimate_run(&cloud, &options, workers, NULL, &estimate, &error) != GNP_OK) {
		fprintf(stderr, "%s\n", error.text);
		CHECK(!"the estimate succeeded");
	}
	return estimate;
}

static struct gnp_estimate adaptive(const double *points, const double *normals, size_t count)
{
	return run_on(points, normals, count, GNP_ESTIMATOR_ADAPTIVE, GNP_COVER_ALL, pool);
}

/* Relative L2 error over all points. */
static double relative(const double *got, const double *want, size_t count)
{
	double error = 0, size = 0;
	for (size_t i = 0; i < count; i++) {
		error += (got[i] - want[i]) * (got[i] - want[i]);
		size += want[i] * want[i];
	}
	return sqrt(error / size);
}

static double angle(const double a[3], const double b[3])
{
	double c[3];
	gnp_cross(a, b, c);
	return atan2(sqrt(gnp_dot(c, c)), gnp_dot(a, b));
}

static void check_all_finite(const struct gnp_estimate *e)
{
	for (int q = 0; q < GNP_QUANTITY_COUNT; q++) {
		size_t width = gnp_quantity_info((enum gnp_quantity)q)->width, broken = 0;
		if (!e->values[q])
			continue;
		for (size_t i = 0; i < e->count * (width ? width : e->basis_size); i++)
			broken += !isfinite(e->values[q][i]);
		if (broken)
			fprintf(stderr, "%s: %zu of %zu points\n", gnp_quantity_info((enum gnp_quantity)q)->name, broken, e->count);
		CHECK(broken == 0);
	}
}

/* --- accuracy --- */

struct rivals {
	double gaussian[GNP_ESTIMATOR_KINDS], mean[GNP_ESTIMATOR_KINDS]; /* relative errors of GMLS and adaptive */
};

static struct rivals compete(const char *name, const struct gnp_sample_options *options)
{
	double spacing;
	struct gnp_sample sample = sample_of(name, *options, &spacing);
	struct rivals rivals;
	for (int estimator = GNP_ESTIMATOR_GMLS; estimator <= GNP_ESTIMATOR_ADAPTIVE; estimator++) {
		struct gnp_estimate e = run_on(sample.points, sample.normals, sample.count, estimator, GNP_COVER_COVER, pool);
		rivals.gaussian[estimator] = relative(e.values[GNP_GAUSSIAN_CURVATURE], sample.gaussian_curvature, sample.count);
		rivals.mean[estimator] = relative(e.values[GNP_MEAN_CURVATURE], sample.mean_curvature, sample.count);
		gnp_estimate_clear(&e);
	}
	gnp_sample_clear(&sample);
	return rivals;
}

static void noise_and_outliers_cost_it_a_fraction_of_what_they_cost_gmls(void)
{
	static const struct {
		const char *name;
		struct gnp_sample_options options;
		double gaussian, mean;
	} rows[] = {{"torus", {.count = 10000, .seed = 5, .noise = 0.1}, 0.12, 0.08},
	            {"radial", {.count = 10000, .seed = 6, .noise = 0.1}, 0.25, 0.11},
	            {"torus", {.count = 10000, .seed = 7, .outlier_fraction = 0.1, .outlier_noise = 1}, 0.04, 0.015},
	            {"radial", {.count = 10000, .seed = 8, .outlier_fraction = 0.1, .outlier_noise = 1}, 0.16, 0.09}};
	for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
		struct rivals r = compete(rows[i].name, &rows[i].options);
		CHECK_AT_MOST(r.gaussian[GNP_ESTIMATOR_ADAPTIVE], rows[i].gaussian);
		CHECK_AT_MOST(r.mean[GNP_ESTIMATOR_ADAPTIVE], rows[i].mean);
		CHECK_AT_MOST(r.gaussian[GNP_ESTIMATOR_ADAPTIVE], r.gaussian[GNP_ESTIMATOR_GMLS] / 4);
		CHECK_AT_MOST(r.mean[GNP_ESTIMATOR_ADAPTIVE], r.mean[GNP_ESTIMATOR_GMLS] / 4);
	}
}

/* --- error bars --- */

struct within {
	double normal, gaussian, mean; /* shares of the points whose true error is at most 2 standard errors */
};

static struct within within_two(const struct gnp_estimate *e, const struct gnp_sample *sample)
{
	struct within within = {0};
	double each = 1 / (double)sample->count;
	for (size_t i = 0; i < sample->count; i++) {
		double turned = angle(e->values[GNP_NORMALS] + 3 * i, sample->normals + 3 * i);
		double gaussian = fabs(e->values[GNP_GAUSSIAN_CURVATURE][i] - sample->gaussian_curvature[i]);
		double mean = fabs(e->values[GNP_MEAN_CURVATURE][i] - sample->mean_curvature[i]);
		within.normal += each * (turned <= 2 * e->values[GNP_NORMALS_STDERR][i]);
		within.gaussian += each * (gaussian <= 2 * e->values[GNP_GAUSSIAN_CURVATURE_STDERR][i]);
		within.mean += each * (mean <= 2 * e->values[GNP_MEAN_CURVATURE_STDERR][i]);
	}
	return within;
}

static void check_share(const char *shape, const char *what, double share, double most)
{
	if (share < 0.9 || share > most)
		fprintf(stderr, "%s: %g of the %s errors are within 2 standard errors\n", shape, share, what);
	CHECK(share >= 0.9 && share <= most);
}

static void true_errors_are_within_two_standard_errors(void)
{
	static const char *names[] = {"torus", "radial", "ellipsoid"};
	for (size_t s = 0; s < 3; s++) {
		double spacing;
		struct gnp_sample sample = noisy(names[s], 8000, 20 + s, 0.15, &spacing);
		struct gnp_estimate e = adaptive(sample.points, sample.normals, sample.count);
		struct within within = within_two(&e, &sample);
		check_share(names[s], "normal", within.normal, 0.998); /* two-dimensional: 0.982 where 0.954 is exact */
		check_share(names[s], "Gaussian curvature", within.gaussian, 0.995);
		check_share(names[s], "mean curvature", within.mean, 0.995);
		gnp_estimate_clear(&e);
		gnp_sample_clear(&sample);
	}
}

/* Every point of a sphere has the same curvature, and what a prior takes out of it is the same everywhere. */
static void spheres_are_as_round_as_they_are(void)
{
	static const double noises[] = {0.03, 0.15, 0.6}; /* spacings */
	for (size_t i = 0; i < 3; i++) {
		double spacing, square = 0, doubt = 0;
		struct gnp_sample sample = noisy("sphere", 8000, 40 + i, noises[i], &spacing);
		struct gnp_estimate e = adaptive(sample.points, sample.normals, sample.count);
		for (size_t p = 0; p < sample.count; p++) {
			square += pow(e.values[GNP_MEAN_CURVATURE][p] + 1, 2);
			doubt += pow(e.values[GNP_MEAN_CURVATURE_STDERR][p], 2);
		}
		CHECK_AT_MOST(sqrt(square / doubt), 1.1);
		CHECK(within_two(&e, &sample).mean >= 0.95);
		gnp_estimate_clear(&e);
		gnp_sample_clear(&sample);
	}
}

/* The torus is 1/3 from the circle of radius 2/3: how far its estimated points are off needs no sampling. */
static void estimated_points_are_within_two_standard_errors(void)
{
	double spacing, share = 0, square = 0;
	struct gnp_sample sample = noisy("torus", 10000, 31, 0.15, &spacing);
	struct gnp_estimate e = adaptive(sample.points, sample.normals, sample.count);
	for (size_t i = 0; i < sample.count; i++) {
		const double *p = e.values[GNP_POINTS] + 3 * i;
		double off = hypot(hypot(p[0], p[1]) - 2.0 / 3, p[2]) - 1.0 / 3;
		share += (fabs(off) <= 2 * e.values[GNP_POINTS_STDERR][i]) / (double)sample.count;
		square += off * off / (double)sample.count;
	}
	check_share("torus", "position", share, 0.998);
	CHECK_AT_MOST(sqrt(square), 0.4 * 0.15 * spacing);
	gnp_estimate_clear(&e);
	gnp_sample_clear(&sample);
}

/* --- outliers --- */

/* Moves a tenth of the points along their normals by least..most. */
static void spoil(struct gnp_sample *sample, double least, double most)
{
	struct gnp_random random;
	gnp_random_seed(&random, 77, 0);
	for (size_t i = 0; i < sample->count; i++) {
		sample->outlier[i] = gnp_random_uniform(&random) < 0.1;
		double size = least + (most - least) * gnp_random_uniform(&random);
		double off = gnp_random_uniform(&random) < 0.5 ? -size : size;
		for (int c = 0; sample->outlier[i] && c < 3; c++)
			sample->points[3 * i + c] += off * sample->normals[3 * i + c];
	}
}

/* Normals that isolated points have of their own are any. */
static void spoil_normals(struct gnp_sample *sample, double *normals)
{
	struct gnp_random random;
	gnp_random_seed(&random, 78, 0);
	memcpy(normals, sample->normals, 3 * sample->count * sizeof *normals);
	for (size_t i = 0; i < 3 * sample->count; i++)
		if (sample->outlier[i / 3])
			normals[i] = gnp_random_normal(&random);
}

enum normals { EXACT, WILD, NONE };

static void check_outliers(const char *name, double noise, enum normals kind)
{
	double spacing, found = 0, false_alarms = 0, there = 0, turned = 0;
	struct gnp_sample sample = noisy(name, 10000, 41, noise, &spacing);
	spoil(&sample, 12 * fmax(noise, 0.02) * spacing, 2 * spacing);
	struct scene scene = scene_new(sample.count);
	spoil_normals(&sample, scene.normals);
	double *const normals[] = {[EXACT] = sample.normals, [WILD] = scene.normals, [NONE] = NULL};
	struct gnp_estimate e = run_on(sample.points, normals[kind], sample.count, GNP_ESTIMATOR_ADAPTIVE, GNP_COVER_COVER, pool);
	for (size_t i = 0; i < sample.count; i++) {
		bool flagged = e.values[GNP_OUTLIER][i] == 1;
		there += sample.outlier[i];
		found += flagged && sample.outlier[i];
		false_alarms += flagged && !sample.outlier[i];
		if (sample.outlier[i])
			turned += angle(e.values[GNP_NORMALS] + 3 * i, sample.normals + 3 * i) <= 0.05;
	}
	CHECK_AT_MOST(1 - found / there, 0.03);
	CHECK_AT_MOST(false_alarms / ((double)sample.count - there), 0.02);
	CHECK_AT_MOST(1 - turned / there, 0.03);
	scene_clear(&scene);
	gnp_estimate_clear(&e);
	gnp_sample_clear(&sample);
}

static void outliers_are_found_and_the_surface_below_them_described(void)
{
	check_outliers("torus", 0, EXACT);
	check_outliers("torus", 0.05, WILD);
	check_outliers("radial", 0.05, EXACT);
	check_outliers("torus", 0.05, NONE);
}

/* --- same answers however it is asked --- */

/* Of a quantity (count), relative to its largest value. */
static double difference(const struct gnp_estimate *a, double factor, const struct gnp_estimate *b, enum gnp_quantity q)
{
	double worst = 0, size = 0;
	for (size_t i = 0; i < a->count; i++) {
		worst = fmax(worst, fabs(a->values[q][i] * factor - b->values[q][i]));
		size = fmax(size, fabs(b->values[q][i]));
	}
	return worst / size;
}

static struct scene moved(const struct gnp_sample *sample, const double turn[3][3], double scale)
{
	static const double shift[3] = {5, -7, 11};
	struct scene scene = scene_new(sample->count);
	for (size_t i = 0; i < sample->count; i++)
		for (int c = 0; c < 3; c++) {
			scene.points[3 * i + c] = scale * (gnp_dot(turn[c], sample->points + 3 * i) + shift[c]);
			scene.normals[3 * i + c] = gnp_dot(turn[c], sample->normals + 3 * i);
		}
	return scene;
}

static const struct gnp_sample_options spoilt = {.count = 6000, .seed = 3, .noise = 0.05,
                                                 .outlier_fraction = 0.03, .outlier_noise = 2};

static void moving_and_scaling_the_cloud_moves_and_scales_the_answers(void)
{
	static const double same[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, scales[] = {1e-3, 1e3};
	double spacing;
	struct gnp_sample sample = sample_of("torus", spoilt, &spacing);
	struct gnp_estimate before = adaptive(sample.points, sample.normals, sample.count);
	for (size_t s = 0; s < 2; s++) {
		double h = scales[s], worst = 0;
		struct scene scene = moved(&sample, same, h);
		struct gnp_estimate after = adaptive(scene.points, scene.normals, scene.count);
		for (size_t i = 0; i < sample.count; i++)
			worst = fmax(worst, angle(after.values[GNP_NORMALS] + 3 * i, before.values[GNP_NORMALS] + 3 * i));
		CHECK_AT_MOST(worst, 1e-7);
		CHECK_AT_MOST(difference(&after, h * h, &before, GNP_GAUSSIAN_CURVATURE), 1e-6);
		CHECK_AT_MOST(difference(&after, h, &before, GNP_MEAN_CURVATURE), 1e-6);
		CHECK_AT_MOST(difference(&after, h * h, &before, GNP_GAUSSIAN_CURVATURE_STDERR), 1e-5);
		CHECK_AT_MOST(difference(&after, h, &before, GNP_MEAN_CURVATURE_STDERR), 1e-5);
		CHECK_AT_MOST(difference(&after, 1, &before, GNP_OUTLIER), 0);
		gnp_estimate_clear(&after);
		scene_clear(&scene);
	}
	gnp_estimate_clear(&before);
	gnp_sample_clear(&sample);
}

/* Another orientation orders the points anew, and other points stand for them: the answers differ within their error bars. */
static void turning_the_cloud_turns_the_answers_within_their_error_bars(void)
{
	static const double turn[3][3] = {{0.36, 0.48, -0.8}, {-0.8, 0.6, 0}, {0.48, 0.64, 0.6}};
	double spacing, agree[3] = {0};
	struct gnp_sample sample = sample_of("torus", spoilt, &spacing);
	struct scene scene = moved(&sample, turn, 1);
	struct gnp_estimate before = adaptive(sample.points, sample.normals, sample.count);
	struct gnp_estimate after = adaptive(scene.points, scene.normals, scene.count);
	for (size_t i = 0; i < sample.count; i++) {
		const double *n = before.values[GNP_NORMALS] + 3 * i;
		const double expected[3] = {gnp_dot(turn[0], n), gnp_dot(turn[1], n), gnp_dot(turn[2], n)};
		double each = 1 / (double)sample.count;
		double mean = fabs(after.values[GNP_MEAN_CURVATURE][i] - before.values[GNP_MEAN_CURVATURE][i]);
		agree[0] += each * (angle(after.values[GNP_NORMALS] + 3 * i, expected) <= 2 * before.values[GNP_NORMALS_STDERR][i]);
		agree[1] += each * (mean <= 2 * before.values[GNP_MEAN_CURVATURE_STDERR][i]);
		agree[2] += each * (after.values[GNP_OUTLIER][i] == before.values[GNP_OUTLIER][i]);
	}
	CHECK_AT_MOST(1 - agree[0], 0.05);
	CHECK_AT_MOST(1 - agree[1], 0.05);
	CHECK_AT_MOST(1 - agree[2], 0.002);
	scene_clear(&scene);
	gnp_estimate_clear(&before);
	gnp_estimate_clear(&after);
	gnp_sample_clear(&sample);
}

static void check_same_bytes(const struct gnp_estimate *a, const struct gnp_estimate *b)
{
	for (int q = 0; q < GNP_QUANTITY_COUNT; q++) {
		size_t width = gnp_quantity_info((enum gnp_quantity)q)->width;
		width = width ? width : a->basis_size;
		if (q == GNP_CREASE) /* not this estimator's */
			continue;
		CHECK(a->values[q] && b->values[q] && memcmp(a->values[q], b->values[q], a->count * width * sizeof(double)) == 0);
	}
}

static void any_number_of_workers_gives_the_same_bytes(void)
{
	static const unsigned workers[] = {1, 2, 4};
	double spacing;
	struct gnp_sample sample = sample_of("torus", spoilt, &spacing);
	for (int cover = GNP_COVER_COVER; cover <= GNP_COVER_ALL; cover++) {
		struct gnp_estimate e[3] = {{0}};
		for (int w = 0; w < 3; w++) {
			struct gnp_pool *other = NULL;
			CHECK(gnp_pool_create(workers[w], &other, NULL) == GNP_OK);
			e[w] = run_on(sample.points, sample.normals, sample.count, GNP_ESTIMATOR_ADAPTIVE, cover, other);
			gnp_pool_free(other);
			check_same_bytes(&e[0], &e[w]);
		}
		for (int w = 0; w < 3; w++)
			gnp_estimate_clear(&e[w]);
	}
	gnp_sample_clear(&sample);
}

/* --- what scans have --- */

static const double golden = 2.399963229728653;

/* Ten times as dense at the north pole as at the south pole. */
static void density_may_vary_tenfold(void)
{
	enum { N = 8000 };
	static const double noise = 1e-3;
	struct scene scene = scene_new(N);
	struct gnp_random random;
	gnp_random_seed(&random, 1, 2);
	for (size_t i = 0; i < N; i++) {
		double low = pow(10, -0.5), t = (i + 0.5) / N, z = 2 * log10(low + t * (1 / low - low));
		double phi = golden * (double)i, r = sqrt(1 - z * z), length = 1 + noise * gnp_random_normal(&random);
		const double n[3] = {r * cos(phi), r * sin(phi), z};
		for (int c = 0; c < 3; c++) {
			scene.normals[3 * i + c] = n[c];
			scene.points[3 * i + c] = n[c] * length;
		}
	}
	struct gnp_estimate e = adaptive(scene.points, scene.normals, N);
	double worst = 0, worst_normal = 0, outliers = 0;
	for (size_t i = 0; i < N; i++) {
		worst = fmax(worst, fabs(e.values[GNP_MEAN_CURVATURE][i] + 1));
		worst_normal = fmax(worst_normal, angle(e.values[GNP_NORMALS] + 3 * i, scene.normals + 3 * i));
		outliers += e.values[GNP_OUTLIER][i];
	}
	check_all_finite(&e);
	CHECK_AT_MOST(worst, 0.1);
	CHECK_AT_MOST(worst_normal, 0.01);
	CHECK_AT_MOST(outliers, 0.005 * N);
	CHECK(e.degenerate == 0);
	gnp_estimate_clear(&e);
	scene_clear(&scene);
}

/* Two shells, normals away from the wall between them. */
static void check_shells(double noise, int cover)
{
	enum { N = 6000 };
	struct scene scene = scene_new(2 * N);
	struct gnp_random random;
	double spacing = sqrt(4 * M_PI / N), radius[2] = {1, 1 - 2 * spacing}, worst[2] = {0}, square[2] = {0}, worst_normal = 0;
	double outliers = 0;
	gnp_random_seed(&random, 3, 4);
	for (size_t i = 0; i < 2 * N; i++) {
		size_t shell = i / N;
		double z = 2 * ((double)(i % N) + 0.5) / N - 1, phi = golden * (double)i, r = sqrt(1 - z * z);
		double length = radius[shell] + noise * spacing * gnp_random_normal(&random);
		const double n[3] = {r * cos(phi), r * sin(phi), z};
		for (int c = 0; c < 3; c++) {
			scene.normals[3 * i + c] = shell ? -n[c] : n[c];
			scene.points[3 * i + c] = n[c] * length;
		}
	}
	struct gnp_estimate e = run_on(scene.points, scene.normals, scene.count, GNP_ESTIMATOR_ADAPTIVE, cover, pool);
	for (size_t i = 0; i < 2 * N; i++) {
		size_t shell = i / N;
		double off = fabs(e.values[GNP_MEAN_CURVATURE][i] - (shell ? 1 / radius[1] : -1));
		worst[shell] = fmax(worst[shell], off);
		square[shell] += off * off / N;
		worst_normal = fmax(worst_normal, angle(e.values[GNP_NORMALS] + 3 * i, scene.normals + 3 * i));
		outliers += e.values[GNP_OUTLIER][i];
	}
	for (int shell = 0; shell < 2; shell++) {
		CHECK_AT_MOST(worst[shell], 0.01 + 2 * noise);
		CHECK_AT_MOST(sqrt(square[shell]), 1e-3 + noise);
	}
	CHECK_AT_MOST(worst_normal, 1e-3 + 0.4 * noise);
	CHECK_AT_MOST(outliers, 0.01 * 2 * N);
	gnp_estimate_clear(&e);
	scene_clear(&scene);
}

static void two_sheets_two_spacings_apart_are_not_mixed(void)
{
	check_shells(0, GNP_COVER_COVER);
	check_shells(0.05, GNP_COVER_COVER);
	check_shells(0.05, GNP_COVER_ALL);
}

/* A saddle over the unit disk. */
static void open_boundaries_are_flagged_and_doubted(void)
{
	enum { N = 6000 };
	static const double bend = 0.3;
	struct scene scene = scene_new(N);
	struct gnp_random random;
	double spacing = sqrt(M_PI / N), rim = 0, at_rim = 0, inside = 0, flagged_inside = 0, doubt[2] = {0}, off[2] = {0};
	gnp_random_seed(&random, 5, 6);
	for (size_t i = 0; i < N; i++) {
		double r = sqrt((i + 0.5) / N), x = r * cos(golden * (double)i), y = r * sin(golden * (double)i);
		double root = sqrt(1 + 4 * bend * bend * r * r);
		const double p[3] = {x, y, bend * (x * x - y * y) + 0.05 * spacing * gnp_random_normal(&random)};
		const double n[3] = {-2 * bend * x / root, 2 * bend * y / root, 1 / root};
		memcpy(scene.points + 3 * i, p, sizeof p);
		memcpy(scene.normals + 3 * i, n, sizeof n);
	}
	struct gnp_estimate e = adaptive(scene.points, scene.normals, N);
	for (size_t i = 0; i < N; i++) {
		double depth = (1 - sqrt((i + 0.5) / N)) / spacing, flag = e.values[GNP_BOUNDARY][i];
		bool close = depth < 0.4, far = depth > 1.5;
		double root = sqrt(1 + 4 * bend * bend * (i + 0.5) / N), K = -4 * bend * bend / (root * root * root * root);
		rim += close;
		at_rim += close * flag;
		inside += far;
		flagged_inside += far * flag;
		if (close || depth > 10) {
			doubt[close] += e.values[GNP_GAUSSIAN_CURVATURE_STDERR][i];
			off[close] = fmax(off[close], fabs(e.values[GNP_GAUSSIAN_CURVATURE][i] - K));
		}
	}
	check_all_finite(&e);
	CHECK_AT_MOST(1 - at_rim / rim, 0.05);
	CHECK_AT_MOST(flagged_inside / inside, 0.02);
	CHECK(doubt[1] / rim > 2 * doubt[0] / N);
	CHECK_AT_MOST(off[1], 0.5);
	CHECK_AT_MOST(off[0], 0.1);
	gnp_estimate_clear(&e);
	scene_clear(&scene);
}

static void near_duplicates_change_nothing(void)
{
	enum { N = 5000, TWINS = N / 4 };
	double spacing, worst_mean = 0, worst_normal = 0, outliers = 0;
	struct gnp_sample sample = noisy("torus", N, 51, 0, &spacing);
	struct scene scene = scene_new(N + TWINS);
	struct gnp_random random;
	gnp_random_seed(&random, 7, 8);
	for (size_t i = 0; i < 3 * (N + TWINS); i++) {
		size_t original = i < 3 * N ? i : 4 * ((i - 3 * N) / 3) * 3 + i % 3;
		scene.points[i] = sample.points[original] + (i < 3 * N ? 0 : 1e-5 * spacing * gnp_random_normal(&random));
		scene.normals[i] = sample.normals[original];
	}
	struct gnp_estimate without = adaptive(sample.points, sample.normals, N);
	struct gnp_estimate with = adaptive(scene.points, scene.normals, scene.count);
	for (size_t i = 0; i < N; i++) {
		worst_mean = fmax(worst_mean, fabs(with.values[GNP_MEAN_CURVATURE][i] - without.values[GNP_MEAN_CURVATURE][i]));
		worst_normal = fmax(worst_normal, angle(with.values[GNP_NORMALS] + 3 * i, without.values[GNP_NORMALS] + 3 * i));
		outliers += with.values[GNP_OUTLIER][i];
	}
	check_all_finite(&with);
	CHECK_AT_MOST(worst_mean, 0.02);
	CHECK_AT_MOST(worst_normal, 1e-3);
	CHECK(with.degenerate == 0);
	CHECK_AT_MOST(outliers, 0.02 * N);
	gnp_estimate_clear(&without);
	gnp_estimate_clear(&with);
	scene_clear(&scene);
	gnp_sample_clear(&sample);
}

/* --- very little to go by --- */

static void tiny_clouds_give_finite_answers(void)
{
	for (size_t n = 12; n <= 60; n += 4) {
		struct scene ball = scene_new(n), plane = scene_new(n);
		double off = 0, outliers = 0;
		for (size_t i = 0; i < n; i++) {
			double z = 2 * ((double)i + 0.5) / (double)n - 1, phi = golden * (double)i, r = sqrt(1 - z * z), s = sqrt((double)i + 0.5);
			const double b[3] = {r * cos(phi), r * sin(phi), z}, p[3] = {s * cos(phi), s * sin(phi), 0}, up[3] = {0, 0, 1};
			memcpy(ball.points + 3 * i, b, sizeof b);
			memcpy(ball.normals + 3 * i, b, sizeof b);
			memcpy(plane.points + 3 * i, p, sizeof p);
			memcpy(plane.normals + 3 * i, up, sizeof up);
		}
		struct gnp_estimate e = adaptive(ball.points, ball.normals, n);
		struct gnp_estimate flat = adaptive(plane.points, plane.normals, n);
		check_all_finite(&e);
		check_all_finite(&flat);
		for (size_t i = 0; i < n; i++) {
			off = fmax(off, fmax(fabs(flat.values[GNP_MEAN_CURVATURE][i]), 1 - flat.values[GNP_NORMALS][3 * i + 2]));
			outliers += e.values[GNP_OUTLIER][i] + flat.values[GNP_OUTLIER][i];
		}
		CHECK(outliers == 0); /* so few points fit anything: none contradicts the rest */
		CHECK_AT_MOST(off, 1e-9);
		gnp_estimate_clear(&e);
		gnp_estimate_clear(&flat);
		scene_clear(&ball);
		scene_clear(&plane);
	}
}

/* A flat floor with a wire over it: nothing is known across the wire. */
static void points_on_a_line_fall_back_and_are_counted(void)
{
	enum { SIDE = 30, LINE = 1200, N = SIDE * SIDE + LINE };
	struct scene scene = scene_new(N);
	for (int i = 0; i < N; i++) {
		int on_line = i >= SIDE * SIDE, j = i - SIDE * SIDE;
		const double p[3] = {on_line ? 1000 + 0.5 * j : i % SIDE + 0.1 * sin(i), on_line ? 0 : i / SIDE + 0.1 * cos(3 * i), 0};
		memcpy(scene.points + 3 * i, p, sizeof p);
	}
	struct gnp_estimate e = adaptive(scene.points, NULL, N);
	check_all_finite(&e);
	CHECK(e.degenerate >= LINE / 2 && e.degenerate <= LINE + 60);
	for (size_t i = 0; i < SIDE * SIDE; i++)
		CHECK_NEAR(e.values[GNP_MEAN_CURVATURE][i], 0, 1e-9);
	gnp_estimate_clear(&e);
	scene_clear(&scene);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(noise_and_outliers_cost_it_a_fraction_of_what_they_cost_gmls),
	                                    TEST(true_errors_are_within_two_standard_errors),
	                                    TEST(spheres_are_as_round_as_they_are),
	                                    TEST(estimated_points_are_within_two_standard_errors),
	                                    TEST(outliers_are_found_and_the_surface_below_them_described),
	                                    TEST(moving_and_scaling_the_cloud_moves_and_scales_the_answers),
	                                    TEST(turning_the_cloud_turns_the_answers_within_their_error_bars),
	                                    TEST(any_number_of_workers_gives_the_same_bytes),
	                                    TEST(density_may_vary_tenfold),
	                                    TEST(two_sheets_two_spacings_apart_are_not_mixed),
	                                    TEST(open_boundaries_are_flagged_and_doubted),
	                                    TEST(near_duplicates_change_nothing),
	                                    TEST(tiny_clouds_give_finite_answers),
	                                    TEST(points_on_a_line_fall_back_and_are_counted)};
	if (gnp_pool_create(2, &pool, NULL) != GNP_OK)
		return 1;
	int status = RUN_TESTS(tests);
	gnp_pool_free(pool);
	return status;
}
