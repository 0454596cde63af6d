#include "core/operators/laplacian.h"
#include "tests/oracles/manufactured.h"
#include "tests/unit/test.h"

static struct gnp_pool *pool;

enum { ALL = (1 << GNP_DERIVATIVE_STIFFNESS) - 1 }; /* of collocation */

static struct gnp_laplacian_options options_of(unsigned which)
{
	struct gnp_laplacian_options options = gnp_laplacian_defaults();
	options.domain.estimate.cover = GNP_COVER_ALL;
	options.which = which;
	return options;
}

static struct gnp_collocation matrices_of(const struct gnp_sample *sample, const struct gnp_laplacian_options *options)
{
	const struct gnp_cloud cloud = {sample->count, sample->points, sample->normals};
	struct gnp_collocation made = {.rows = 0};
	struct gnp_error error = {0};
	if (gnp_laplacian_run(&cloud, options, pool, NULL, &made, NULL, &error) != GNP_OK) {
		fprintf(stderr, "%s\n", error.text);
		CHECK(!"the matrices were made");
	}
	return made;
}

/* Values at kept points in, at all points out. */
static void apply(const struct gnp_collocation *made, enum gnp_derivative which, const double *values, double *out)
{
	struct gnp_csr matrix = gnp_collocation_view(made, which);
	double *kept = malloc(made->columns * sizeof *kept);
	for (size_t c = 0; c < made->columns; c++)
		kept[c] = values[made->kept[c]];
	CHECK(gnp_csr_multiply(&matrix, kept, out, pool, NULL, NULL) == GNP_OK);
	free(kept);
}

struct errors {
	double value, laplacian, gradient, divergence;
};

/* The divergence is that of grad U + 3 n, whose normal part must not matter but for the error of the estimated normals. */
static struct errors errors_of(const char *shape, size_t count, const struct gnp_laplacian_options *options)
{
	struct gnp_sample sample = sample_of(shape, &(struct gnp_sample_options){.count = count, .seed = 7}, pool);
	struct gnp_collocation made = matrices_of(&sample, options);
	double *block = malloc(10 * count * sizeof *block), *value = block, *laplacian = block + count, *gradient = block + 2 * count,
	       *field = block + 5 * count, *got = block + 8 * count, *sum = block + 9 * count;
	for (size_t i = 0; i < count; i++) {
		struct manufactured at = manufactured_of(&sample, i);
		value[i] = at.value;
		laplacian[i] = at.laplacian;
		sum[i] = 0;
		for (int c = 0; c < 3; c++) {
			gradient[(size_t)c * count + i] = at.gradient[c];
			field[(size_t)c * count + i] = at.gradient[c] + 3 * sample.normals[3 * i + c];
		}
	}
	struct errors errors = {0};
	apply(&made, GNP_DERIVATIVE_VALUE, value, got);
	errors.value = relative_error(got, value, count);
	apply(&made, GNP_DERIVATIVE_LAPLACIAN, value, got);
	errors.laplacian = relative_error(got, laplacian, count);
	for (int c = 0; c < 3; c++) {
		apply(&made, GNP_DERIVATIVE_GRADIENT_X + c, value, got);
		errors.gradient = fmax(errors.gradient, relative_error(got, gradient + (size_t)c * count, count));
		apply(&made, GNP_DERIVATIVE_DIVERGENCE_X + c, field + (size_t)c * count, got);
		for (size_t i = 0; i < count; i++)
			sum[i] += got[i];
	}
	errors.divergence = relative_error(sum, laplacian, count);
	free(block);
	gnp_collocation_clear(&made);
	gnp_sample_clear(&sample);
	return errors;
}

static void derivatives_are_those_of_the_surface(void)
{
	static const char *const shapes[] = {"sphere", "torus", "bumpy_torus"};
	static const double limits[] = {1e-4, 2e-4, 5e-3};
	struct gnp_laplacian_options options = options_of(ALL);
	for (int s = 0; s < 3; s++) {
		struct errors errors = errors_of(shapes[s], 10000, &options);
		CHECK_AT_MOST(errors.value, limits[s] / 50);
		CHECK_AT_MOST(errors.gradient, limits[s]);
		CHECK_AT_MOST(errors.laplacian, limits[s]);
		CHECK_AT_MOST(errors.divergence, 5 * limits[s]);
	}
}

