#include "weights/train/adam.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"

gnp_status gnp_adam_create(size_t count, struct gnp_adam *out, struct gnp_error *error)
{
	struct gnp_adam adam = {.count = count};
	adam.first = gnp_array_zero(count, sizeof *adam.first);
	adam.second = gnp_array_zero(count, sizeof *adam.second);
	if (!adam.first || !adam.second) {
		gnp_adam_clear(&adam);
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "training: no memory for %zu parameters", count);
	}
	*out = adam;
	return GNP_OK;
}

void gnp_adam_clear(struct gnp_adam *adam)
{
	free(adam->first);
	free(adam->second);
	*adam = (struct gnp_adam){0};
}

double gnp_gradient_clip(float *gradient, size_t count, double limit)
{
	double square = 0;
	for (size_t i = 0; i < count; i++)
		square += (double)gradient[i] * gradient[i];
	double norm = sqrt(square);
	if (!isfinite(norm))
		memset(gradient, 0, count * sizeof *gradient);
	else if (norm > limit)
		for (size_t i = 0; i < count; i++)
			gradient[i] = (float)(gradient[i] * (limit / norm));
	return norm;
}

static const double MEAN = 0.9, SQUARE = 0.999;

void gnp_adam_advance(struct gnp_adam *adam, const float *gradient)
{
	const float keep_m = (float)MEAN, keep_v = (float)SQUARE, new_m = (float)(1 - MEAN), new_v = (float)(1 - SQUARE);
	adam->step++;
	for (size_t i = 0; i < adam->count; i++) {
		float g = gradient[i];
		adam->first[i] = keep_m * adam->first[i] + new_m * g;
		adam->second[i] = keep_v * adam->second[i] + new_v * g * g;
	}
}

void gnp_adam_move(const struct gnp_adam *adam, double rate, size_t offset, size_t count, float *parameters)
{
	static const float TINY = 1e-8f;
	double correct = sqrt(1 - pow(SQUARE, (double)adam->step));
	float scale = (float)(rate / (1 - pow(MEAN, (double)adam->step))), root = (float)(1 / correct);
	for (size_t i = offset; i < offset + count; i++)
		parameters[i] -= scale * adam->first[i] / (sqrtf(adam->second[i]) * root + TINY);
}

void gnp_adam_update(struct gnp_adam *adam, double rate, const float *gradient, float *parameters)
{
	gnp_adam_advance(adam, gradient);
	gnp_adam_move(adam, rate, 0, adam->count, parameters);
}

double gnp_rate_factor(uint64_t step, uint64_t warm, double fraction, double last)
{
	double start = step < warm ? (double)(step + 1) / (double)(warm + 1) : 1;
	return start * (last + (1 - last) * 0.5 * (1 + cos(M_PI * fmin(fmax(fraction, 0), 1))));
}
