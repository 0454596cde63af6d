#include "core/fit/least_squares.h"
#include "core/fit/legendre.h"
#include "tests/unit/test.h"

enum { POINTS = 90, STRIDE = 40, SIZE = 36 };

static double phi[POINTS * STRIDE], weight[POINTS], y[POINTS], gram[STRIDE * STRIDE], moment[STRIDE];

/* Points of a sunflower in the unit disk. */
static void disk(double *u, double *v)
{
	for (int i = 0; i < POINTS; i++) {
		double r = sqrt((i + 0.5) / POINTS), angle = 2.399963229728653 * i;
		u[i] = r * cos(angle);
		v[i] = r * sin(angle);
	}
}

static void setup(void)
{
	double u[POINTS], v[POINTS];
	disk(u, v);
	gnp_basis_rows((struct gnp_basis){GNP_BASIS_TOTAL, 7}, u, v, POINTS, STRIDE, phi);
	for (int i = 0; i < POINTS; i++) {
		weight[i] = 0.5 + 0.5 * cos(i);
		y[i] = sin(3 * i);
	}
}

static void normal_equations_match_plain_sums(void)
{
	setup();
	gnp_normal_equations(phi, weight, y, POINTS, STRIDE, gram, moment);
	for (int r = 0; r < SIZE; r++) {
		double right = 0;
		for (int i = 0; i < POINTS; i++)
			right += weight[i] * phi[i * STRIDE + r] * y[i];
		CHECK_NEAR(moment[r], right, 1e-13);
		for (int c = r; c < SIZE; c++) {
			double sum = 0;
			for (int i = 0; i < POINTS; i++)
				sum += weight[i] * phi[i * STRIDE + r] * phi[i * STRIDE + c];
			CHECK_NEAR(gram[r * STRIDE + c], sum, 1e-13);
		}
	}
}

static void a_polynomial_is_recovered(void)
{
	double want[STRIDE] = {0}, x[STRIDE];
	setup();
	for (int j = 0; j < SIZE; j++)
		want[j] = cos(j);
	for (int i = 0; i < POINTS; i++) {
		y[i] = 0;
		for (int j = 0; j < SIZE; j++)
			y[i] += phi[i * STRIDE + j] * want[j];
	}
	gnp_normal_equations(phi, weight, y, POINTS, STRIDE, gram, moment);
	CHECK(gnp_cholesky_factor(gram, SIZE, STRIDE, GNP_SMALLEST_PIVOT));
	gnp_cholesky_forward(gram, SIZE, STRIDE, moment, moment);
	gnp_cholesky_backward(gram, SIZE, STRIDE, moment, x);
	for (int j = 0; j < SIZE; j++)
		CHECK_NEAR(x[j], want[j], 1e-8);
}

/* det of U^T U against the product of pivots of plain elimination. */
static void log_determinant_matches_elimination(void)
{
	double a[SIZE][SIZE], log_determinant = 0;
	setup();
	gnp_normal_equations(phi, weight, y, POINTS, STRIDE, gram, moment);
	for (int r = 0; r < SIZE; r++)
		for (int c = 0; c < SIZE; c++)
			a[r][c] = gram[r <= c ? r * STRIDE + c : c * STRIDE + r];
	for (int k = 0; k < SIZE; k++) {
		log_determinant += log(a[k][k]);
		for (int r = k + 1; r < SIZE; r++)
			for (int c = SIZE - 1; c >= k; c--)
				a[r][c] -= a[r][k] / a[k][k] * a[k][c];
	}
	CHECK(gnp_cholesky_factor(gram, SIZE, STRIDE, GNP_SMALLEST_PIVOT));
	CHECK_NEAR(gnp_cholesky_log_determinant(gram, SIZE, STRIDE), log_determinant, 1e-7);
}

static void a_deficient_problem_is_refused(void)
{
	setup();
	for (int i = 0; i < POINTS; i++)
		phi[i * STRIDE + 5] = phi[i * STRIDE + 2] - 2 * phi[i * STRIDE + 1];
	gnp_normal_equations(phi, weight, y, POINTS, STRIDE, gram, moment);
	CHECK(!gnp_cholesky_factor(gram, SIZE, STRIDE, GNP_SMALLEST_PIVOT));
	for (int i = 0; i < POINTS; i++)
		weight[i] = 0;
	gnp_normal_equations(phi, weight, y, POINTS, STRIDE, gram, moment);
	CHECK(!gnp_cholesky_factor(gram, SIZE, STRIDE, GNP_SMALLEST_PIVOT));
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(normal_equations_match_plain_sums), TEST(a_polynomial_is_recovered), TEST(log_determinant_matches_elimination),
	                                    TEST(a_deficient_problem_is_refused)};
	return RUN_TESTS(tests);
}
