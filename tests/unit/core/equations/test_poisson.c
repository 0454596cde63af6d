#include "core/equations/poisson.h"
#include "core/linear/linalg.h"
#include "core/operators/energy.h"
#include "tests/oracles/manufactured.h"
#include "tests/unit/test.h"

static struct gnp_pool *pool;

static struct gnp_poisson_options options_of(int system, int solver)
{
	struct gnp_poisson_options options = gnp_poisson_defaults();
	options.laplacian.domain.estimate.cover = GNP_COVER_ALL;
	options.laplacian.system = system;
	options.solver = solver;
	return options;
}

static struct gnp_poisson *prepare(const struct gnp_cloud *cloud, const struct gnp_poisson_options *options)
{
	struct gnp_poisson *poisson = NULL;
	struct gnp_error error = {0};
	if (gnp_poisson_prepare(cloud, options, pool, NULL, &poisson, &error) != GNP_OK)
		fprintf(stderr, "%s\n", error.text);
	CHECK(poisson);
	return poisson;
}

static struct gnp_cloud cloud_of(const struct gnp_sample *sample)
{
	return (struct gnp_cloud){sample->count, sample->points, sample->normals};
}

/* value and f = alpha u - Delta u of the manufactured function. */
static void truth_of(const struct gnp_sample *sample, double alpha, double *value, double *source)
{
	for (size_t i = 0; i < sample->count; i++) {
		struct manufactured at = manufactured_of(sample, i);
		value[i] = at.value;
		source[i] = alpha * at.value - at.laplacian;
	}
}

static double error_on(const char *shape, size_t count, const struct gnp_poisson_options *options, struct gnp_poisson_report *report)
{
	struct gnp_sample sample = sample_of(shape, &(struct gnp_sample_options){.count = count, .seed = 7}, pool);
	struct gnp_cloud cloud = cloud_of(&sample);
	struct gnp_poisson *poisson = prepare(&cloud, options);
	double *value = malloc(3 * count * sizeof *value), *source = value + count, *solution = value + 2 * count, error = INFINITY;
	truth_of(&sample, options->screening, value, source);
	if (poisson) {
		CHECK(gnp_poisson_solve(poisson, source, NULL, 1, pool, NULL, solution, report, NULL) == GNP_OK);
		error = options->screening > 0 ? relative_error(solution, value, count) : relative_error_without_mean(solution, value, count);
	}
	gnp_poisson_release(poisson);
	gnp_sample_clear(&sample);
	free(value);
	return error;
}

static void every_system_and_solver_finds_the_manufactured_solution(void)
{
	static const char *const shapes[] = {"sphere", "torus", "genus2"};
	static const double limits[] = {5e-5, 2e-4, 2e-3};
	for (int s = 0; s < 3; s++)
		for (int system = GNP_SYSTEM_SQUARE; system <= GNP_SYSTEM_LEAST_SQUARES; system++)
			for (int solver = GNP_SOLVER_DIRECT; solver <= GNP_SOLVER_ITERATIVE; solver++) {
				struct gnp_poisson_options options = options_of(system, solver);
				struct gnp_poisson_report report;
				CHECK_AT_MOST(error_on(shapes[s], 8000, &options, &report), limits[s]);
				CHECK_AT_MOST(report.residual, solver == GNP_SOLVER_DIRECT ? 1e-9 : 1e-8);
				CHECK_AT_MOST((double)report.iterations, solver == GNP_SOLVER_DIRECT ? 2 : 120);
				CHECK_AT_MOST(report.misfit, system == GNP_SYSTEM_SQUARE ? 1e-7 : 1e-2);
				CHECK_NEAR(report.energy, 1, 0.02);
			}
}

