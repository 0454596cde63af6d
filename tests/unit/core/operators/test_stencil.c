#include "core/base/random.h"
#include "core/operators/stencil.h"
#include "tests/unit/test.h"

enum { COUNT = 40 };

static struct gnp_scratch *scratch;
static double u[COUNT], v[COUNT], weights[GNP_STENCIL_PARTS][COUNT];

static gnp_status fit(unsigned degree, unsigned lowest, size_t count, unsigned *used, struct gnp_error *error)
{
	double *parts[GNP_STENCIL_PARTS];
	for (int p = 0; p < GNP_STENCIL_PARTS; p++)
		parts[p] = weights[p];
	return gnp_stencil_fit(degree, lowest, u, v, count, scratch, parts, used, error);
}

static void place_neighbours(double size)
{
	struct gnp_random random;
	gnp_random_seed(&random, 1, 0);
	u[0] = v[0] = 0;
	for (int j = 1; j < COUNT; j++) {
		u[j] = size * (2 * gnp_random_uniform(&random) - 1);
		v[j] = size * (2 * gnp_random_uniform(&random) - 1);
	}
}

/* (1 + u - 2v + 3u^2 - u v + 5 v^2 + u^a v^b): derivatives at the origin are the coefficients, times 2 for the squares. */
static void derivatives_of_polynomials_are_exact(void)
{
	static const double want[GNP_STENCIL_PARTS] = {1, 1, -2, 6, -1, 10};
	for (unsigned degree = 2; degree <= 5; degree++) {
		unsigned used;
		place_neighbours(0.7);
		CHECK(fit(degree, 2, COUNT, &used, NULL) == GNP_OK && used == degree);
		for (int p = 0; p < GNP_STENCIL_PARTS; p++) {
			double sum = 0;
			for (int j = 0; j < COUNT; j++)
				sum += weights[p][j] * (1 + u[j] - 2 * v[j] + 3 * u[j] * u[j] - u[j] * v[j] + 5 * v[j] * v[j] +
				                        (degree > 2 ? pow(u[j], degree - 1) * v[j] : 0));
			CHECK_NEAR(sum, want[p], 1e-9);
		}
	}
}

static void functionals_scale_with_the_order_of_the_derivative(void)
{
	static const int order[GNP_STENCIL_PARTS] = {0, 1, 1, 2, 2, 2};
	double before[GNP_STENCIL_PARTS][COUNT];
	unsigned used;
	place_neighbours(1);
	CHECK(fit(4, 2, COUNT, &used, NULL) == GNP_OK);
	memcpy(before, weights, sizeof before);
	place_neighbours(1e-3);
	CHECK(fit(4, 2, COUNT, &used, NULL) == GNP_OK);
	for (int p = 0; p < GNP_STENCIL_PARTS; p++)
		for (int j = 0; j < COUNT; j++)
			CHECK_NEAR(weights[p][j] * pow(1e-3, order[p]), before[p][j], 1e-8 * (1 + fabs(before[p][j])));
}

static void too_few_neighbours_lower_the_degree(void)
{
	unsigned used;
	place_neighbours(1);
	CHECK(fit(4, 2, 9, &used, NULL) == GNP_OK);
	CHECK(used == 2);
}

/* On a line the second derivative across it is anyone's guess. */
static void neighbours_on_a_line_are_refused(void)
{
	struct gnp_error error = {0};
	unsigned used;
	place_neighbours(1);
	memset(v, 0, sizeof v);
	CHECK(fit(4, 2, COUNT, &used, &error) == GNP_DEGENERATE);
	CHECK_STRING(error.text, "stencil: 40 neighbours do not determine a polynomial of degree 2");
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(derivatives_of_polynomials_are_exact),
	                                    TEST(functionals_scale_with_the_order_of_the_derivative),
	                                    TEST(too_few_neighbours_lower_the_degree), TEST(neighbours_on_a_line_are_refused)};
	scratch = gnp_scratch_create();
	int status = RUN_TESTS(tests);
	gnp_scratch_free(scratch);
	return status;
}
