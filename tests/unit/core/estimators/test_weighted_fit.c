/* The estimator gnp with the model for any cloud, which is its default: on surfaces smooth and sharp, noisy and
 * spoilt, even and in lines, with the truth known. */
#include "core/base/random.h"
#include "core/base/vector.h"
#include "core/estimate/estimate.h"
#include "core/estimators/weighted_fit.h"
#include "core/linear/linalg.h"
#include "core/model/models.h"
#include "core/shapes/shapes.h"
#include "tests/unit/test.h"

static struct gnp_pool *pool;
static struct gnp_models *models; /* the shipped ones; tests run in the repository's root */

static struct gnp_estimate_options defaults(void)
{
	struct gnp_estimate_options options = gnp_estimate_defaults();
	options.estimator = GNP_ESTIMATOR_GNP;
	options.quantities = GNP_QUANTITY_ALL;
	options.models = models;
	return options;
}

static struct gnp_estimate estimate_by(const struct gnp_cloud *cloud, const struct gnp_estimate_options *options,
                                       struct gnp_pool *workers)
{
	struct gnp_estimate estimate = {0};
	struct gnp_error error = {0};
	if (gnp_estimate_run(cloud, options, workers, NULL, &estimate, &error) != GNP_OK) {
		fprintf(stderr, "%s\n", error.text);
		CHECK(!"the estimate succeeded");
		exit(1);
	}
	return estimate;
}

static struct gnp_estimate estimate_of(const struct gnp_cloud *cloud)
{
	struct gnp_estimate_options options = defaults();
	return estimate_by(cloud, &options, pool);
}

static struct gnp_sample sample_of(const char *name, struct gnp_sample_options options)
{
	struct gnp_shape *shape = NULL;
	struct gnp_sample sample = {0};
	CHECK(gnp_shape_create(name, 5, 6, &shape, NULL) == GNP_OK);
	CHECK(gnp_sample_create(shape, &options, pool, NULL, &sample, NULL) == GNP_OK);
	gnp_shape_free(shape);
	return sample;
}

/* Root mean square angle to lines, in degrees, of points that `judged` says yes to (NULL: all). */
static double angle_of(const struct gnp_estimate *e, const double *truth, const unsigned char *judged)
{
	double sum = 0, count = 0;
	for (size_t i = 0; i < e->count; i++) {
		if (judged && !judged[i])
			continue;
		double cosine = fabs(gnp_dot(e->values[GNP_NORMALS] + 3 * i, truth + 3 * i));
		double angle = 180 / 3.14159265358979 * acos(fmin(1, cosine));
		sum += angle * angle;
		count++;
	}
	return sqrt(sum / count);
}

/* Points at random on the cube [-1, 1]^3: normals, and how far each is from the nearest edge in spacings. */
static void make_cube(size_t count, double *points, double *normals, double *edge)
{
	struct gnp_random random;
	gnp_random_seed(&random, 3, 0);
	for (size_t i = 0; i < count; i++) {
		size_t axis = gnp_random_below(&random, 3);
		double side = gnp_random_uniform(&random) < 0.5 ? -1 : 1, nearest = 1;
		for (size_t c = 0; c < 3; c++) {
			points[3 * i + c] = c == axis ? side : 2 * gnp_random_uniform(&random) - 1;
			normals[3 * i + c] = c == axis ? side : 0;
			if (c != axis)
				nearest = fmin(nearest, 1 - fabs(points[3 * i + c]));
		}
		edge[i] = nearest / sqrt(24 / (double)count);
	}
}

/* ---- Which model ---- */

static void the_default_weighs_nodes_and_says_so(void)
{
	struct gnp_sample sample = sample_of("torus", (struct gnp_sample_options){.count = 2000, .seed = 1});
	struct gnp_cloud cloud = {sample.count, sample.points, NULL};
	struct gnp_estimate e = estimate_of(&cloud);
	CHECK(e.model && e.model->architecture.head == GNP_HEAD_WEIGHTED);
	CHECK(e.patches > 0 && e.patches < sample.count && e.degenerate == 0);
	for (int q = 0; q < GNP_QUANTITY_COUNT; q++)
		CHECK(e.values[q]);
	gnp_estimate_clear(&e);
	gnp_sample_clear(&sample);
}

/* ---- Accuracy ---- */

