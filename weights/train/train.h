/* The loop that trains a network: batches of patches, their loss, its gradient, a step.
 *
 * A batch is cut into micro-batches of fixed size, each from one cloud in its turn, which workers take one at a time;
 * their gradients are added in the order of the micro-batches. So a step gives the same bytes whatever the number of
 * workers, and, since random numbers and clouds follow from the seed and the step, going on from a checkpoint gives
 * the same as never having stopped. */
#ifndef GNP_WEIGHTS_TRAIN_H
#define GNP_WEIGHTS_TRAIN_H

#include "weights/train/loss.h"
#include "weights/train/train_checkpoint.h"
#include "weights/train/train_window.h"
#include "weights/train/trainable.h"

struct gnp_train_options {
	struct gnp_train_data data; /* its seed is that of everything */
	struct gnp_train_recipe recipe;
	struct gnp_loss_options loss;
	uint64_t steps;      /* of the whole training; 0: what fits into `seconds`, and the rate follows the clock */
	double seconds;
	size_t batch, micro; /* patches a step, and a micro-batch, which divides it */
	size_t window;       /* clouds at hand */
	uint64_t visit;      /* steps before the oldest is replaced */
	double rate, last;   /* the largest rate, and what is left of it in the end as a share */
	uint64_t warm;       /* steps the rate takes to rise */
	double clip;         /* largest norm of a gradient */
	bool orthogonal;     /* matrices of the network's layout, where it has one, take Muon's step instead of Adam's */
	const char *only;    /* the one tensor of the network's layout that is trained; NULL: all are */
	uint64_t average;    /* steps that the result is the running average of; 1: the parameters as they are */
};

/* All but the folder, the regime and the network's recipe: 320 shapes of 100,000 points, batches of 64. */
struct gnp_train_options gnp_train_defaults(void);

/* What a step did. */
struct gnp_train_report {
	double loss;                 /* means over the patches of the batch */
	struct gnp_loss_terms terms;
	double norm;                 /* of the gradient, before clipping */
	double rate;
	double operations;           /* in matrix products, 0 where the network does not tell */
	double data_seconds;         /* of all workers, spent on making patches */
};

struct gnp_train;

/* Starts at step 0, or where `resume`, a checkpoint's file, stands (NULL: none). What is borrowed (network, pool, names) stays
 * until gnp_train_close. */
gnp_status gnp_train_open(const struct gnp_train_options *options, const struct gnp_trainable *network, const char *resume,
                          struct gnp_pool *pool, struct gnp_train **out, struct gnp_error *error);
void gnp_train_close(struct gnp_train *train);

/* One step. After a failure the training may only be closed. report may be NULL. */
gnp_status gnp_train_step(struct gnp_train *train, struct gnp_train_report *report, struct gnp_error *error);

/* Steps done, seconds spent, parameters and their average. */
const struct gnp_train_state *gnp_train_state(const struct gnp_train *train);
/* Share of the training done, 0..1; at 1 there are no more steps to take. */
double gnp_train_fraction(const struct gnp_train *train);

gnp_status gnp_train_save(const struct gnp_train *train, const char *path, struct gnp_error *error);

#endif