/* Where GMRES stops once hung on the unit of f: it held the length of a vector without a unit against that of a residual. */
static void the_unit_of_the_source_changes_neither_iterations_nor_residual(void)
{
	enum { COUNT = 4000 };
	static const double factors[] = {1, 0x1p66, 0x1p-66, 1e20, 1e-20, 1e30, 1e-30, 0x1p550, 0x1p-550};
	struct gnp_sample sample = sample_of("torus", &(struct gnp_sample_options){.count = COUNT, .seed = 7}, pool);
	struct gnp_cloud cloud = cloud_of(&sample);
	double *value = malloc(4 * COUNT * sizeof *value), *source = value + COUNT, *scaled = value + 2 * COUNT, *solution = value + 3 * COUNT;
	truth_of(&sample, 1, value, source);
	for (int system = GNP_SYSTEM_SQUARE; system <= GNP_SYSTEM_LEAST_SQUARES; system++) {
		struct gnp_poisson_options options = options_of(system, GNP_SOLVER_ITERATIVE);
		struct gnp_poisson_report first = {.residual = 0}, report;
		options.screening = 1;
		options.tolerance = 1e-11;
		struct gnp_poisson *poisson = prepare(&cloud, &options);
		for (size_t f = 0; f < sizeof factors / sizeof *factors && poisson; f++) {
			for (size_t i = 0; i < COUNT; i++)
				scaled[i] = factors[f] * source[i];
			CHECK(gnp_poisson_solve(poisson, scaled, NULL, 1, pool, NULL, solution, &report, NULL) == GNP_OK);
			if (f == 0)
				first = report;
			CHECK(report.iterations == first.iterations);
			/* what is rounded shows near the tolerance */
			CHECK_NEAR(report.residual / first.residual, 1, frexp(factors[f], &(int){0}) == 0.5 ? 0 : 0.5);
		}
		gnp_poisson_release(poisson);
	}
	free(value);
	gnp_sample_clear(&sample);
}

static void the_solution_converges_with_order_three(void)
{
	struct gnp_poisson_options options = options_of(GNP_SYSTEM_SQUARE, GNP_SOLVER_AUTO);
	struct gnp_poisson_report report;
	double coarse = error_on("torus", 4000, &options, &report), fine = error_on("torus", 16000, &options, &report);
	CHECK_AT_MOST(fine, coarse / 8);
}

static void a_screened_equation_keeps_its_mean(void)
{
	for (int system = GNP_SYSTEM_SQUARE; system <= GNP_SYSTEM_LEAST_SQUARES; system++)
		for (int solver = GNP_SOLVER_DIRECT; solver <= GNP_SOLVER_ITERATIVE; solver++) {
			struct gnp_poisson_options options = options_of(system, solver);
			struct gnp_poisson_report report;
			options.screening = 3;
			CHECK_AT_MOST(error_on("torus", 6000, &options, &report), 2e-4);
			CHECK(report.mean == 0 && !report.mean_removed);
			CHECK_NEAR(report.energy, 1, 0.02);
		}
}

/* Too few points for so rough a surface, and noise on them: the solution is several times too large, and its energy says so. */
static void an_unresolved_cloud_is_told_by_the_energy(void)
{
	enum { N = 3000 };
	struct gnp_shape *shape = NULL;
	struct gnp_sample sample;
	struct gnp_poisson_options options = options_of(GNP_SYSTEM_SQUARE, GNP_SOLVER_AUTO);
	struct gnp_poisson_report report;
	double *value = malloc(3 * N * sizeof *value), *source = value + N, *solution = value + 2 * N;
	options.laplacian.domain.project = true;
	CHECK(gnp_shape_create("radial", 1, 22, &shape, NULL) == GNP_OK);
	CHECK(gnp_sample_create(shape, &(struct gnp_sample_options){.count = N, .seed = 3, .noise = 1e-3}, pool, NULL, &sample, NULL) == GNP_OK);
	struct gnp_cloud cloud = cloud_of(&sample);
	truth_of(&sample, 0, value, source);
	struct gnp_poisson *poisson = prepare(&cloud, &options);
	CHECK(gnp_poisson_solve(poisson, source, NULL, 1, pool, NULL, solution, &report, NULL) == GNP_OK);
	CHECK(relative_error_without_mean(solution, value, N) > 1);
	CHECK(!(report.energy >= GNP_ENERGY_LEAST && report.energy <= GNP_ENERGY_MOST));
	gnp_poisson_release(poisson);
	gnp_sample_clear(&sample);
	gnp_shape_free(shape);
	free(value);
}

