#include "core/fit/regression.h"
#include "core/fit/taylor.h"
#include "tests/unit/test.h"

static void rows_are_graded_monomials(void)
{
	double u = 0.7, v = -0.4, row[GNP_TAYLOR_STRIDE];
	gnp_taylor_rows(GNP_TAYLOR_DEGREE, &u, &v, 1, GNP_TAYLOR_STRIDE, row);
	size_t n = 0;
	for (int d = 0; d <= GNP_TAYLOR_DEGREE; d++)
		for (int b = 0; b <= d; b++)
			CHECK_NEAR(row[n++], pow(u, d - b) * pow(v, b), 1e-16);
	CHECK(n == GNP_TAYLOR_SIZE);
	for (; n < GNP_TAYLOR_STRIDE; n++)
		CHECK(row[n] == 0);
}

static void jets_match_differences(void)
{
	double c[GNP_TAYLOR_STRIDE] = {0}, u = 0.3, v = 0.5, h = 1e-5;
	for (int i = 0; i < GNP_TAYLOR_SIZE; i++)
		c[i] = cos(3.0 * i);
	struct gnp_jet at = gnp_taylor_jet(7, c, u, v), up = gnp_taylor_jet(7, c, u + h, v), um = gnp_taylor_jet(7, c, u - h, v);
	struct gnp_jet vp = gnp_taylor_jet(7, c, u, v + h), vm = gnp_taylor_jet(7, c, u, v - h);
	CHECK_NEAR(at.u, (up.f - um.f) / (2 * h), 1e-8);
	CHECK_NEAR(at.v, (vp.f - vm.f) / (2 * h), 1e-8);
	CHECK_NEAR(at.uu, (up.u - um.u) / (2 * h), 1e-8);
	CHECK_NEAR(at.uv, (up.v - um.v) / (2 * h), 1e-8);
	CHECK_NEAR(at.vv, (vp.v - vm.v) / (2 * h), 1e-8);
}

enum { POINTS = 60 };
static double u[POINTS], v[POINTS], y[POINTS], ones[POINTS];
static double rows[POINTS * GNP_TAYLOR_STRIDE], gram[GNP_TAYLOR_STRIDE * GNP_TAYLOR_STRIDE], moment[GNP_TAYLOR_STRIDE];
static double factor[GNP_TAYLOR_SIZE * GNP_TAYLOR_STRIDE], mean[GNP_TAYLOR_STRIDE];

static struct gnp_regression data(void)
{
	for (int i = 0; i < POINTS; i++) {
		double r = sqrt((i + 0.5) / POINTS), angle = 2.399963229728653 * i;
		u[i] = r * cos(angle);
		v[i] = r * sin(angle);
		y[i] = 0.1 + 0.3 * u[i] - 0.2 * u[i] * u[i] + 0.1 * u[i] * v[i] + 0.01 * sin(37.0 * i);
		ones[i] = 1;
	}
	struct gnp_regression regression = {.rows = rows, .gram = gram, .moment = moment};
	gnp_regression_fill(&regression, u, v, y, ones, POINTS);
	return regression;
}

static double factorial(int n)
{
	return n < 2 ? 1 : n * factorial(n - 1);
}

/* Oracle: the marginal likelihood in the space of data, y ~ N(0, s (I + Phi D Phi^T)), by plain elimination of the n x n
 * matrix; the free coefficients get a prior so wide that only a constant of it is left. Differences between priors compare. */
static double evidence_by_data_covariance(struct gnp_prior prior)
{
	static double a[POINTS][POINTS + 1];
	double log_determinant = 0, square = 0;
	for (int i = 0; i < POINTS; i++) {
		for (int j = 0; j < POINTS; j++) {
			double sum = i == j;
			size_t n = 0;
			for (int d = 0; d <= GNP_TAYLOR_DEGREE; d++)
				for (int b = 0; b <= d; b++, n++)
					sum += rows[i * GNP_TAYLOR_STRIDE + n] * rows[j * GNP_TAYLOR_STRIDE + n] *
					       (d < 3 ? 1e7 : prior.tau * prior.tau * pow(prior.rho, 2 * d) / (factorial(d - b) * factorial(b)));
			a[i][j] = sum;
		}
		a[i][POINTS] = y[i];
	}
	for (int k = 0; k < POINTS; k++) {
		log_determinant += log(a[k][k]);
		square += a[k][POINTS] * a[k][POINTS] / a[k][k];
		for (int i = k + 1; i < POINTS; i++)
			for (int j = POINTS; j >= k; j--)
				a[i][j] -= a[i][k] / a[k][k] * a[k][j];
	}
	return -0.5 * (log_determinant + (POINTS - 6) * log(square / (POINTS - 6)));
}

