/* Table 1: errors gathered shape by shape, and their means and medians beside what the paper printed. */
#ifndef GNP_WEIGHTS_TABLE_H
#define GNP_WEIGHTS_TABLE_H

#include <stdio.h>

#include "weights/validate/published.h"
#include "weights/validate/selection.h"

struct gnp_table {
	struct gnp_protocol protocol;
	struct gnp_selection selection;
	struct gnp_models *models; /* the table holds a reference; NULL: none */
	size_t drawn[GNP_FAMILIES]; /* shapes drawn until protocol.shapes were accepted */
	struct gnp_table_shape {
		uint64_t seed;
		unsigned degree;
		double sharpness;
	} *shapes;       /* (families, shapes) */
	double *errors;  /* (families, regimes, methods, shapes, GNP_SCORES) */
	double seconds[GNP_FAMILIES][GNP_REGIMES][GNP_METHODS]; /* wall time of all shapes, neighbour search included */
};

/* A table of zeros, to be filled. models may be NULL; GNP_INVALID_ARGUMENT when they lack what the selection needs. On failure
 * *out is unchanged; cleared by gnp_table_clear. */
gnp_status gnp_table_create(const struct gnp_protocol *protocol, const struct gnp_selection *selection, struct gnp_models *models,
                            struct gnp_table *out, struct gnp_error *error);
void gnp_table_clear(struct gnp_table *table);

struct gnp_table_shape *gnp_table_shape(const struct gnp_table *table, enum gnp_family family, size_t shape);
/* The weights a selected row is judged with; NULL: it uses none. */
const struct gnp_model *gnp_table_model(const struct gnp_table *table, const struct gnp_row *row);
/* Neighbours that set its patches: its model's, where that goes by any, else the regime's. */
int gnp_table_k(const struct gnp_table *table, const struct gnp_row *row);
/* (GNP_SCORES) errors of a row on one of its shapes. */
double *gnp_table_errors(const struct gnp_table *table, const struct gnp_row *row, size_t shape);

/* Over the shapes of a row; NaN when any is. */
double gnp_table_mean(const struct gnp_table *table, const struct gnp_row *row, enum gnp_score score);
double gnp_table_median(const struct gnp_table *table, const struct gnp_row *row, enum gnp_score score);

/* The rows of gnp that are compared with another method, as gnp_selection_next: where both are judged, and with
 * adaptive where clouds are noisy or have outliers. */
bool gnp_table_next_ratio(const struct gnp_table *table, enum gnp_method other, const struct gnp_row *row,
                          struct gnp_row *next);
/* The mean of a row over that of another method in its place. */
double gnp_table_ratio(const struct gnp_table *table, const struct gnp_row *row, enum gnp_method other, enum gnp_score score);

/* Whether the row's mean is below the printed error; false also where that binds nobody. */
bool gnp_table_beats_one(const struct gnp_table *table, const struct gnp_row *row, enum gnp_published_model model,
                         enum gnp_score score);
/* Whether the row's mean is below both printed errors; false also where the paper's cell is not judged. */
bool gnp_table_beats(const struct gnp_table *table, const struct gnp_row *row, enum gnp_score score);

/* How a method does in all its selected cells. */
struct gnp_verdict {
	int cells, below_gnp;   /* all, and those below the paper's GNP row, which binds everywhere */
	int judged, below_both; /* those judged beside both rows, and those below both */
};
struct gnp_verdict gnp_table_verdict(const struct gnp_table *table, enum gnp_method method);

/* The whole table with the protocol it follows. Errors of writing are left in the stream. */
void gnp_table_write_text(const struct gnp_table *table, FILE *out);
void gnp_table_write_markdown(const struct gnp_table *table, FILE *out);
void gnp_table_write_json(const struct gnp_table *table, FILE *out);

#endif
