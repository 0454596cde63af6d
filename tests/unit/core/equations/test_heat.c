#include "core/equations/heat.h"
#include "core/linear/linalg.h"
#include "tests/oracles/manufactured.h"
#include "tests/unit/test.h"

static struct gnp_pool *pool;

/* z is an eigenfunction of the sphere with eigenvalue 2: a step of implicit Euler divides it by 1 + 2 dt, and leaves the mean alone. */
static void a_step_is_that_of_implicit_euler(void)
{
	enum { N = 4000, STEPS = 3 };
	static const double dts[] = {1e-3, 0.1, 10};
	struct gnp_sample sample = sample_of("sphere", &(struct gnp_sample_options){.count = N, .seed = 7}, pool);
	struct gnp_cloud cloud = {N, sample.points, sample.normals};
	struct gnp_poisson_options options = gnp_poisson_defaults();
	double *u = malloc(N * sizeof *u);
	options.laplacian.domain.estimate.cover = GNP_COVER_ALL;
	for (int d = 0; d < 3; d++) {
		struct gnp_poisson *poisson = NULL;
		CHECK(gnp_heat_prepare(&cloud, &options, &(struct gnp_heat_options){.dt = dts[d]},
		                   pool, NULL, &poisson, NULL) == GNP_OK);
		for (size_t i = 0; i < N; i++)
			u[i] = 4 + sample.points[3 * i + 2];
		CHECK(gnp_heat_run(poisson, &(struct gnp_heat_options){.dt = dts[d], .steps = STEPS},
		                   &(struct gnp_heat_field){.count = 1, .u = u},
		                   pool, NULL, NULL) == GNP_OK);
		for (size_t i = 0; i < N; i++)
			CHECK_NEAR(u[i], 4 + sample.points[3 * i + 2] / pow(1 + 2 * dts[d], STEPS), 2e-5);
		gnp_poisson_release(poisson);
	}
	gnp_sample_clear(&sample);
	free(u);
}

static void a_source_warms_at_its_rate(void)
{
	enum { N = 2000 };
	struct gnp_sample sample = sample_of("torus", &(struct gnp_sample_options){.count = N, .seed = 7}, pool);
	struct gnp_cloud cloud = {N, sample.points, sample.normals};
	struct gnp_poisson_options options = gnp_poisson_defaults();
	struct gnp_poisson *poisson = NULL;
	double *u = calloc(2 * N, sizeof *u);
	for (size_t i = 0; i < N; i++)
		u[N + i] = 3;
	CHECK(gnp_heat_prepare(&cloud, &options, &(struct gnp_heat_options){.dt = 0.5},
	                   pool, NULL, &poisson, NULL) == GNP_OK);
	CHECK(gnp_heat_run(poisson, &(struct gnp_heat_options){.dt = 0.5, .steps = 4},
	                   &(struct gnp_heat_field){.count = 1, .u = u, .source = u + N},
	                   pool, NULL, NULL) == GNP_OK);
	for (size_t i = 0; i < N; i++)
		CHECK_NEAR(u[i], 6, 1e-8);
	gnp_poisson_release(poisson);
	gnp_sample_clear(&sample);
	free(u);
}

/* The largest error of z on the sphere at time 0.4. */
static double error_on_sphere(int scheme, int system, double dt)
{
	enum { N = 2000 };
	struct gnp_sample sample = sample_of("sphere", &(struct gnp_sample_options){.count = N, .seed = 7}, pool);
	struct gnp_cloud cloud = {N, sample.points, sample.normals};
	struct gnp_poisson_options options = gnp_poisson_defaults();
	const struct gnp_heat_options heat = {.dt = dt, .steps = (size_t)(0.4 / dt + 0.5), .scheme = scheme};
	struct gnp_poisson *poisson = NULL;
	double *u = malloc(N * sizeof *u), worst = 0;
	options.laplacian.system = system;
	CHECK(gnp_heat_prepare(&cloud, &options, &heat, pool, NULL, &poisson, NULL) == GNP_OK);
	for (size_t i = 0; i < N; i++)
		u[i] = sample.points[3 * i + 2];
	CHECK(gnp_heat_run(poisson, &heat, &(struct gnp_heat_field){.count = 1, .u = u}, pool, NULL, NULL) == GNP_OK);
	for (size_t i = 0; i < N; i++)
		worst = fmax(worst, fabs(u[i] - sample.points[3 * i + 2] * exp(-0.8)));
	gnp_poisson_release(poisson);
	gnp_sample_clear(&sample);
	free(u);
	return worst;
}

