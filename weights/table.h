/* Table 1: errors gathered shape by shape, and their means and medians beside what the paper printed. */
#ifndef GNP_WEIGHTS_TABLE_H
#define GNP_WEIGHTS_TABLE_H

#include <stdio.h>

#include "estimator.h"
#include "protocol.h"
#include "score.h"

/* What to judge: bit masks over the enumerations. */
struct gnp_selection {
	unsigned families, regimes, estimators;
};
struct gnp_selection gnp_selection_all(void);

/* A row of the table. */
struct gnp_row {
	enum gnp_family family;
	enum gnp_regime regime;
	enum gnp_estimator_kind estimator;
};

/* The first row after `row` (in the order family, regime, estimator) that is selected; from NULL the first of all. False
 * when there is none. */
bool gnp_selection_next(const struct gnp_selection *selection, const struct gnp_row *row, struct gnp_row *next);

struct gnp_table {
	struct gnp_protocol protocol;
	struct gnp_selection selection;
	size_t drawn[GNP_FAMILIES]; /* shapes drawn until protocol.shapes were accepted */
	struct gnp_table_shape {
		uint64_t seed;
		unsigned degree;
		double sharpness;
	} *shapes;       /* (families, shapes) */
	double *errors;  /* (families, regimes, estimators, shapes, GNP_SCORES) */
	double seconds[GNP_FAMILIES][GNP_REGIMES][GNP_ESTIMATOR_KINDS]; /* wall time of all shapes, neighbour search included */
};

/* A table of zeros, to be filled. On failure *out is unchanged; cleared by gnp_table_clear. */
gnp_status gnp_table_create(const struct gnp_protocol *protocol, const struct gnp_selection *selection,
                            struct gnp_table *out, struct gnp_error *error);
void gnp_table_clear(struct gnp_table *table);

struct gnp_table_shape *gnp_table_shape(const struct gnp_table *table, enum gnp_family family, size_t shape);
/* (GNP_SCORES) errors of a row on one of its shapes. */
double *gnp_table_errors(const struct gnp_table *table, const struct gnp_row *row, size_t shape);

/* Over the shapes of a row; NaN when any is. */
double gnp_table_mean(const struct gnp_table *table, const struct gnp_row *row, enum gnp_score score);
double gnp_table_median(const struct gnp_table *table, const struct gnp_row *row, enum gnp_score score);

/* Whether the row's mean is below both printed errors; false also where the paper's cell is not judged. */
bool gnp_table_beats(const struct gnp_table *table, const struct gnp_row *row, enum gnp_score score);

/* The whole table with the protocol it follows. Errors of writing are left in the stream. */
void gnp_table_write_text(const struct gnp_table *table, FILE *out);
void gnp_table_write_markdown(const struct gnp_table *table, FILE *out);
void gnp_table_write_json(const struct gnp_table *table, FILE *out);

#endif
