/* The training loss against automatic differentiation: tests/oracles/oracle_loss.py made tests/oracles/data/loss.npz. */
#include "core/base/random.h"
#include "tests/oracles/frozen.h"
#include "tests/unit/test.h"
#include "weights/train/loss.h"

enum { PATCHES = 4, POINTS = 9 };

static struct frozen frozen = {.path = "tests/oracles/data/loss.npz"};

static const double *doubles(const char *name, size_t count)
{
	const double *values = frozen_doubles(&frozen, name, count);
	if (!values) {
		fprintf(stderr, "%s: %s is not what it should be\n", frozen.path, name);
		exit(1);
	}
	return values;
}

struct problem {
	struct gnp_loss_options options;
	struct gnp_loss_scale scale;
	struct gnp_truth truth[POINTS];
	struct gnp_jet jets[POINTS];
};

static struct gnp_jet jet_of(const double *j)
{
	return (struct gnp_jet){j[0], j[1], j[2], j[3], j[4], j[5]};
}

static struct problem problem_of(size_t patch)
{
	struct problem problem = {0};
	const double *lam = doubles("lam", 2 * GNP_LOSS_TERMS), *floor = doubles("floor", 2);
	memcpy(problem.options.patch.lambda, lam, sizeof problem.options.patch.lambda);
	memcpy(problem.options.centre.lambda, lam + GNP_LOSS_TERMS, sizeof problem.options.centre.lambda);
	problem.options.patch.floor = floor[0];
	problem.options.centre.floor = floor[1];
	problem.options.patch.focus = problem.options.centre.focus = *doubles("focus", 1);
	problem.options.patch.most = problem.options.centre.most = *doubles("most", 1);
	memcpy(problem.scale.typical, doubles("typical", GNP_LOSS_TERMS), sizeof problem.scale.typical);
	for (size_t i = 0; i < POINTS; i++) {
		size_t row = patch * POINTS + i;
		const double *place = doubles("place", PATCHES * POINTS * 2) + 2 * row;
		problem.truth[i] = (struct gnp_truth){place[0], place[1], jet_of(doubles("truth", PATCHES * POINTS * 6) + 6 * row)};
		problem.jets[i] = jet_of(doubles("jets", PATCHES * POINTS * 6) + 6 * row);
	}
	return problem;
}

static double loss_of(const struct problem *problem, struct gnp_loss_terms *terms, struct gnp_jet *gradient)
{
	return gnp_loss_patch(&problem->options, &problem->scale, problem->truth, problem->jets, POINTS, terms, gradient);
}

static void loss_and_gradient_agree_with_automatic_differentiation(void)
{
	for (size_t p = 0; p < PATCHES; p++) {
		struct problem problem = problem_of(p);
		struct gnp_loss_terms terms;
		struct gnp_jet gradient[POINTS];
		CHECK_NEAR(loss_of(&problem, &terms, gradient), doubles("loss", PATCHES)[p], 1e-12);
		const double *want = doubles("terms", PATCHES * 2 * GNP_LOSS_TERMS) + 2 * p * GNP_LOSS_TERMS;
		for (int t = 0; t < GNP_LOSS_TERMS; t++) {
			CHECK_NEAR(terms.patch[t], want[t], 1e-12);
			CHECK_NEAR(terms.centre[t], want[GNP_LOSS_TERMS + t], 1e-12);
		}
		for (size_t i = 0; i < POINTS; i++) {
			const double *d = doubles("gradient", PATCHES * POINTS * 6) + 6 * (p * POINTS + i);
			const double got[6] = {gradient[i].f, gradient[i].u, gradient[i].v, gradient[i].uu, gradient[i].uv, gradient[i].vv};
			for (int c = 0; c < 6; c++)
				CHECK_NEAR(got[c], d[c], 1e-10 * (1 + fabs(d[c])));
		}
	}
}

static double *entry(struct gnp_jet *jet, int c)
{
	double *entries[6] = {&jet->f, &jet->u, &jet->v, &jet->uu, &jet->uv, &jet->vv};
	return entries[c];
}

static void gradient_agrees_with_differences(void)
{
	struct problem problem = problem_of(1);
	struct gnp_jet gradient[POINTS];
	loss_of(&problem, NULL, gradient);
	for (size_t i = 0; i < POINTS; i++)
		for (int c = 0; c < 6; c++) {
			struct problem up = problem, down = problem;
			double step = 1e-6 * (1 + fabs(*entry(&problem.jets[i], c)));
			*entry(&up.jets[i], c) += step;
			*entry(&down.jets[i], c) -= step;
			CHECK_NEAR(*entry(&gradient[i], c), (loss_of(&up, NULL, NULL) - loss_of(&down, NULL, NULL)) / (2 * step), 1e-6);
		}
}

