/* Fitting again without what is plainly off: points off an exact surface, none off it, and noise. */
#include "core/support/weighted_refit.h"
#include "tests/unit/core/support/small_cloud.h"

enum {
	SIZE = GNP_TAYLOR_SIZE,
	STRIDE = GNP_TAYLOR_STRIDE,
	ORDERS = GNP_TAYLOR_DEGREE + 1,
	OUTPUTS = GNP_WEIGHTED_OUTPUTS
};

static struct gnp_support support;
static struct gnp_weighted_fit fit;
static float outputs[OUTPUTS], logits[GNP_SUPPORT_NODES];

/* A support whose heights are a polynomial of degree 2, with noise, solved with next to no penalties. */
static void make_support(double noise)
{
	static const double wanted[6] = {0, 0.1, -0.05, 0.2, 0.1, -0.3};
	static struct small_row row;
	struct gnp_ladder ladder;
	struct small_cloud cloud;
	struct gnp_random random;
	small_cloud_make(1600, 0.01, false, &cloud);
	CHECK(small_cloud_support(&cloud, 700, 11, 0, &ladder, &row, &support));
	small_cloud_clear(&cloud);
	gnp_random_seed(&random, 8, 0);
	for (size_t i = 0; i < support.nodes; i++) {
		logits[i] = 2;
		support.y[i] = noise * gnp_random_normal(&random) / sqrt(support.weight[i]);
		for (size_t c = 0; c < 6; c++)
			support.y[i] += wanted[c] * support.rows[i * STRIDE + c];
	}
	for (int o = 0; o < OUTPUTS; o++)
		outputs[o] = o < 3 ? -9 : o < ORDERS ? -2 : 0.5f;
}

static void solve(void)
{
	gnp_weighted_solve(&support, outputs, logits, &fit);
	CHECK(fit.solved);
}

static void what_is_off_has_no_say(void)
{
	double before, after;
	make_support(0);
	for (size_t i = 3; i < GNP_SUPPORT_SINGLES; i += 8)
		support.y[i] += i % 16 ? 0.3 : -0.1;
	solve();
	before = fabs(fit.coefficients[1] - 0.1) + fabs(fit.coefficients[3] - 0.2);
	CHECK(gnp_weighted_refit(&support, outputs, &fit) >= 1);
	after = fabs(fit.coefficients[1] - 0.1) + fabs(fit.coefficients[3] - 0.2);
	CHECK(before > 1e-2);
	CHECK_AT_MOST(after, 1e-4 * before);
	for (size_t i = 0; i < GNP_SUPPORT_SINGLES; i++)
		CHECK(i % 8 == 3 ? fit.share[i] < 1e-5 : fit.share[i] > 0.1);
}

static void what_lies_on_its_surface_is_left_to_the_bit(void)
{
	static const double noises[] = {0, 1e-6, 1e-3, 0.05};
	for (size_t n = 0; n < sizeof noises / sizeof *noises; n++) {
		struct gnp_weighted_fit kept;
		make_support(noises[n]);
		solve();
		memcpy(&kept, &fit, sizeof kept);
		CHECK(gnp_weighted_refit(&support, outputs, &fit) == 0);
		CHECK(memcmp(kept.coefficients, fit.coefficients, sizeof kept.coefficients) == 0 && kept.total == fit.total);
	}
}

/* Off by many deviations of an almost exact fit, but by next to nothing of the spacing: rounding, not an outlier. */
static void little_is_not_plain(void)
{
	make_support(0);
	support.y[5] += 0.01 * support.distance[6] / 1.5;
	solve();
	CHECK(gnp_weighted_refit(&support, outputs, &fit) == 0);
	support.y[5] += 0.2 * support.distance[6] / 1.5;
	solve();
	CHECK(gnp_weighted_refit(&support, outputs, &fit) >= 1);
}

/* What the network left out already stays left out. */
static void shares_only_become_less(void)
{
	make_support(1e-4);
	for (size_t i = 0; i < support.nodes; i++)
		logits[i] = i % 3 ? 2 : -6;
	support.y[4] += 0.4;
	solve();
	struct gnp_weighted_fit first = fit;
	CHECK(gnp_weighted_refit(&support, outputs, &fit) >= 1);
	for (size_t i = 0; i < support.nodes; i++)
		CHECK(fit.share[i] <= first.share[i] * (1 + 1e-5));
}

/* Of sizes 0, 1, ... n - 1 in any order the median; a few that are far off do not move it. */
static void the_deviation_is_that_of_the_median(void)
{
	double residual[GNP_SUPPORT_NODES] = {0};
	make_support(0);
	for (size_t i = 0; i < GNP_SUPPORT_SINGLES; i++)
		residual[i] = (i % 2 ? -1 : 1) * (double)(i * 5 % GNP_SUPPORT_SINGLES);
	CHECK_NEAR(gnp_weighted_deviation(&support, residual), 1.4826 * (GNP_SUPPORT_SINGLES / 2 - 1), 1e-12);
	for (size_t i = 0; i < GNP_SUPPORT_SINGLES; i++)
		residual[i] *= fabs(residual[i]) > 40 ? 1e9 : 1;
	CHECK_NEAR(gnp_weighted_deviation(&support, residual), 1.4826 * (GNP_SUPPORT_SINGLES / 2 - 1), 1e-12);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(what_is_off_has_no_say),
		TEST(what_lies_on_its_surface_is_left_to_the_bit),
		TEST(little_is_not_plain),
		TEST(shares_only_become_less),
		TEST(the_deviation_is_that_of_the_median),
	};
	return RUN_TESTS(tests);
}