/* Half of the torus is given: the other half must fit on to it. */
static void fixed_points_keep_their_values(void)
{
	enum { N = 6000 };
	struct gnp_sample sample = sample_of("torus", &(struct gnp_sample_options){.count = N, .seed = 7}, pool);
	struct gnp_cloud cloud = cloud_of(&sample);
	double *value = malloc(3 * N * sizeof *value), *source = value + N, *solution = value + 2 * N;
	unsigned char *fixed = malloc(N);
	truth_of(&sample, 0, value, source);
	for (size_t i = 0; i < N; i++) {
		fixed[i] = sample.points[3 * i] > 0.3;
		source[i] = fixed[i] ? NAN : source[i]; /* not read */
	}
	for (int system = GNP_SYSTEM_SQUARE; system <= GNP_SYSTEM_LEAST_SQUARES; system++)
		for (int solver = GNP_SOLVER_DIRECT; solver <= GNP_SOLVER_ITERATIVE; solver++) {
			struct gnp_poisson_options options = options_of(system, solver);
			struct gnp_error error = {0};
			options.fixed = fixed;
			struct gnp_poisson *poisson = prepare(&cloud, &options);
			CHECK(gnp_poisson_info(poisson).components == 0);
			CHECK(gnp_poisson_solve(poisson, source, value, 1, pool, NULL, solution, NULL, NULL) == GNP_OK);
			CHECK_AT_MOST(relative_error(solution, value, N), 2e-4);
			for (size_t i = 0; i < N; i++)
				CHECK(!fixed[i] || fabs(solution[i] - value[i]) < 1e-6);
			CHECK(gnp_poisson_solve(poisson, source, NULL, 1, pool, NULL, solution, NULL, &error) == GNP_INVALID_ARGUMENT);
			CHECK_STRING(error.text, "values: got none, need those of the fixed points");
			gnp_poisson_release(poisson);
		}
	gnp_sample_clear(&sample);
	free(value);
	free(fixed);
}

/* Two spheres far apart, of different radii, and a few isolated points between them. */
static void each_part_of_a_cloud_has_a_mean_of_its_own(void)
{
	enum { N = 3000, ALONE = 5, ALL = 2 * N + ALONE };
	struct gnp_sample sample = sample_of("sphere", &(struct gnp_sample_options){.count = N, .seed = 7}, pool);
	double *points = malloc(6 * ALL * sizeof *points), *normals = points + 3 * ALL, *source = malloc(2 * ALL * sizeof *source), *solution = source + ALL;
	for (size_t i = 0; i < ALL; i++) {
		size_t from = i % N;
		double radius = i < N ? 1 : 2;
		for (int c = 0; c < 3; c++) {
			points[3 * i + c] = radius * sample.points[3 * from + c] + (c == 0 && i >= N ? 50 : 0);
			normals[3 * i + c] = sample.normals[3 * from + c];
		}
		if (i >= 2 * N) {
			points[3 * i] = 20 + (double)(i - 2 * N);
			points[3 * i + 1] = points[3 * i + 2] = 0.1 * (double)(i % 2);
		}
		source[i] = i < N ? 2 * points[3 * i + 2] + 5 : i < 2 * N ? points[3 * i + 2] / 2 - 7 : 0; /* u = z + const on both */
	}
	struct gnp_cloud cloud = {ALL, points, normals};
	for (int alone = 0; alone <= 1; alone++) {
		struct gnp_poisson_options options = options_of(GNP_SYSTEM_SQUARE, GNP_SOLVER_DIRECT);
		struct gnp_poisson_report report;
		cloud.count = alone ? ALL : 2 * N;
		struct gnp_poisson *poisson = prepare(&cloud, &options);
		struct gnp_poisson_info info = gnp_poisson_info(poisson);
		CHECK(info.components == 2 && info.isolated == (alone ? ALONE : 0));
		CHECK(gnp_poisson_solve(poisson, source, NULL, 1, pool, NULL, solution, &report, NULL) == GNP_OK);
		CHECK(report.mean_removed);
		CHECK_NEAR(report.mean, -7, 0.05);
		for (size_t i = 0; i < 2 * N; i++)
			CHECK_NEAR(solution[i], points[3 * i + 2], 2e-2);
		gnp_poisson_release(poisson);
	}
	gnp_sample_clear(&sample);
	free(points);
	free(source);
}