/* The loss of points together by the logarithms of their terms, or a power. */
static double cell_of(const struct problem *problem, double power, struct gnp_jet *gradient)
{
	const struct gnp_loss_rule rule = {.lambda = {0.3, 0.2, 0.2, 0.5, 0.6, 0.7, 0.1}, .most = HUGE_VAL, .power = power};
	const struct gnp_truth *truth[POINTS];
	struct gnp_jet unused[POINTS];
	double values[GNP_LOSS_TERMS];
	for (size_t i = 0; i < POINTS; i++)
		truth[i] = &problem->truth[i];
	return gnp_loss_cell(&rule, &problem->scale, truth, problem->jets, POINTS, values, gradient ? gradient : unused);
}

static void check_cell_gradient(const struct problem *problem, double power)
{
	struct gnp_jet gradient[POINTS];
	cell_of(problem, power, gradient);
	for (size_t i = 0; i < POINTS; i++)
		for (int c = 0; c < 6; c++) {
			struct problem up = *problem, down = *problem;
			double step = 1e-6 * (1 + fabs(*entry(&up.jets[i], c)));
			*entry(&up.jets[i], c) += step;
			*entry(&down.jets[i], c) -= step;
			CHECK_NEAR(*entry(&gradient[i], c), (cell_of(&up, power, NULL) - cell_of(&down, power, NULL)) / (2 * step),
			           1e-6);
		}
}

static void cells_count_by_the_logarithm_of_their_error(void)
{
	struct problem problem = problem_of(3), twice = problem;
	check_cell_gradient(&problem, 0);
	/* height is linear: twice its error costs 0.3 log 2 more */
	for (size_t i = 0; i < POINTS; i++)
		twice.jets[i].f += problem.jets[i].f - problem.truth[i].jet.f;
	CHECK_NEAR(cell_of(&twice, 0, NULL) - cell_of(&problem, 0, NULL), 0.3 * log(2), 1e-6);
}

/* By a power, the larger errors count more: here height's by (2^0.5 - 1) / 0.5 of its own root. */
static void cells_count_by_a_power_of_their_error(void)
{
	struct problem problem = problem_of(3), twice = problem;
	double error = 0, size = 0;
	check_cell_gradient(&problem, 0.5);
	for (size_t i = 0; i < POINTS; i++) {
		double d = problem.jets[i].f - problem.truth[i].jet.f;
		twice.jets[i].f += d;
		error += d * d;
		size += problem.truth[i].jet.f * problem.truth[i].jet.f;
	}
	CHECK_NEAR(cell_of(&twice, 0.5, NULL) - cell_of(&problem, 0.5, NULL),
	           0.6 * (sqrt(2) - 1) * sqrt(sqrt(error / size)), 1e-5);
}

static void the_truth_costs_nothing_and_pulls_nowhere(void)
{
	struct problem problem = problem_of(0);
	struct gnp_jet gradient[POINTS];
	for (size_t i = 0; i < POINTS; i++)
		problem.jets[i] = problem.truth[i].jet;
	CHECK(loss_of(&problem, NULL, gradient) == 0);
	for (size_t i = 0; i < POINTS; i++)
		for (int c = 0; c < 6; c++)
			CHECK(*entry(&gradient[i], c) == 0);
}

static void a_flat_truth_gives_finite_loss(void)
{
	struct problem problem = problem_of(0);
	struct gnp_jet gradient[POINTS];
	for (size_t i = 0; i < POINTS; i++)
		problem.truth[i].jet = (struct gnp_jet){0};
	CHECK(isfinite(loss_of(&problem, NULL, gradient)));
	for (size_t i = 0; i < POINTS; i++)
		for (int c = 0; c < 6; c++)
			CHECK(isfinite(*entry(&gradient[i], c)));
}

/* Doubling all lengths changes no relative term. */
static void lengths_do_not_matter(void)
{
	struct problem problem = problem_of(2), twice = problem;
	for (size_t i = 0; i < POINTS; i++)
		for (int c = 0; c < 6; c++) {
			double factor = c == 0 ? 2 : c < 3 ? 1 : 0.5;
			*entry(&twice.jets[i], c) *= factor;
			*entry(&twice.truth[i].jet, c) *= factor;
		}
	twice.scale.typical[GNP_LOSS_HEIGHT] *= 2;
	twice.scale.typical[GNP_LOSS_SECOND_FORM] /= 2;
	twice.scale.typical[GNP_LOSS_GAUSSIAN] /= 4;
	twice.scale.typical[GNP_LOSS_MEAN] /= 2;
	CHECK_NEAR(loss_of(&twice, NULL, NULL), loss_of(&problem, NULL, NULL), 1e-6);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(loss_and_gradient_agree_with_automatic_differentiation),
		TEST(gradient_agrees_with_differences),
		TEST(cells_count_by_the_logarithm_of_their_error),
		TEST(cells_count_by_a_power_of_their_error),
		TEST(the_truth_costs_nothing_and_pulls_nowhere),
		TEST(a_flat_truth_gives_finite_loss),
		TEST(lengths_do_not_matter),
	};
	int failed = RUN_TESTS(tests);
	gnp_tensors_clear(&frozen.tensors);
	return failed;
}