static void the_laplacian_converges_with_order_three(void)
{
	struct gnp_laplacian_options options = options_of(ALL);
	struct errors coarse = errors_of("torus", 4000, &options), fine = errors_of("torus", 16000, &options);
	CHECK_AT_MOST(fine.laplacian, coarse.laplacian / 7);
	CHECK_AT_MOST(fine.gradient, coarse.gradient / 7);
}

static void lower_degrees_are_less_accurate_and_the_first_has_no_laplacian(void)
{
	struct gnp_laplacian_options options = options_of(ALL);
	double before = 0;
	for (options.degree = 4; options.degree >= 2; options.degree--) {
		struct errors errors = errors_of("torus", 5000, &options);
		CHECK(errors.laplacian > 3 * before);
		before = errors.laplacian;
	}
	options.degree = 1;
	options.which = GNP_DERIVATIVE_BIT(GNP_DERIVATIVE_GRADIENT_X);
	struct gnp_sample sample = sample_of("torus", &(struct gnp_sample_options){.count = 2000, .seed = 7}, pool);
	struct gnp_collocation made = matrices_of(&sample, &options);
	CHECK(made.value[GNP_DERIVATIVE_GRADIENT_X] && !made.value[GNP_DERIVATIVE_LAPLACIAN]);
	gnp_collocation_clear(&made);
	gnp_sample_clear(&sample);
}

/* All points collocate, nine tenths carry unknowns, and constants are flat. */
static void least_squares_drops_a_tenth_of_the_unknowns(void)
{
	struct gnp_laplacian_options options = options_of(ALL);
	struct gnp_sample sample = sample_of("torus", &(struct gnp_sample_options){.count = 5000, .seed = 7}, pool);
	options.system = GNP_SYSTEM_LEAST_SQUARES;
	struct gnp_collocation made = matrices_of(&sample, &options);
	CHECK(made.rows == 5000 && made.columns == 4500 && made.reduced == 0);
	for (size_t c = 1; c < made.columns; c++)
		CHECK(made.kept[c] > made.kept[c - 1] && made.kept[c] < made.rows);
	for (size_t i = 0; i < made.rows; i++) {
		double sum = 0, size = 0;
		for (size_t e = made.row_offsets[i]; e < made.row_offsets[i + 1]; e++) {
			sum += made.value[GNP_DERIVATIVE_LAPLACIAN][e];
			size += fabs(made.value[GNP_DERIVATIVE_LAPLACIAN][e]);
			CHECK(e == made.row_offsets[i] || made.column[e] > made.column[e - 1]);
		}
		CHECK_AT_MOST(fabs(sum), 1e-10 * size);
	}
	CHECK_AT_MOST(errors_of("torus", 5000, &options).laplacian, 2e-3);
	gnp_collocation_clear(&made);
	gnp_sample_clear(&sample);
}

/* Two spheres back to back, about as near as their points are spaced, facing away from each other: no stencil may join them. */
static void sheets_are_not_joined(void)
{
	enum { N = 3000 };
	struct gnp_sample sample = sample_of("sphere", &(struct gnp_sample_options){.count = N, .seed = 7}, pool);
	double *points = malloc(6 * N * sizeof *points), *normals = malloc(6 * N * sizeof *normals);
	for (size_t i = 0; i < 3 * N; i++) {
		points[i] = sample.points[i];
		normals[i] = sample.normals[i];
		points[3 * N + i] = 0.93 * sample.points[i];
		normals[3 * N + i] = -sample.normals[i];
	}
	struct gnp_laplacian_options options = options_of(GNP_DERIVATIVE_BIT(GNP_DERIVATIVE_LAPLACIAN));
	options.domain.estimate.estimator = GNP_ESTIMATOR_ADAPTIVE;
	struct gnp_sample both = {.count = 2 * N, .points = points, .normals = normals};
	struct gnp_collocation made = matrices_of(&both, &options);
	size_t joined = 0;
	for (size_t i = 0; i < made.rows; i++)
		for (size_t e = made.row_offsets[i]; e < made.row_offsets[i + 1]; e++)
			joined += (i < N) != (made.column[e] < N);
	CHECK(joined == 0);
	gnp_collocation_clear(&made);
	gnp_sample_clear(&sample);
	free(points);
	free(normals);
}