static void evidence_matches_the_data_covariance(void)
{
	static const struct gnp_prior priors[] = {{1, 1}, {0.5, 3}, {2, 0.5}, {0.8, 30}, {0.3, 10}};
	struct gnp_regression regression = data();
	struct gnp_posterior posterior = {.factor = factor, .mean = mean};
	CHECK(gnp_regression_condition(&regression, priors[0], &posterior));
	double first = posterior.evidence, oracle = evidence_by_data_covariance(priors[0]);
	for (size_t i = 1; i < sizeof priors / sizeof *priors; i++) {
		CHECK(gnp_regression_condition(&regression, priors[i], &posterior));
		CHECK_NEAR(posterior.evidence - first, evidence_by_data_covariance(priors[i]) - oracle, 1e-3);
	}
}

static void a_weak_prior_gives_least_squares_and_a_strong_one_a_quadric(void)
{
	struct gnp_regression regression = data();
	struct gnp_posterior posterior = {.factor = factor, .mean = mean};
	CHECK(gnp_regression_condition(&regression, (struct gnp_prior){1, 1e5}, &posterior));
	gnp_regression_mean(&posterior);
	/* normal equations: the residual is orthogonal to every column */
	for (int j = 0; j < GNP_TAYLOR_SIZE; j++) {
		double sum = 0;
		for (int i = 0; i < POINTS; i++) {
			double misfit = y[i];
			for (int k = 0; k < GNP_TAYLOR_SIZE; k++)
				misfit -= rows[i * GNP_TAYLOR_STRIDE + k] * mean[k];
			sum += misfit * rows[i * GNP_TAYLOR_STRIDE + j];
		}
		CHECK_NEAR(sum, 0, 1e-5);
	}
	CHECK(gnp_regression_condition(&regression, (struct gnp_prior){0.1, 1e-3}, &posterior));
	gnp_regression_mean(&posterior);
	for (int j = 6; j < GNP_TAYLOR_SIZE; j++)
		CHECK_NEAR(mean[j], 0, 1e-6);
	CHECK_NEAR(mean[3], -0.2, 0.02);
	CHECK_NEAR(mean[4], 0.1, 0.02);
}

static void nested_sums_restate_to_any_radius(void)
{
	static double sums[GNP_TAYLOR_STRIDE * GNP_TAYLOR_STRIDE], sums_moment[GNP_TAYLOR_STRIDE];
	static double inner_gram[GNP_TAYLOR_STRIDE * GNP_TAYLOR_STRIDE], inner_moment[GNP_TAYLOR_STRIDE];
	struct gnp_regression regression = data(), inner = {.gram = inner_gram, .moment = inner_moment};
	struct gnp_regression nested = {.rows = rows, .gram = sums, .moment = sums_moment};
	double share = 0.4;
	gnp_regression_clear(&nested);
	gnp_regression_add(&nested, u, v, y, ones, 20);
	gnp_regression_add(&nested, u + 20, v + 20, y + 20, ones, POINTS - 20);
	gnp_regression_rescale(&nested, share, &inner);
	for (int i = 0; i < POINTS; i++) {
		u[i] /= share;
		v[i] /= share;
		y[i] /= share;
	}
	gnp_regression_fill(&regression, u, v, y, ones, POINTS);
	CHECK(inner.count == POINTS);
	CHECK_NEAR(inner.square / regression.square, 1, 1e-13);
	for (int i = 0; i < GNP_TAYLOR_SIZE; i++)
		for (int j = i; j < GNP_TAYLOR_SIZE; j++)
			CHECK_NEAR(inner_gram[i * GNP_TAYLOR_STRIDE + j], gram[i * GNP_TAYLOR_STRIDE + j],
			           1e-12 * sqrt(gram[i * (GNP_TAYLOR_STRIDE + 1)] * gram[j * (GNP_TAYLOR_STRIDE + 1)]));
}

static void too_few_points_are_refused(void)
{
	struct gnp_regression regression = data();
	struct gnp_posterior posterior = {.factor = factor, .mean = mean};
	gnp_regression_fill(&regression, u, v, y, ones, 6);
	CHECK(!gnp_regression_condition(&regression, (struct gnp_prior){1, 1}, &posterior));
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(rows_are_graded_monomials), TEST(jets_match_differences),
	                                    TEST(evidence_matches_the_data_covariance),
	                                    TEST(a_weak_prior_gives_least_squares_and_a_strong_one_a_quadric),
	                                    TEST(nested_sums_restate_to_any_radius), TEST(too_few_points_are_refused)};
	return RUN_TESTS(tests);
}
