#include "core/linear/eigen.h"
#include "tests/unit/test.h"

static double random_unit(unsigned *state)
{
	*state = *state * 1664525u + 1013904223u;
	return (double)*state / 4294967296.0 - 0.5;
}

/* Checks A v = lambda v, orthonormality, order and handedness for one matrix. */
static void check_pair(const double a[6])
{
	double value[3], e[3][3], size = 0;
	gnp_eigen_symmetric3(a, value, e);
	for (int i = 0; i < 6; i++)
		size = fmax(size, fabs(a[i]));
	const double full[3][3] = {{a[0], a[1], a[2]}, {a[1], a[3], a[4]}, {a[2], a[4], a[5]}};
	for (int i = 0; i < 3; i++) {
		for (int r = 0; r < 3; r++) {
			double left = full[r][0] * e[i][0] + full[r][1] * e[i][1] + full[r][2] * e[i][2];
			CHECK_NEAR(left, value[i] * e[i][r], 2e-15 * size);
		}
		for (int j = 0; j < 3; j++)
			CHECK_NEAR(e[i][0] * e[j][0] + e[i][1] * e[j][1] + e[i][2] * e[j][2], i == j, 5e-15);
	}
	CHECK(value[0] >= value[1] && value[1] >= value[2]);
	CHECK_NEAR(e[0][0] * (e[1][1] * e[2][2] - e[1][2] * e[2][1]) - e[0][1] * (e[1][0] * e[2][2] - e[1][2] * e[2][0]) +
	               e[0][2] * (e[1][0] * e[2][1] - e[1][1] * e[2][0]), 1, 4e-15);
}

static void random_matrices_of_every_scale(void)
{
	unsigned state = 1;
	for (int trial = 0; trial < 3000; trial++) {
		double a[6], scale = pow(10, (trial % 13 - 6) * 10);
		for (int i = 0; i < 6; i++)
			a[i] = scale * random_unit(&state);
		check_pair(a);
	}
}

static void multiple_and_zero_eigenvalues(void)
{
	static const double cases[][6] = {{0, 0, 0, 0, 0, 0}, {1, 0, 0, 1, 0, 1}, {1, 1, 1, 1, 1, 1}, {2, 0, 0, 1, 0, 1},
	                                  {1, 0, 0, 1, 0, 1e-30}, {0, 1, 0, 0, 0, 0}, {1e-200, 1e-200, 0, 1e-200, 0, 0}};
	for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
		check_pair(cases[i]);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(random_matrices_of_every_scale), TEST(multiple_and_zero_eigenvalues)};
	return RUN_TESTS(tests);
}