static void any_number_of_workers_gives_the_same_bytes(void)
{
	struct gnp_sample sample = sample_of("bumpy_torus", &(struct gnp_sample_options){.count = 3000, .seed = 7}, pool);
	const struct gnp_cloud cloud = {sample.count, sample.points, sample.normals};
	struct gnp_laplacian_options options = options_of(ALL);
	options.system = GNP_SYSTEM_LEAST_SQUARES;
	struct gnp_collocation first = matrices_of(&sample, &options), again;
	for (unsigned workers = 1; workers <= 3; workers += 2) {
		struct gnp_pool *some;
		CHECK(gnp_pool_create(workers, &some, NULL) == GNP_OK);
		CHECK(gnp_laplacian_run(&cloud, &options, some, NULL, &again, NULL, NULL) == GNP_OK);
		CHECK(memcmp(first.column, again.column, first.row_offsets[first.rows] * sizeof *first.column) == 0);
		for (int d = 0; d < GNP_DERIVATIVE_STIFFNESS; d++)
			CHECK(memcmp(first.value[d], again.value[d], first.row_offsets[first.rows] * sizeof(double)) == 0);
		gnp_collocation_clear(&again);
		gnp_pool_free(some);
	}
	gnp_collocation_clear(&first);
	gnp_sample_clear(&sample);
}

static void refuse(const struct gnp_cloud *cloud, const struct gnp_laplacian_options *options, gnp_status status, const char *text)
{
	struct gnp_collocation made = {.rows = 0};
	struct gnp_error error = {0};
	CHECK(gnp_laplacian_run(cloud, options, pool, NULL, &made, NULL, &error) == status);
	CHECK_CONTAINS(error.text, text);
	CHECK(!made.row_offsets);
}

static void bad_options_and_clouds_are_refused_by_name(void)
{
	struct gnp_sample sample = sample_of("sphere", &(struct gnp_sample_options){.count = 500, .seed = 7}, pool);
	struct gnp_cloud cloud = {sample.count, sample.points, sample.normals}, few = {29, sample.points, NULL};
	struct gnp_laplacian_options good = options_of(GNP_DERIVATIVE_BIT(GNP_DERIVATIVE_LAPLACIAN)), o = good;
	o.degree = 1;
	refuse(&cloud, &o, GNP_INVALID_ARGUMENT, "degree: got 1, need 2..7");
	o.degree = 8;
	refuse(&cloud, &o, GNP_INVALID_ARGUMENT, "degree: got 8, need 1..7");
	o = good;
	o.drop = 0.6;
	refuse(&cloud, &o, GNP_INVALID_ARGUMENT, "drop: got 0.6, need 0..0.5");
	o.drop = NAN;
	refuse(&cloud, &o, GNP_INVALID_ARGUMENT, "drop: got ");
	o = good;
	o.degree = 4;
	o.neighbors = 14;
	refuse(&cloud, &o, GNP_INVALID_ARGUMENT, "neighbors: got 14, need at least 15 for degree 4");
	o.neighbors = -1;
	refuse(&cloud, &o, GNP_INVALID_ARGUMENT, "neighbors: got -1, need 0..500");
	o = good;
	o.system = 7;
	refuse(&cloud, &o, GNP_INVALID_ARGUMENT, "system: got 7, need 0..3");
	o.system = GNP_SYSTEM_SYMMETRIC;
	o.which = GNP_DERIVATIVE_BIT(GNP_DERIVATIVE_GRADIENT_X);
	refuse(&cloud, &o, GNP_INVALID_ARGUMENT, "outputs: got gradient_x, which system=symmetric does not have");
	o = good;
	o.domain.estimate.k = 5;
	refuse(&cloud, &o, GNP_INVALID_ARGUMENT, "k: got 5, need 12..500");
	refuse(&few, &good, GNP_INVALID_ARGUMENT, "points: got 29, need at least 30");
	gnp_sample_clear(&sample);
}

/* A sphere of `count` points, whose every tenth is moved off it. */
static double *spoilt_sphere(size_t count)
{
	double *points = malloc(3 * count * sizeof *points);
	for (size_t i = 0; i < count; i++) {
		double z = 1 - (2 * (double)i + 1) / (double)count, r = sqrt(1 - z * z), a = 2.39996323 * (double)i, off = i % 10 == 3 ? 1.3 : 1;
		points[3 * i] = off * r * cos(a);
		points[3 * i + 1] = off * r * sin(a);
		points[3 * i + 2] = off * z;
	}
	return points;
}