/* A tenth of the points is 5e-3 off: the filter drops them, and they still get an answer. */
static void outliers_are_dropped_and_answered(void)
{
	enum { N = 20000 };
	const struct gnp_sample_options noisy = {.count = N, .seed = 7, .noise = 0, .outlier_fraction = 0.1, .outlier_noise = 5e-3};
	struct gnp_sample sample = sample_of("torus", &noisy, pool);
	struct gnp_cloud cloud = cloud_of(&sample);
	double *value = malloc(3 * N * sizeof *value), *source = value + N, *solution = value + 2 * N;
	struct gnp_poisson_options options = options_of(GNP_SYSTEM_SQUARE, GNP_SOLVER_DIRECT);
	struct gnp_filter_options filter = gnp_filter_defaults();
	options.laplacian.domain.estimate.estimator = GNP_ESTIMATOR_ADAPTIVE;
	options.laplacian.domain.estimate.cover = GNP_COVER_COVER;
	filter.estimate = options.laplacian.domain.estimate;
	filter.project = true;
	options.laplacian.domain.filter = &filter;
	truth_of(&sample, 0, value, source);
	struct gnp_poisson *poisson = prepare(&cloud, &options);
	struct gnp_poisson_info info = gnp_poisson_info(poisson);
	CHECK(info.dropped > N / 20 && info.unknowns + info.dropped == N);
	CHECK(gnp_poisson_solve(poisson, source, NULL, 1, pool, NULL, solution, NULL, NULL) == GNP_OK);
	CHECK_AT_MOST(relative_error_without_mean(solution, value, N), 1e-2);
	gnp_poisson_release(poisson);
	gnp_sample_clear(&sample);
	free(value);
}

static void the_mean_is_zero_as_asked(void)
{
	enum { N = 4000 };
	struct gnp_sample sample = sample_of("torus", &(struct gnp_sample_options){.count = N, .seed = 7}, pool);
	struct gnp_cloud cloud = cloud_of(&sample);
	double *value = malloc(3 * N * sizeof *value), *source = value + N, *solution = value + 2 * N;
	truth_of(&sample, 0, value, source);
	for (int mean = GNP_MEAN_AREA; mean <= GNP_MEAN_PLAIN; mean++) {
		struct gnp_poisson_options options = options_of(GNP_SYSTEM_SQUARE, GNP_SOLVER_DIRECT);
		double sum = 0;
		options.mean = mean;
		struct gnp_poisson *poisson = prepare(&cloud, &options);
		const struct gnp_domain *domain = gnp_poisson_domain(poisson);
		CHECK(gnp_poisson_solve(poisson, source, NULL, 1, pool, NULL, solution, NULL, NULL) == GNP_OK);
		for (size_t i = 0; i < N; i++)
			sum += (mean == GNP_MEAN_AREA ? domain->area[i] : 1) * solution[domain->prepared.order[i]];
		CHECK_AT_MOST(fabs(sum), 1e-9);
		gnp_poisson_release(poisson);
	}
	gnp_sample_clear(&sample);
	free(value);
}

