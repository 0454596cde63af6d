/* Where a weighted model finds many outliers, the rest is estimated again without them. */
#include "core/base/vector.h"
#include "core/estimate/estimate.h"
#include "core/model/models.h"
#include "core/shapes/shapes.h"
#include "tests/unit/test.h"

static struct gnp_pool *pool;
static struct gnp_models *models; /* the shipped ones; tests run in the repository's root */

static struct gnp_estimate estimate_of(size_t count, const double *points, const double *normals)
{
	struct gnp_estimate_options options = gnp_estimate_defaults();
	struct gnp_estimate estimate = {0};
	struct gnp_error error = {0};
	options.estimator = GNP_ESTIMATOR_GNP;
	options.quantities = GNP_QUANTITY_ALL;
	options.models = models;
	gnp_status status =
		gnp_estimate_run(&(struct gnp_cloud){count, points, normals}, &options, pool, NULL, &estimate, &error);
	if (status != GNP_OK) {
		fprintf(stderr, "%s\n", error.text);
		exit(1);
	}
	return estimate;
}

static struct gnp_sample torus_with(double share)
{
	struct gnp_shape *shape = NULL;
	struct gnp_sample sample = {0};
	struct gnp_sample_options options = {.count = 6000, .seed = 4, .outlier_fraction = share, .outlier_noise = 0.03};
	CHECK(gnp_shape_create("torus", 1, 0, &shape, NULL) == GNP_OK);
	CHECK(gnp_sample_create(shape, &options, pool, NULL, &sample, NULL) == GNP_OK);
	gnp_shape_free(shape);
	return sample;
}

/* Of the rows (NULL: all): root mean square angle of normals to lines, in degrees. */
static double angle_of(const struct gnp_estimate *e, const double *truth, const unsigned char *left_out)
{
	double sum = 0, count = 0;
	for (size_t i = 0; i < e->count; i++) {
		if (left_out[i])
			continue;
		double angle = acos(fmin(1, fabs(gnp_dot(e->values[GNP_NORMALS] + 3 * i, truth + 3 * i))));
		sum += angle * angle;
		count++;
	}
	return 180 / 3.14159265358979 * sqrt(sum / count);
}

/* The rows of `from` that the marks leave, of `width` numbers. */
static size_t take_left(const double *from, const double *marks, size_t count, size_t width, double *to)
{
	size_t made = 0;
	for (size_t i = 0; i < count; i++)
		if (marks[i] == 0)
			memcpy(to + width * made++, from + width * i, width * sizeof *to);
	return made;
}

/* What outliers bend is the fit they take part in: without them the good points' normals are as in a clean cloud. */
static void outliers_do_not_bend_the_others(void)
{
	struct gnp_sample clean = torus_with(0), sample = torus_with(0.1);
	struct gnp_estimate best = estimate_of(clean.count, clean.points, NULL);
	struct gnp_estimate e = estimate_of(sample.count, sample.points, NULL);
	CHECK(best.patches < clean.count && e.patches > best.patches);
	CHECK_AT_MOST(angle_of(&best, clean.normals, clean.outlier), 0.02);
	CHECK_AT_MOST(angle_of(&e, sample.normals, sample.outlier), 0.5);
	gnp_estimate_clear(&best);
	gnp_estimate_clear(&e);
	gnp_sample_clear(&clean);
	gnp_sample_clear(&sample);
}

static void kept_points_get_what_they_would_alone(bool given)
{
	struct gnp_sample sample = torus_with(0.1);
	size_t n = sample.count;
	double *points = malloc(3 * n * sizeof *points), *normals = given ? malloc(3 * n * sizeof *normals) : NULL;
	double *want = malloc(9 * n * sizeof *want), *marks = malloc(n * sizeof *marks);
	struct gnp_estimate e = estimate_of(n, sample.points, given ? sample.normals : NULL);
	/* Whom the first pass left out is not told: of what is marked in the end, none was estimated again. */
	memcpy(marks, e.values[GNP_OUTLIER], n * sizeof *marks);
	size_t left = take_left(sample.points, marks, n, 3, points);
	CHECK(n - left == e.outliers && e.outliers > n / 20 && e.outliers < n / 8);
	if (given)
		take_left(sample.normals, marks, n, 3, normals);
	struct gnp_estimate alone = estimate_of(left, points, normals);
	CHECK(alone.outliers < left / 100);
	CHECK(take_left(e.values[GNP_NORMALS], marks, n, 3, want) == left);
	size_t off = 0;
	for (size_t i = 0; i < left; i++)
		off += gnp_dot(want + 3 * i, alone.values[GNP_NORMALS] + 3 * i) < cos(0.01);
	CHECK(off < left / 50); /* a few more outliers are found the second time, which moves their neighbours */
	gnp_estimate_clear(&e);
	gnp_estimate_clear(&alone);
	free(points);
	free(normals);
	free(want);
	free(marks);
	gnp_sample_clear(&sample);
}

static void kept_points_get_what_they_would_alone_with_estimated_normals(void)
{
	kept_points_get_what_they_would_alone(false);
}

static void kept_points_get_what_they_would_alone_with_given_normals(void)
{
	kept_points_get_what_they_would_alone(true);
}

/* Outliers keep an answer too: every row of every quantity is a number. */
static void every_row_is_filled(void)
{
	struct gnp_sample sample = torus_with(0.2);
	struct gnp_estimate e = estimate_of(sample.count, sample.points, NULL);
	size_t missing = 0;
	for (int q = 0; q < GNP_QUANTITY_COUNT; q++) {
		size_t width = gnp_estimate_width((enum gnp_quantity)q, e.basis_size);
		for (size_t i = 0; e.values[q] && i < e.count * width; i++)
			missing += !isfinite(e.values[q][i]);
	}
	CHECK(missing == 0);
	gnp_estimate_clear(&e);
	gnp_sample_clear(&sample);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(outliers_do_not_bend_the_others),
		TEST(kept_points_get_what_they_would_alone_with_estimated_normals),
		TEST(kept_points_get_what_they_would_alone_with_given_normals),
		TEST(every_row_is_filled),
	};
	CHECK(gnp_pool_create(2, &pool, NULL) == GNP_OK);
	CHECK(gnp_models_load("weights", &models, NULL) == GNP_OK);
	int failed = RUN_TESTS(tests);
	gnp_models_release(models);
	gnp_pool_free(pool);
	return failed;
}