static void smooth_surfaces_are_fitted_to_many_digits(void)
{
	static const char *const names[] = {"sphere", "torus", "radial"};
	for (int s = 0; s < 3; s++) {
		struct gnp_sample sample = sample_of(names[s], (struct gnp_sample_options){.count = 12000, .seed = 11});
		struct gnp_cloud cloud = {sample.count, sample.points, NULL};
		struct gnp_estimate e = estimate_of(&cloud);
		double off = 0, size = 0;
		for (size_t i = 0; i < sample.count; i++) {
			double error = fabs(e.values[GNP_MEAN_CURVATURE][i]) - fabs(sample.mean_curvature[i]);
			off += error * error;
			size += sample.mean_curvature[i] * sample.mean_curvature[i];
		}
		CHECK_AT_MOST(angle_of(&e, sample.normals, NULL), 0.05);
		CHECK_AT_MOST(sqrt(off / size), 3e-3);
		gnp_estimate_clear(&e);
		gnp_sample_clear(&sample);
	}
}

static void edges_are_flagged_and_not_smoothed_over(void)
{
	enum { COUNT = 8000 };
	static double points[3 * COUNT], normals[3 * COUNT], edge[COUNT];
	static unsigned char inside[COUNT];
	double flagged = 0, right = 0, there = 0;
	make_cube(COUNT, points, normals, edge);
	struct gnp_estimate e = estimate_of(&(struct gnp_cloud){COUNT, points, NULL});
	for (size_t i = 0; i < COUNT; i++) {
		bool crease = e.values[GNP_CREASE][i] == 1;
		inside[i] = edge[i] > 1;
		flagged += crease;
		there += edge[i] < 1;
		right += crease && edge[i] < 1.5; /* the limit is not sharp */
	}
	CHECK_AT_MOST(angle_of(&e, normals, inside), 2);
	CHECK(right >= 0.9 * flagged);
	CHECK(right >= 0.85 * there);
	gnp_estimate_clear(&e);
}

static void noise_is_averaged_and_told_in_errors(void)
{
	static const char *const names[] = {"sphere", "torus", "radial"};
	double one = 0, two = 0, all = 0;
	for (int s = 0; s < 3; s++) {
		struct gnp_sample sample =
			sample_of(names[s], (struct gnp_sample_options){.count = 8000, .seed = 2, .noise = 0.01});
		struct gnp_cloud cloud = {sample.count, sample.points, NULL};
		struct gnp_estimate e = estimate_of(&cloud);
		for (size_t i = 0; i < sample.count; i++) {
			double error = fabs(fabs(e.values[GNP_MEAN_CURVATURE][i]) - fabs(sample.mean_curvature[i]));
			one += error < e.values[GNP_MEAN_CURVATURE_STDERR][i];
			two += error < 2 * e.values[GNP_MEAN_CURVATURE_STDERR][i];
			all++;
		}
		if (s == 0)
			CHECK_AT_MOST(angle_of(&e, sample.normals, NULL), 3);
		gnp_estimate_clear(&e);
		gnp_sample_clear(&sample);
	}
	CHECK(one > 0.45 * all && two > 0.8 * all);
}

/* Also where a piece serves several points: it tells of each what is about that point. */
static void rims_and_residuals_are_told_under_noise(void)
{
	enum { COUNT = 6000 };
	static const double noises[] = {1e-3, 1e-2};
	static double points[3 * COUNT];
	for (size_t n = 0; n < 2; n++) {
		struct gnp_random random;
		double inside = 0, wrong = 0, rim = 0, right = 0, residual = 0;
		gnp_random_seed(&random, 6, n);
		for (size_t i = 0; i < COUNT; i++) {
			double x = 2 * gnp_random_uniform(&random) - 1, y = 2 * gnp_random_uniform(&random) - 1;
			const double p[3] = {x, y, 0.3 * x * x - 0.2 * x * y + noises[n] * gnp_random_normal(&random)};
			memcpy(points + 3 * i, p, sizeof p);
		}
		struct gnp_estimate e = estimate_of(&(struct gnp_cloud){COUNT, points, NULL});
		for (size_t i = 0; i < COUNT; i++) {
			double far = fmax(fabs(points[3 * i]), fabs(points[3 * i + 1]));
			bool flagged = e.values[GNP_BOUNDARY][i] == 1;
			inside += far < 0.9;
			wrong += far < 0.9 && flagged;
			rim += far > 0.985;
			right += far > 0.985 && flagged;
			residual += e.values[GNP_RESIDUAL][i] / COUNT;
		}
		CHECK(wrong <= 0.002 * inside);
		CHECK(right >= 0.95 * rim);
		CHECK_NEAR(residual, noises[n], 0.2 * noises[n]);
		gnp_estimate_clear(&e);
	}
}