static void many_right_hand_sides_are_solved_as_one_is(void)
{
	enum { N = 3000, R = 5 };
	struct gnp_sample sample = sample_of("bumpy_torus", &(struct gnp_sample_options){.count = N, .seed = 7}, pool);
	struct gnp_cloud cloud = cloud_of(&sample);
	double *source = malloc(2 * N * R * sizeof *source), *solution = source + N * R, *one = malloc(2 * N * sizeof *one);
	struct gnp_poisson_report reports[R];
	for (size_t i = 0; i < N * R; i++)
		source[i] = sin(3 * sample.points[3 * (i / R)] + (double)(i % R));
	struct gnp_poisson_options options = options_of(GNP_SYSTEM_SQUARE, GNP_SOLVER_DIRECT);
	struct gnp_poisson *poisson = prepare(&cloud, &options);
	CHECK(gnp_poisson_solve(poisson, source, NULL, R, pool, NULL, solution, reports, NULL) == GNP_OK);
	for (size_t r = 0; r < R; r++) {
		for (size_t i = 0; i < N; i++)
			one[i] = source[i * R + r];
		CHECK(gnp_poisson_solve(poisson, one, NULL, 1, pool, NULL, one + N, NULL, NULL) == GNP_OK);
		for (size_t i = 0; i < N; i++)
			CHECK_NEAR(one[N + i], solution[i * R + r], 1e-8);
		CHECK_AT_MOST(reports[r].residual, 1e-10);
	}
	CHECK(gnp_poisson_info(poisson).bytes > N * 500);
	gnp_poisson_release(gnp_poisson_retain(poisson));
	gnp_poisson_release(poisson);
	gnp_sample_clear(&sample);
	free(source);
	free(one);
}

static void any_number_of_workers_gives_the_same_bytes(void)
{
	enum { N = 3000 };
	struct gnp_sample sample = sample_of("torus", &(struct gnp_sample_options){.count = N, .seed = 7}, pool);
	struct gnp_cloud cloud = cloud_of(&sample);
	double *value = malloc(4 * N * sizeof *value), *source = value + N, *first = value + 2 * N, *again = value + 3 * N;
	truth_of(&sample, 0, value, source);
	for (int solver = GNP_SOLVER_DIRECT; solver <= GNP_SOLVER_ITERATIVE; solver++)
		for (unsigned workers = 1; workers <= 3; workers++) {
			struct gnp_poisson_options options = options_of(GNP_SYSTEM_LEAST_SQUARES, solver);
			struct gnp_poisson *poisson = NULL;
			struct gnp_pool *some;
			CHECK(gnp_pool_create(workers, &some, NULL) == GNP_OK);
			CHECK(gnp_poisson_prepare(&cloud, &options, some, NULL, &poisson, NULL) == GNP_OK);
			CHECK(gnp_poisson_solve(poisson, source, NULL, 1, some, NULL, workers == 1 ? first : again, NULL, NULL) == GNP_OK);
			CHECK(workers == 1 || memcmp(first, again, N * sizeof *first) == 0);
			gnp_poisson_release(poisson);
			gnp_pool_free(some);
		}
	gnp_sample_clear(&sample);
	free(value);
}

static void refuse(const struct gnp_cloud *cloud, const struct gnp_poisson_options *options, struct gnp_task *task, gnp_status status,
                   const char *text)
{
	struct gnp_poisson *poisson = NULL;
	struct gnp_error error = {0};
	CHECK(gnp_poisson_prepare(cloud, options, pool, task, &poisson, &error) == status);
	CHECK_CONTAINS(error.text, text);
	CHECK(!poisson);
}

