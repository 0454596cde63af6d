/* Which rows of the table are judged. */
#ifndef GNP_WEIGHTS_SELECTION_H
#define GNP_WEIGHTS_SELECTION_H

#include "weights/validate/method.h"

/* Bit masks over the enumerations; a row is selected when all three hold it. */
struct gnp_selection {
	unsigned families, regimes, methods[GNP_REGIMES]; /* the methods of each regime */
};
struct gnp_selection gnp_selection_all(void);

/* The same methods in every regime. */
void gnp_selection_take(struct gnp_selection *selection, unsigned methods);

/* GNP_INVALID_ARGUMENT when weights of a selected row are not among the models, with the first of them. */
gnp_status gnp_selection_check(const struct gnp_selection *selection, const struct gnp_models *models, struct gnp_error *error);
/* Leaves those rows out. */
void gnp_selection_restrict(struct gnp_selection *selection, const struct gnp_models *models);

/* A row of the table. */
struct gnp_row {
	enum gnp_family family;
	enum gnp_regime regime;
	enum gnp_method method;
};
enum { GNP_ROWS = GNP_FAMILIES * GNP_REGIMES * GNP_METHODS };

/* Rows as numbers below GNP_ROWS: family, regime, method from the most to the least significant. */
size_t gnp_row_number(const struct gnp_row *row);
bool gnp_selection_has(const struct gnp_selection *selection, const struct gnp_row *row);
/* The first row after `row` (by number) that is selected; from NULL the first of all. False when there is none. */
bool gnp_selection_next(const struct gnp_selection *selection, const struct gnp_row *row, struct gnp_row *next);
size_t gnp_selection_count(const struct gnp_selection *selection);

#endif
