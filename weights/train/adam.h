/* The optimiser: Adam (Kingma & Ba 2015) with clipping by the global norm, and the rate's warm-up and cosine.
 * Deterministic: sums run in a fixed order. */
#ifndef GNP_WEIGHTS_ADAM_H
#define GNP_WEIGHTS_ADAM_H

#include <stddef.h>
#include <stdint.h>

#include "core/base/status.h"

/* Owned; freed by gnp_adam_clear. */
struct gnp_adam {
	size_t count;
	float *first, *second; /* (count) moments: running means of the gradient and of its square */
	uint64_t step;         /* updates done */
};

gnp_status gnp_adam_create(size_t count, struct gnp_adam *out, struct gnp_error *error);
void gnp_adam_clear(struct gnp_adam *adam);

/* Scales the gradient (count) so that its norm is at most `limit`; returns the norm it had. A gradient that is not finite
 * becomes zero. limit > 0. */
double gnp_gradient_clip(float *gradient, size_t count, double limit);

/* The moments after one more gradient (count): running means with 0.9 and 0.999. */
void gnp_adam_advance(struct gnp_adam *adam, const float *gradient);
/* Moves a range of parameters by them: parameters -= rate * m / (sqrt(v) + 1e-8), m and v corrected for their start
 * at 0. */
void gnp_adam_move(const struct gnp_adam *adam, double rate, size_t offset, size_t count, float *parameters);
/* Both, of all parameters. */
void gnp_adam_update(struct gnp_adam *adam, double rate, const float *gradient, float *parameters);

/* The rate's factor at a step: linear from 0 over the first `warm` steps, and a half cosine over fraction, 0..1 of
 * training, down to `last`. */
double gnp_rate_factor(uint64_t step, uint64_t warm, double fraction, double last);

#endif
