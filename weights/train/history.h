/* The history of a training: a row of numbers every so often under named columns, as CSV and as a picture of curves. */
#ifndef GNP_WEIGHTS_HISTORY_H
#define GNP_WEIGHTS_HISTORY_H

#include <stddef.h>
#include <stdint.h>

#include "clients/plot/picture.h"
#include "core/base/status.h"

/* The columns after the step; name writes that of one. */
struct gnp_history_columns {
	size_t count;
	void (*name)(size_t column, char *text, size_t size);
};

/* Begins as zeros but for the columns; freed by gnp_history_clear. */
struct gnp_history {
	const struct gnp_history_columns *columns;
	size_t count, capacity;
	uint64_t *steps; /* (count) */
	double *values;  /* (count, columns) NaN where there is none */
};

/* values (columns). GNP_OUT_OF_MEMORY. */
gnp_status gnp_history_add(struct gnp_history *history, uint64_t step, const double *values, struct gnp_error *error);
void gnp_history_clear(struct gnp_history *history);

/* Writes all rows, whole or not at all. */
gnp_status gnp_history_save(const struct gnp_history *history, const char *path, struct gnp_error *error);
/* Reads back what was saved, up to a step; a file that is not there gives no rows. GNP_INVALID_ARGUMENT names the row.
 */
gnp_status gnp_history_load(const char *path, uint64_t last_step, struct gnp_history *history, struct gnp_error *error);

struct gnp_history_curve {
	const char *name;
	struct gnp_color color;
	size_t column;
};

/* Draws curves over the steps, both axes with numbers, the vertical one logarithmic; PNG. */
gnp_status gnp_history_draw(const struct gnp_history *history, const struct gnp_history_curve *curves, size_t count,
                            const char *title, const char *path, struct gnp_error *error);

#endif