/* Rows were once written by indices of the whole cloud into the matrix of what was left of it, past its end. */
static void rows_of_points_that_the_filter_drops_are_empty(void)
{
	for (size_t count = 120; count <= 3000; count *= 5) {
		double *points = spoilt_sphere(count);
		const struct gnp_cloud cloud = {count, points, NULL};
		struct gnp_filter_options filter = gnp_filter_defaults();
		struct gnp_filter kept;
		struct gnp_error error = {0};
		struct gnp_collocation made = {.rows = 0};
		CHECK(gnp_filter_run(&cloud, &filter, pool, NULL, &kept, &error) == GNP_OK && kept.kept < count);
		for (int system = GNP_SYSTEM_SQUARE; system <= GNP_SYSTEM_LEAST_SQUARES; system++) {
			struct gnp_laplacian_options options = options_of(GNP_DERIVATIVE_BIT(GNP_DERIVATIVE_LAPLACIAN));
			options.domain.filter = &filter;
			options.system = system;
			CHECK(gnp_laplacian_run(&cloud, &options, pool, NULL, &made, NULL, &error) == GNP_OK);
			CHECK(made.rows == count && (system == GNP_SYSTEM_SQUARE ? made.columns == kept.kept : made.columns < kept.kept));
			for (size_t i = 0; i < made.rows; i++)
				CHECK((made.row_offsets[i + 1] > made.row_offsets[i]) == kept.keep[i]);
			for (size_t c = 0; c < made.columns; c++)
				CHECK(kept.keep[made.kept[c]] && (c == 0 || made.kept[c] > made.kept[c - 1]));
			for (size_t e = 0; e < made.row_offsets[made.rows]; e++)
				CHECK(made.column[e] < made.columns);
			gnp_collocation_clear(&made);
		}
		gnp_filter_clear(&kept);
		free(points);
	}
}

/* Stencils of a lattice, whose points lie on top of one another in any tangent plane, and of turned normals, where centres are without an unknown:
 * rows had sums of a thousandth and more of their entries. */
static void the_laplacian_of_a_constant_is_none_on_any_cloud(void)
{
	enum { SIDE = 6, COUNT = SIDE * SIDE * SIDE };
	double points[3 * COUNT], normals[3 * COUNT];
	struct gnp_error error = {0};
	for (size_t i = 0; i < COUNT; i++) {
		points[3 * i] = (double)(i % SIDE), points[3 * i + 1] = (double)(i / SIDE % SIDE), points[3 * i + 2] = (double)(i / SIDE / SIDE);
		for (size_t c = 0; c < 3; c++)
			normals[3 * i + c] = sin(1.7 * (double)(3 * i + c) + 0.3);
	}
	for (int given = 0; given < 2; given++)
		for (int system = GNP_SYSTEM_SQUARE; system <= GNP_SYSTEM_LEAST_SQUARES; system++) {
			const struct gnp_cloud cloud = {COUNT, points, given ? normals : NULL};
			struct gnp_laplacian_options options = options_of(GNP_DERIVATIVE_BIT(GNP_DERIVATIVE_LAPLACIAN));
			struct gnp_collocation made = {.rows = 0};
			options.system = system;
			CHECK(gnp_laplacian_run(&cloud, &options, pool, NULL, &made, NULL, &error) == GNP_OK);
			for (size_t i = 0; i < made.rows; i++) {
				double sum = 0, size = 0;
				for (size_t e = made.row_offsets[i]; e < made.row_offsets[i + 1]; e++) {
					sum += made.value[GNP_DERIVATIVE_LAPLACIAN][e];
					size += fabs(made.value[GNP_DERIVATIVE_LAPLACIAN][e]);
				}
				CHECK_AT_MOST(fabs(sum), 1e-7 * size);
			}
			gnp_collocation_clear(&made);
		}
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(derivatives_are_those_of_the_surface),
	                                    TEST(the_laplacian_converges_with_order_three),
	                                    TEST(lower_degrees_are_less_accurate_and_the_first_has_no_laplacian),
	                                    TEST(least_squares_drops_a_tenth_of_the_unknowns), TEST(sheets_are_not_joined),
	                                    TEST(rows_of_points_that_the_filter_drops_are_empty),
	                                    TEST(the_laplacian_of_a_constant_is_none_on_any_cloud),
	                                    TEST(any_number_of_workers_gives_the_same_bytes),
	                                    TEST(bad_options_and_clouds_are_refused_by_name)};
	if (gnp_pool_create(0, &pool, NULL) != GNP_OK)
		return 1;
	int status = RUN_TESTS(tests);
	gnp_pool_free(pool);
	return status;
}
