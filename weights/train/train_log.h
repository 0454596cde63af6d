/* Keeps the history of a training: a row every so often, as CSV, and a picture of its curves. */
#ifndef GNP_WEIGHTS_TRAIN_LOG_H
#define GNP_WEIGHTS_TRAIN_LOG_H

#include "weights/protocol/score.h"
#include "weights/train/train.h"

/* Means since the row before, and how the watched shapes did, NaN where they were not looked at. */
struct gnp_train_row {
	uint64_t step;
	double seconds, patches_per_second;
	struct gnp_train_report report;
	double watched[GNP_SCORES];
};

/* Owned; freed by gnp_train_log_clear. */
struct gnp_train_log {
	size_t count, capacity;
	struct gnp_train_row *rows;
};

/* GNP_OUT_OF_MEMORY. */
gnp_status gnp_train_log_add(struct gnp_train_log *log, const struct gnp_train_row *row, struct gnp_error *error);
void gnp_train_log_clear(struct gnp_train_log *log);

/* Writes all rows, whole or not at all. */
gnp_status gnp_train_log_save(const struct gnp_train_log *log, const char *path, struct gnp_error *error);
/* Reads back what was saved, up to a step; a file that is not there gives no rows. */
gnp_status gnp_train_log_load(const char *path, uint64_t last_step, struct gnp_train_log *log, struct gnp_error *error);

/* Draws the loss and the watched shapes' errors over the steps, both axes with numbers, the vertical one logarithmic; PNG. */
gnp_status gnp_train_log_draw(const struct gnp_train_log *log, const char *title, const char *path, struct gnp_error *error);

#endif