static void bad_input_is_refused_by_name(void)
{
	enum { N = 2000 };
	struct gnp_sample sample = sample_of("sphere", &(struct gnp_sample_options){.count = N, .seed = 7}, pool);
	struct gnp_cloud cloud = cloud_of(&sample);
	struct gnp_poisson_options good = options_of(GNP_SYSTEM_SQUARE, GNP_SOLVER_DIRECT), o = good;
	struct gnp_error error = {0};
	struct gnp_task task;
	o.screening = -INFINITY;
	refuse(&cloud, &o, NULL, GNP_INVALID_ARGUMENT, "screening: got -inf, need a finite number");
	o = good;
	o.tolerance = 0;
	refuse(&cloud, &o, NULL, GNP_INVALID_ARGUMENT, "tolerance: got 0, need 1e-14..0.1");
	o = good;
	o.solver = 7;
	refuse(&cloud, &o, NULL, GNP_INVALID_ARGUMENT, "solver: got 7, need 0..2");
	o = good;
	o.memory_limit = 1000000;
	refuse(&cloud, &o, NULL, GNP_TOO_LARGE, "memory: the factor of 2000 unknowns needs 0.0");
	o.memory_limit = 3000000; /* of the finite volumes there is room for it */
	o.solver = GNP_SOLVER_AUTO;
	struct gnp_poisson *poisson = prepare(&cloud, &o);
	CHECK(poisson && gnp_poisson_info(poisson).solver == GNP_SOLVER_ITERATIVE);
	gnp_poisson_release(poisson);
	gnp_task_init(&task);
	gnp_task_cancel(&task);
	refuse(&cloud, &good, &task, GNP_CANCELLED, "");
	double *source = calloc(2 * N, sizeof *source);
	source[123] = NAN;
	poisson = prepare(&cloud, &good);
	CHECK(gnp_poisson_solve(poisson, source, NULL, 1, pool, NULL, source + N, NULL, &error) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "source: value 0 of point 123 is nan");
	gnp_poisson_release(poisson);
	o = options_of(GNP_SYSTEM_SQUARE, GNP_SOLVER_ITERATIVE);
	o.iterations = 2;
	o.screening = 1; /* otherwise preparing itself needs a solution */
	poisson = prepare(&cloud, &o);
	error = (struct gnp_error){0};
	source[123] = 1;
	CHECK(gnp_poisson_solve(poisson, source, NULL, 1, pool, NULL, source + N, NULL, &error) == GNP_NO_CONVERGENCE);
	CHECK_CONTAINS(error.text, "after 2 iterations, need at most 1e-08");
	gnp_poisson_release(poisson);
	gnp_sample_clear(&sample);
	free(source);
}

/* Where one of several points at a place is fixed the place is; two values there are a contradiction. */
static void points_at_one_place_have_one_value(void)
{
	enum { N = 1000, AGAIN = 700 };
	struct gnp_sample sample = sample_of("sphere", &(struct gnp_sample_options){.count = N, .seed = 7}, pool);
	struct gnp_cloud cloud = cloud_of(&sample);
	struct gnp_poisson_options options = options_of(GNP_SYSTEM_SQUARE, GNP_SOLVER_AUTO);
	static unsigned char fixed[N];
	static double f[N], values[N], u[N];
	struct gnp_poisson *poisson = NULL;
	struct gnp_error error = {0};
	for (size_t i = 0; i < 9; i++)
		sample.points[AGAIN * 3 + i] = sample.points[i];
	fixed[AGAIN] = fixed[1] = fixed[AGAIN + 1] = 1;
	values[AGAIN] = 3;
	values[1] = values[AGAIN + 1] = -2;
	options.fixed = fixed;
	CHECK(gnp_poisson_prepare(&cloud, &options, pool, NULL, &poisson, NULL) == GNP_OK);
	CHECK(gnp_poisson_solve(poisson, f, values, 1, pool, NULL, u, NULL, NULL) == GNP_OK);
	CHECK(u[0] == 3 && u[AGAIN] == 3 && u[1] == -2 && u[AGAIN + 1] == -2 && u[2] == u[AGAIN + 2]);
	values[1] = 5;
	CHECK(gnp_poisson_solve(poisson, f, values, 1, pool, NULL, u, NULL, &error) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "values: got 5 at point 1 and -2 at point 701, which lies at the same place");
	gnp_poisson_release(poisson);
	gnp_sample_clear(&sample);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(every_system_and_solver_finds_the_manufactured_solution),
	                                    TEST(the_unit_of_the_source_changes_neither_iterations_nor_residual),
	                                    TEST(the_solution_converges_with_order_three), TEST(a_screened_equation_keeps_its_mean),
	                                    TEST(an_unresolved_cloud_is_told_by_the_energy),
	                                    TEST(fixed_points_keep_their_values), TEST(each_part_of_a_cloud_has_a_mean_of_its_own),
	                                    TEST(outliers_are_dropped_and_answered), TEST(the_mean_is_zero_as_asked), TEST(many_right_hand_sides_are_solved_as_one_is),
	                                    TEST(any_number_of_workers_gives_the_same_bytes), TEST(bad_input_is_refused_by_name),
	                                    TEST(points_at_one_place_have_one_value)};
	gnp_linalg_init();
	if (gnp_pool_create(0, &pool, NULL) != GNP_OK)
		return 1;
	int status = RUN_TESTS(tests);
	gnp_pool_free(pool);
	return status;
}