/* Rows eight times as far apart as points in a row: the nearest neighbours span one direction. */
static void scan_lines_get_the_normal_of_their_surface(void)
{
	enum { ROWS = 30, COLUMNS = 240, COUNT = ROWS * COLUMNS };
	static double points[3 * COUNT];
	struct gnp_random random;
	gnp_random_seed(&random, 5, 0);
	for (size_t i = 0; i < COUNT; i++) {
		points[3 * i] = (double)(i % COLUMNS) + 0.1 * gnp_random_normal(&random);
		points[3 * i + 1] = 8 * (double)(i / COLUMNS);
		points[3 * i + 2] = 0.3 * gnp_random_normal(&random);
	}
	struct gnp_estimate e = estimate_of(&(struct gnp_cloud){COUNT, points, NULL});
	size_t good = 0;
	for (size_t i = 0; i < COUNT; i++)
		good += fabs(e.values[GNP_NORMALS][3 * i + 2]) > cos(15 * 3.14159265358979 / 180);
	CHECK(good >= 0.97 * COUNT);
	gnp_estimate_clear(&e);
}

/* Two flat sheets, back to back and nearer than their points, with given normals: each is answered as if alone. */
static void given_normals_tell_sheets_apart(void)
{
	enum { SIDE = 40, COUNT = 2 * SIDE * SIDE };
	static double points[3 * COUNT], normals[3 * COUNT];
	struct gnp_random random;
	gnp_random_seed(&random, 9, 0);
	for (size_t i = 0; i < COUNT; i++) {
		double side = i < COUNT / 2 ? 1 : -1, *p = points + 3 * i;
		p[0] = (double)(i % SIDE) + 0.6 * gnp_random_uniform(&random);
		p[1] = (double)(i / SIDE % SIDE) + 0.6 * gnp_random_uniform(&random);
		p[2] = 0.5 * side;
		normals[3 * i + 2] = side;
	}
	struct gnp_estimate e = estimate_of(&(struct gnp_cloud){COUNT, points, normals});
	size_t right = 0;
	for (size_t i = 0; i < COUNT; i++)
		right += e.values[GNP_NORMALS][3 * i + 2] * normals[3 * i + 2] > 0.98;
	CHECK(right >= 0.98 * COUNT);
	gnp_estimate_clear(&e);
}

/* ---- What answers must not depend on ---- */

static bool same_bytes(const struct gnp_estimate *a, const struct gnp_estimate *b)
{
	bool same = a->count == b->count && a->patches == b->patches && a->outliers == b->outliers;
	for (int q = 0; q < GNP_QUANTITY_COUNT && same; q++) {
		size_t width = gnp_estimate_width((enum gnp_quantity)q, a->basis_size);
		same = memcmp(a->values[q], b->values[q], a->count * width * sizeof(double)) == 0;
	}
	return same;
}

static void any_number_of_workers_gives_the_same_bytes(void)
{
	struct gnp_sample sample = sample_of(
		"torus", (struct gnp_sample_options){.count = 3000, .seed = 7, .noise = 2e-3, .outlier_fraction = 0.1,
		                                     .outlier_noise = 0.05});
	struct gnp_cloud cloud = {sample.count, sample.points, NULL};
	for (int cover = GNP_COVER_COVER; cover <= GNP_COVER_ALL; cover++) {
		struct gnp_estimate_options options = defaults();
		struct gnp_estimate first = {0};
		options.cover = cover;
		for (unsigned workers = 1; workers <= 3; workers++) {
			struct gnp_pool *mine = NULL;
			CHECK(gnp_pool_create(workers, &mine, NULL) == GNP_OK);
			struct gnp_estimate e = estimate_by(&cloud, &options, mine);
			if (workers == 1)
				first = e;
			else {
				CHECK(same_bytes(&first, &e));
				gnp_estimate_clear(&e);
			}
			gnp_pool_free(mine);
		}
		size_t n = sample.count; /* with outliers, pieces are fitted twice */
		CHECK(cover == GNP_COVER_ALL ? first.patches > n : first.patches < 2 * n);
		gnp_estimate_clear(&first);
	}
	gnp_sample_clear(&sample);
}

/* At chosen points the answer is that of cover=all, whose supports are the points' own. */
static void chosen_points_get_what_all_get(void)
{
	enum { AT = 40 };
	struct gnp_sample sample = sample_of("radial", (struct gnp_sample_options){.count = 2000, .seed = 8});
	struct gnp_cloud cloud = {sample.count, sample.points, NULL};
	struct gnp_estimate_options options = defaults();
	uint32_t at[AT];
	options.cover = GNP_COVER_ALL;
	for (size_t i = 0; i < AT; i++)
		at[i] = (uint32_t)(i * sample.count / AT);
	struct gnp_estimate all = estimate_by(&cloud, &options, pool), some = {0};
	CHECK(gnp_estimate_at(&cloud, &options, at, AT, pool, NULL, &some, NULL) == GNP_OK);
	CHECK(some.count == AT && some.patches == AT);
	for (int q = 0; q < GNP_QUANTITY_COUNT; q++) {
		size_t width = gnp_estimate_width((enum gnp_quantity)q, all.basis_size);
		double largest = 1e-300;
		for (size_t i = 0; i < AT * width; i++)
			largest = fmax(largest, fabs(some.values[q][i]));
		for (size_t i = 0; i < AT; i++)
			for (size_t c = 0; c < width; c++) /* batches differ, and with them how products of floats are summed */
				CHECK_NEAR(some.values[q][i * width + c], all.values[q][at[i] * width + c], 1e-3 * largest);
	}
	gnp_estimate_clear(&all);
	gnp_estimate_clear(&some);
	gnp_sample_clear(&sample);
}

