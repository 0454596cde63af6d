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
		CHECK(gnp_heat_prepare(&cloud, &options, dts[d], pool, NULL, &poisson, NULL) == GNP_OK);
		for (size_t i = 0; i < N; i++)
			u[i] = 4 + sample.points[3 * i + 2];
		CHECK(gnp_heat_step(poisson, dts[d], STEPS, NULL, NULL, 1, pool, NULL, u, NULL) == GNP_OK);
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
	CHECK(gnp_heat_prepare(&cloud, &options, 0.5, pool, NULL, &poisson, NULL) == GNP_OK);
	CHECK(gnp_heat_step(poisson, 0.5, 4, u + N, NULL, 1, pool, NULL, u, NULL) == GNP_OK);
	for (size_t i = 0; i < N; i++)
		CHECK_NEAR(u[i], 6, 1e-8);
	gnp_poisson_release(poisson);
	gnp_sample_clear(&sample);
	free(u);
}

static void a_step_that_is_none_is_refused(void)
{
	struct gnp_cloud cloud = {0, NULL, NULL};
	struct gnp_poisson_options options = gnp_poisson_defaults();
	struct gnp_poisson *poisson = NULL;
	struct gnp_error error = {0};
	CHECK(gnp_heat_prepare(&cloud, &options, 0, pool, NULL, &poisson, &error) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "dt: got 0, need a finite number > 0");
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(a_step_is_that_of_implicit_euler), TEST(a_source_warms_at_its_rate),
	                                    TEST(a_step_that_is_none_is_refused)};
	gnp_linalg_init();
	if (gnp_pool_create(0, &pool, NULL) != GNP_OK)
		return 1;
	int status = RUN_TESTS(tests);
	gnp_pool_free(pool);
	return status;
}
