/* The choice of frames against its definition in double, and its derivatives by differences of that. */
#include "core/base/random.h"
#include "core/linear/linalg.h"
#include "core/network/frame_choice.h"
#include "core/support/weighted_projection.h"
#include "tests/unit/test.h"

enum { LOOKS = GNP_LADDER_LOOKS, STEPS = GNP_LADDER_STEPS, WIDTH = 9 };

static const struct gnp_architecture architecture = {
	.trunk = GNP_TRUNK_SEPARABLE, .head = GNP_HEAD_WEIGHTED, .features = GNP_SUPPORT_FEATURES, .width = 4,
	.channels = 1, .neurons = 4, .layers = 1, .quadrature = 4, .head_width = 4, .node_width = 4, .frame_width = WIDTH,
	.outputs = GNP_WEIGHTED_OUTPUTS};

struct setting {
	struct gnp_network *network;
	double *parameters; /* the same in double */
	float looks[LOOKS];
};

static void make(struct setting *setting)
{
	struct gnp_random random;
	struct gnp_layout layout;
	CHECK(gnp_architecture_layout(&architecture, &layout, NULL) == GNP_OK);
	float *parameters = malloc(layout.total * sizeof *parameters);
	setting->parameters = malloc(layout.total * sizeof *setting->parameters);
	gnp_random_seed(&random, 6, 0);
	for (size_t i = 0; i < layout.total; i++)
		parameters[i] = (float)(0.3 * gnp_random_normal(&random));
	float *deviation = parameters + gnp_layout_find(&layout, "frame.deviation")->offset;
	for (size_t i = 0; i < LOOKS; i++) {
		deviation[i] = 0.5f + fabsf(deviation[i]);
		setting->looks[i] = (float)gnp_random_normal(&random);
	}
	for (size_t i = 0; i < layout.total; i++)
		setting->parameters[i] = (double)parameters[i];
	CHECK(gnp_network_create(&architecture, parameters, &setting->network, NULL) == GNP_OK);
	free(parameters);
}

static void drop(struct setting *setting)
{
	gnp_network_free(setting->network);
	free(setting->parameters);
}

static const double *tensor(const struct setting *setting, const char *name)
{
	return setting->parameters + gnp_layout_find(&setting->network->layout, name)->offset;
}

static void oracle(const struct setting *setting, double *scores)
{
	double hidden[WIDTH];
	for (size_t h = 0; h < WIDTH; h++) {
		double sum = tensor(setting, "frame.0.bias")[h];
		for (size_t i = 0; i < LOOKS; i++)
			sum += tensor(setting, "frame.0.weight")[h * LOOKS + i] *
			       ((double)setting->looks[i] - tensor(setting, "frame.mean")[i]) /
			       tensor(setting, "frame.deviation")[i];
		hidden[h] = sum > 0 ? sum : 0;
	}
	for (size_t l = 0; l < STEPS; l++) {
		scores[l] = tensor(setting, "frame.2.bias")[l];
		for (size_t h = 0; h < WIDTH; h++)
			scores[l] += tensor(setting, "frame.2.weight")[l * WIDTH + h] * hidden[h];
	}
}

static void scores_are_those_of_the_definition(void)
{
	struct setting setting;
	float hidden[WIDTH], scores[STEPS];
	double want[STEPS];
	make(&setting);
	gnp_frame_scores(setting.network, setting.looks, hidden, scores);
	oracle(&setting, want);
	for (size_t l = 0; l < STEPS; l++)
		CHECK_NEAR(scores[l], want[l], 1e-5);
	drop(&setting);
}

static void the_highest_score_of_the_steps_there_are_is_taken(void)
{
	struct setting setting;
	struct gnp_ladder ladder;
	double want[STEPS];
	unsigned chosen[STEPS + 1] = {0};
	make(&setting);
	oracle(&setting, want);
	memcpy(ladder.looks, setting.looks, sizeof ladder.looks);
	for (int steps = 1; steps <= STEPS; steps++) {
		unsigned best = 0;
		for (unsigned l = 1; l < (unsigned)steps; l++)
			best = want[l] > want[best] ? l : best;
		ladder.steps = steps;
		CHECK((chosen[steps] = gnp_frame_choose(setting.network, &ladder)) == best);
	}
	CHECK(chosen[1] == 0 && chosen[STEPS] != chosen[1]);
	drop(&setting);
}

static double loss(const struct setting *setting, const float *dscores)
{
	double scores[STEPS], sum = 0;
	oracle(setting, scores);
	for (size_t l = 0; l < STEPS; l++)
		sum += (double)dscores[l] * scores[l];
	return sum;
}

static void derivatives_are_differences_and_are_added(void)
{
	struct setting setting;
	float hidden[WIDTH], scores[STEPS], dscores[STEPS];
	make(&setting);
	size_t total = setting.network->layout.total, differ = 0;
	float *gradient = malloc(total * sizeof *gradient);
	for (size_t l = 0; l < STEPS; l++)
		dscores[l] = (float)(l % 3) - 0.7f;
	for (size_t i = 0; i < total; i++)
		gradient[i] = 2;
	gnp_frame_scores(setting.network, setting.looks, hidden, scores);
	gnp_frame_scores_backward(setting.network, setting.looks, hidden, dscores, gradient);
	for (size_t r = 0; r < setting.network->layout.rows; r++) {
		const struct gnp_parameter_row *row = &setting.network->layout.row[r];
		bool learned = strncmp(row->name, "frame.0", 7) == 0 || strncmp(row->name, "frame.2", 7) == 0;
		for (size_t i = row->offset; i < row->offset + row->count; i++) {
			const double was = setting.parameters[i], h = 1e-5;
			double want = 0;
			if (learned) {
				setting.parameters[i] = was + h;
				want = loss(&setting, dscores);
				setting.parameters[i] = was - h;
				want = (want - loss(&setting, dscores)) / (2 * h);
				setting.parameters[i] = was;
			}
			CHECK_NEAR((double)gradient[i] - 2, want, 2e-5);
			differ += fabs(want) > 1e-3;
		}
	}
	CHECK(differ > WIDTH * LOOKS / 4);
	free(gradient);
	drop(&setting);
}

int main(int argc, char **argv)
{
	gnp_linalg_init();
	static const struct test tests[] = {TEST(scores_are_those_of_the_definition),
	                                    TEST(the_highest_score_of_the_steps_there_are_is_taken),
	                                    TEST(derivatives_are_differences_and_are_added)};
	return RUN_TESTS(tests);
}
