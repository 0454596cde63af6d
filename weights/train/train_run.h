/* A training from beginning to end: steps, lines on what they do, checkpoints, watched shapes, the history and its picture. */
#ifndef GNP_WEIGHTS_TRAIN_RUN_H
#define GNP_WEIGHTS_TRAIN_RUN_H

#include <stdbool.h>
#include <stdio.h>

#include "weights/train/train_log.h"
#include "weights/train/trainable.h"

struct gnp_train_run_options {
	struct gnp_train_options train;
	const char *folder; /* of the checkpoint, history.csv and curve.png; made when it is not there */
	bool resume;        /* from the folder's checkpoint, which must be there */
	size_t watch_shapes, watch_centres;              /* 0 shapes: none are watched */
	double line_seconds, watch_seconds, save_seconds; /* between lines, looks at watched shapes, checkpoints */
};

/* Lines every 10 seconds, a look every 2 minutes at 8 shapes with 200 centres each, a checkpoint every minute. */
struct gnp_train_run_options gnp_train_run_defaults(void);

/* parameters (network's count) and the history's last row out. Lines go to `lines` (NULL: nowhere). A cancelled task leaves a
 * checkpoint to go on from. */
gnp_status gnp_train_run(const struct gnp_train_run_options *options, const struct gnp_trainable *network,
                         struct gnp_pool *pool, struct gnp_task *task, FILE *lines, float *parameters, struct gnp_train_row *last,
                         struct gnp_error *error);

#endif
