/* Where a training stands: all that the next step depends on. */
#ifndef GNP_WEIGHTS_TRAIN_CHECKPOINT_H
#define GNP_WEIGHTS_TRAIN_CHECKPOINT_H

#include "weights/train/adam.h"

/* Data and random numbers follow from the seed and the step, so the step says where they stand. */
struct gnp_train_state {
	float *parameters; /* (adam.count), owned */
	float *average;    /* (adam.count) of the parameters over the last steps, owned: what a training gives */
	struct gnp_adam adam;
	uint64_t step;  /* steps done */
	double seconds; /* spent on them */
};

gnp_status gnp_train_state_create(size_t parameters, struct gnp_train_state *out, struct gnp_error *error);
void gnp_train_state_clear(struct gnp_train_state *state);

/* what: a line that tells this training from those it could not continue (network, regime). Writes whole or not at all. */
gnp_status gnp_train_state_save(const char *path, const char *what, const struct gnp_train_state *state, struct gnp_error *error);
/* Fills a state of as many parameters. On failure it is undefined, but may be cleared. */
gnp_status gnp_train_state_load(const char *path, const char *what, struct gnp_train_state *state, struct gnp_error *error);

#endif
