/* A training of the model for every cloud from beginning to end: steps, lines on what they do, checkpoints, watched
 * clouds, the history and its picture. */
#ifndef GNP_WEIGHTS_ANY_RUN_H
#define GNP_WEIGHTS_ANY_RUN_H

#include <stdio.h>

#include "weights/train/any/any_train.h"
#include "weights/train/any/any_watch.h"

struct gnp_any_run_options {
	struct gnp_any_options train;
	const char *folder;                 /* of the checkpoint, history.csv and curve.png; made when it is not there */
	bool resume;                        /* from the folder's checkpoint, which must be there */
	size_t watch_clouds, watch_centres; /* 0 clouds: none are watched */
	double line_seconds, watch_seconds, save_seconds; /* between lines, looks at watched clouds, checkpoints */
};

/* Lines every 10 seconds, a look every 2 minutes at 36 clouds with 200 centres each, a checkpoint every minute. */
struct gnp_any_run_options gnp_any_run_defaults(void);

/* Where a training ended. */
struct gnp_any_end {
	uint64_t step;                   /* of both phases */
	double seconds;                  /* of the second */
	double watched[GNP_ANY_FIGURES]; /* NaN: none are */
};

/* parameters (those of the architecture's layout) and the end out. Lines go to `lines` (NULL: nowhere). A cancelled
 * task leaves a checkpoint to go on from. */
gnp_status gnp_any_run(const struct gnp_any_run_options *options, struct gnp_pool *pool, struct gnp_task *task,
                       FILE *lines, float *parameters, struct gnp_any_end *end, struct gnp_error *error);

#endif
