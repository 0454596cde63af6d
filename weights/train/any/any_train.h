/* The loop that trains the model for every cloud, in two phases: first the choice of frames, then all the rest.
 *
 * A step's batch is cut into micro-batches of fixed size, which workers take one at a time; their gradients are added
 * in order. Clouds and random numbers follow from the seed and the step. So a step gives the same bytes for any number
 * of workers, and what goes on from a checkpoint those of what never stopped. */
#ifndef GNP_WEIGHTS_ANY_TRAIN_H
#define GNP_WEIGHTS_ANY_TRAIN_H

#include "core/network/architecture.h"
#include "weights/train/any/any_cloud.h"
#include "weights/train/any/any_loss.h"
#include "weights/train/train_checkpoint.h"

struct gnp_any_options {
	struct gnp_architecture architecture; /* head weighted */
	struct gnp_any_recipe recipe;
	const char *from;            /* a model of the same network to train on from: its frames are kept; NULL: from nothing */
	uint64_t seed;               /* of everything; below GNP_SEED_WATCH (protocol.h) */
	size_t window;               /* clouds at hand */
	uint64_t frame_visit, visit; /* steps before the oldest is replaced, in each phase */
	uint64_t frame_steps;        /* of the first phase, at least 1 */
	size_t frame_batch;          /* points a step of it, a multiple of 32 */
	uint64_t steps;              /* of the second phase; 0: what fits into `seconds`, and the rate follows the clock */
	double seconds;
	size_t batch, micro;           /* supports a step, and a micro-batch, which divides it and is a multiple of 4 */
	double frame_rate, rate, last; /* the largest rates, and what is left of each at its phase's end as a share */
	uint64_t frame_warm, warm;     /* steps the rates take to rise */
	double clip;                   /* largest norm of a gradient */
};
struct gnp_any_options gnp_any_train_defaults(void);

/* What a step did. */
struct gnp_any_report {
	bool frames;                /* it was of the first phase, */
	double loss;                /* whose loss is the expected cost of frames; else the sum of the terms */
	struct gnp_any_terms terms; /* angle divided by judged */
	double norm, rate;
};

struct gnp_any_train;

/* Starts at step 0, past the first phase with the options' model, or where `resume`, a checkpoint's file, stands (NULL: none). pool is borrowed until
 * gnp_any_train_close. GNP_INVALID_ARGUMENT names the option. */
gnp_status gnp_any_train_open(const struct gnp_any_options *options, const char *resume, struct gnp_pool *pool,
                              struct gnp_any_train **out, struct gnp_error *error);
void gnp_any_train_close(struct gnp_any_train *train);

/* One step. After a failure the training may only be closed. */
gnp_status gnp_any_train_step(struct gnp_any_train *train, struct gnp_any_report *report, struct gnp_error *error);

/* Steps of both phases, seconds of the phase they are in, parameters. */
const struct gnp_train_state *gnp_any_train_state(const struct gnp_any_train *train);
/* Share of the phase under way that is done, 0..1; of the second at 1 there are no more steps to take. */
double gnp_any_train_fraction(const struct gnp_any_train *train);
bool gnp_any_train_in_frames(const struct gnp_any_train *train);

gnp_status gnp_any_train_save(const struct gnp_any_train *train, const char *path, struct gnp_error *error);

#endif