static void answers_scale_with_the_cloud(void)
{
	static const double scales[] = {0x1p10, 0x1p-10};
	struct gnp_sample sample = sample_of("torus", (struct gnp_sample_options){.count = 2000, .seed = 8, .noise = 1e-3});
	struct gnp_cloud cloud = {sample.count, sample.points, NULL};
	struct gnp_estimate want = estimate_of(&cloud);
	double *points = malloc(3 * sample.count * sizeof *points);
	for (int s = 0; s < 2; s++) {
		for (size_t i = 0; i < 3 * sample.count; i++)
			points[i] = scales[s] * sample.points[i];
		struct gnp_estimate got = estimate_of(&(struct gnp_cloud){sample.count, points, NULL});
		CHECK(got.patches == want.patches);
		CHECK(memcmp(got.values[GNP_NORMALS], want.values[GNP_NORMALS], 3 * sample.count * sizeof(double)) == 0);
		for (size_t i = 0; i < sample.count; i++)
			CHECK_NEAR(got.values[GNP_MEAN_CURVATURE][i] * scales[s], want.values[GNP_MEAN_CURVATURE][i], 1e-9);
		gnp_estimate_clear(&got);
	}
	free(points);
	gnp_estimate_clear(&want);
	gnp_sample_clear(&sample);
}

/* From the dozen points of the least cloud on. */
static void small_clouds_are_answered(void)
{
	static const size_t counts[] = {12, 13, 47, 48, 49, 143, 145, 431, 433};
	for (size_t k = 0; k < sizeof counts / sizeof *counts; k++) {
		struct gnp_sample sample = sample_of("sphere", (struct gnp_sample_options){.count = counts[k], .seed = 6});
		struct gnp_cloud cloud = {sample.count, sample.points, NULL};
		struct gnp_estimate_options options = defaults();
		options.k = 12;
		struct gnp_estimate e = estimate_by(&cloud, &options, pool);
		for (int q = 0; q < GNP_QUANTITY_COUNT; q++)
			for (size_t i = 0; i < e.count * gnp_estimate_width((enum gnp_quantity)q, e.basis_size); i++)
				CHECK(isfinite(e.values[q][i]));
		if (counts[k] <= 144) /* a support is the whole cloud: there is nothing that an outlier could be off from */
			CHECK(e.outliers == 0);
		gnp_estimate_clear(&e);
		gnp_sample_clear(&sample);
	}
}

static void points_that_all_coincide_are_refused(void)
{
	enum { COUNT = 3000 };
	static double points[3 * COUNT], normals[3 * COUNT];
	struct gnp_estimate e = {0};
	struct gnp_error error = {0};
	struct gnp_estimate_options options = defaults();
	options.k = 12;
	for (size_t i = 0; i < COUNT; i++) {
		points[3 * i] = i < 1400 ? 0.25 : (double)i;
		points[3 * i + 1] = i < 1400 ? 0 : 0.3 * (double)(i % 7);
		normals[3 * i + 2] = 1;
	}
	struct gnp_cloud cloud = {COUNT, points, normals};
	CHECK(gnp_estimate_run(&cloud, &options, pool, NULL, &e, &error) == GNP_DEGENERATE);
	CHECK_CONTAINS(error.text, "coincide at (0.25, 0, 0)");
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(the_default_weighs_nodes_and_says_so), TEST(smooth_surfaces_are_fitted_to_many_digits),
		TEST(edges_are_flagged_and_not_smoothed_over), TEST(noise_is_averaged_and_told_in_errors),
		TEST(rims_and_residuals_are_told_under_noise),
		TEST(scan_lines_get_the_normal_of_their_surface), TEST(given_normals_tell_sheets_apart),
		TEST(any_number_of_workers_gives_the_same_bytes), TEST(chosen_points_get_what_all_get),
		TEST(answers_scale_with_the_cloud), TEST(small_clouds_are_answered), TEST(points_that_all_coincide_are_refused),
	};
	gnp_linalg_init();
	if (gnp_pool_create(2, &pool, NULL) != GNP_OK || gnp_models_load("weights", &models, NULL) != GNP_OK)
		return 1;
	int failed = RUN_TESTS(tests);
	gnp_models_release(models);
	gnp_pool_free(pool);
	return failed;
}