static void schemes_are_of_their_order(void)
{
	double euler = error_on_sphere(GNP_HEAT_BACKWARD_EULER, GNP_SYSTEM_SQUARE, 0.2);
	double half = error_on_sphere(GNP_HEAT_BACKWARD_EULER, GNP_SYSTEM_SQUARE, 0.1);
	CHECK_NEAR(euler / half, 2, 0.3);
	double both = error_on_sphere(GNP_HEAT_TR_BDF2, GNP_SYSTEM_SQUARE, 0.2);
	double fine = error_on_sphere(GNP_HEAT_TR_BDF2, GNP_SYSTEM_SQUARE, 0.1);
	CHECK_NEAR(both / fine, 4, 0.6);
	CHECK_AT_MOST(both, half / 10);
	double symmetric = error_on_sphere(GNP_HEAT_TR_BDF2, GNP_SYSTEM_SYMMETRIC, 0.1);
	CHECK_AT_MOST(symmetric, 3e-3); /* what the discretisation of space has */
}

/* The unit square, one edge at 0 and the opposite one at 1: heat settles to x, and points that coincide have one
 * value. */
static void fixed_values_are_kept_and_settled_to(void)
{
	enum { SIDE = 21, COPIES = 30, N = SIDE * SIDE + COPIES };
	static double points[3 * N], u[N], values[N], snapshots[5 * N], times[5];
	static unsigned char fixed[N];
	for (size_t i = 0; i < N; i++) {
		size_t k = i < SIDE * SIDE ? i : (i - SIDE * SIDE) * 7;
		points[3 * i] = (double)(k % SIDE) / (SIDE - 1);
		points[3 * i + 1] = (double)(k / SIDE) / (SIDE - 1);
		u[i] = 0.5 + (i >= SIDE * SIDE);
		values[i] = NAN;
		fixed[i] = k % SIDE == 0 || k % SIDE == SIDE - 1;
		if (fixed[i])
			values[i] = points[3 * i];
	}
	struct gnp_cloud cloud = {N, points, NULL};
	for (int scheme = GNP_HEAT_BACKWARD_EULER; scheme <= GNP_HEAT_TR_BDF2; scheme++) {
		struct gnp_poisson_options options = gnp_poisson_defaults();
		const struct gnp_heat_options heat = {.dt = 0.3, .steps = 10, .scheme = scheme, .snapshot_every = 3};
		struct gnp_poisson *poisson = NULL;
		struct gnp_task task;
		gnp_task_init(&task);
		options.laplacian.system = GNP_SYSTEM_SYMMETRIC;
		options.fixed = fixed;
		CHECK(gnp_heat_snapshots(10, 3) == 5);
		CHECK(gnp_heat_prepare(&cloud, &options, &heat, pool, &task, &poisson, NULL) == GNP_OK);
		const struct gnp_heat_field field = {1, u, NULL, values, snapshots, times};
		CHECK(gnp_heat_run(poisson, &heat, &field, pool, &task, NULL) == GNP_OK);
		double worst = 0, start = 0;
		for (size_t i = 0; i < N; i++) {
			worst = fmax(worst, fabs(u[i] - points[3 * i]));
			start = fmax(start, fixed[i] ? fabs(snapshots[i] - points[3 * i]) : 0);
			CHECK(snapshots[4 * N + i] == u[i]);
		}
		CHECK_AT_MOST(worst, 1e-6);
		CHECK_AT_MOST(start, 0);
		CHECK_NEAR(times[0], 0, 0);
		CHECK_NEAR(times[1], 0.9, 1e-12);
		CHECK_NEAR(times[4], 3, 1e-12);
		gnp_poisson_release(poisson);
	}
}

