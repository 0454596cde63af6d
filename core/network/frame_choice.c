#include "core/network/frame_choice.h"

#include "core/network/dense.h"

enum { LOOKS = GNP_LADDER_LOOKS, STEPS = GNP_LADDER_STEPS };

struct places {
	size_t mean, deviation, first, first_bias, second, second_bias;
};

/* They follow each other. */
static struct places places_of(const struct gnp_network *network)
{
	size_t width = network->architecture.frame_width, mean = gnp_layout_find(&network->layout, "frame.mean")->offset;
	size_t first = mean + 2 * LOOKS, second = first + width * (LOOKS + 1);
	return (struct places){mean, mean + LOOKS, first, first + width * LOOKS, second, second + STEPS * width};
}

static void standardise(const float *parameters, const struct places *at, const float *looks, float *x)
{
	for (size_t i = 0; i < LOOKS; i++)
		x[i] = (looks[i] - parameters[at->mean + i]) / parameters[at->deviation + i];
}

void gnp_frame_scores(const struct gnp_network *network, const float *looks, float *hidden, float *scores)
{
	const struct places at = places_of(network);
	const float *w = network->parameters;
	size_t width = network->architecture.frame_width;
	float x[LOOKS];
	standardise(w, &at, looks, x);
	gnp_dense_forward(1, LOOKS, width, x, LOOKS, w + at.first, LOOKS, w + at.first_bias, hidden);
	gnp_relu(width, hidden);
	gnp_dense_forward(1, width, STEPS, hidden, width, w + at.second, width, w + at.second_bias, scores);
}

unsigned gnp_frame_choose(const struct gnp_network *network, const struct gnp_ladder *ladder)
{
	float hidden[GNP_FRAME_WIDTH_MAX], scores[STEPS];
	unsigned best = 0;
	gnp_frame_scores(network, ladder->looks, hidden, scores);
	for (unsigned l = 1; l < (unsigned)ladder->steps; l++)
		if (scores[l] > scores[best])
			best = l;
	return best;
}

void gnp_frame_scores_backward(const struct gnp_network *network, const float *looks, const float *hidden,
                               const float *dscores, float *gradient)
{
	const struct places at = places_of(network);
	const float *w = network->parameters;
	size_t width = network->architecture.frame_width;
	float x[LOOKS];
	standardise(w, &at, looks, x);
	for (size_t l = 0; l < STEPS; l++) {
		gradient[at.second_bias + l] += dscores[l];
		for (size_t h = 0; h < width; h++)
			gradient[at.second + l * width + h] += dscores[l] * hidden[h];
	}
	for (size_t h = 0; h < width; h++) {
		float dhidden = 0;
		for (size_t l = 0; l < STEPS; l++)
			dhidden += dscores[l] * w[at.second + l * width + h];
		if (hidden[h] <= 0)
			continue;
		gradient[at.first_bias + h] += dhidden;
		for (size_t i = 0; i < LOOKS; i++)
			gradient[at.first + h * LOOKS + i] += dhidden * x[i];
	}
}