/* A step so long that the system hardly knows the mean: u becomes it, of each of two pieces, and a source's warmth is
 * added to the digit. */
static void long_steps_lose_no_heat(void)
{
	enum { SIDE = 20, N = 2 * SIDE * SIDE };
	static double points[3 * N], u[2 * N], source[2 * N];
	for (size_t i = 0; i < N; i++) {
		size_t k = i % (N / 2);
		points[3 * i] = (double)(k % SIDE) + 0.3 * sin((double)i);
		points[3 * i + 1] = (double)(k / SIDE) + 0.3 * cos(3.0 * (double)i);
		points[3 * i + 2] = i < N / 2 ? 0 : 100;
		source[2 * i + 1] = i < N / 2 ? 0 : 1e-9;
	}
	const struct gnp_cloud cloud = {N, points, NULL};
	for (int scheme = GNP_HEAT_BACKWARD_EULER; scheme <= GNP_HEAT_TR_BDF2; scheme++) {
		const struct gnp_heat_options heat = {.dt = 1e11, .steps = 3, .scheme = scheme};
		struct gnp_poisson_options options = gnp_poisson_defaults();
		struct gnp_poisson *poisson = NULL;
		options.laplacian.system = GNP_SYSTEM_SYMMETRIC;
		CHECK(gnp_heat_prepare(&cloud, &options, &heat, pool, NULL, &poisson, NULL) == GNP_OK);
		const struct gnp_domain *domain = gnp_poisson_domain(poisson);
		double heated = 0, area = 0, least = INFINITY, most = -INFINITY;
		for (size_t i = 0; i < N; i++) {
			size_t point = domain->prepared.order[i];
			u[2 * point] = u[2 * point + 1] = point < N / 2 && points[3 * point] < 7;
			heated += domain->area[i] * u[2 * point];
			area += point < N / 2 ? domain->area[i] : 0;
		}
		const struct gnp_heat_field field = {.count = 2, .u = u, .source = source};
		CHECK(gnp_heat_run(poisson, &heat, &field, pool, NULL, NULL) == GNP_OK);
		for (size_t i = 0; i < N; i++) {
			double rest = i < N / 2 ? heated / area : 0;
			least = fmin(least, u[2 * i] - rest);
			most = fmax(most, u[2 * i] - rest);
			CHECK_NEAR(u[2 * i + 1], i < N / 2 ? rest : 300, 1e-6);
		}
		CHECK_AT_MOST(-least, 1e-9);
		CHECK_AT_MOST(most, 1e-9);
		gnp_poisson_release(poisson);
	}
}

static void a_step_that_is_none_is_refused(void)
{
	struct gnp_cloud cloud = {0, NULL, NULL};
	struct gnp_poisson_options options = gnp_poisson_defaults();
	struct gnp_poisson *poisson = NULL;
	struct gnp_error error = {0};
	CHECK(gnp_heat_prepare(&cloud, &options, &(struct gnp_heat_options){.dt = 0},
	                   pool, NULL, &poisson, &error) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "dt: got 0, need a finite number > 0");
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(a_step_is_that_of_implicit_euler), TEST(a_source_warms_at_its_rate),
	                                    TEST(a_step_that_is_none_is_refused), TEST(long_steps_lose_no_heat),
	                                    TEST(schemes_are_of_their_order),
	                                    TEST(fixed_values_are_kept_and_settled_to)};
	gnp_linalg_init();
	if (gnp_pool_create(0, &pool, NULL) != GNP_OK)
		return 1;
	int status = RUN_TESTS(tests);
	gnp_pool_free(pool);
	return status;
}
