#include "table.h"

#include <math.h>
#include <stdlib.h>

#include "memory.h"
#include "published.h"

struct gnp_selection gnp_selection_all(void)
{
	return (struct gnp_selection){(1u << GNP_FAMILIES) - 1, (1u << GNP_REGIMES) - 1, (1u << GNP_ESTIMATOR_KINDS) - 1};
}

/* Rows as numbers: family, regime, estimator from the most to the least significant. */
static size_t row_number(const struct gnp_row *row)
{
	return ((size_t)row->family * GNP_REGIMES + row->regime) * GNP_ESTIMATOR_KINDS + row->estimator;
}

bool gnp_selection_next(const struct gnp_selection *selection, const struct gnp_row *row, struct gnp_row *next)
{
	size_t number = row ? row_number(row) + 1 : 0;
	for (; number < (size_t)GNP_FAMILIES * GNP_REGIMES * GNP_ESTIMATOR_KINDS; number++) {
		unsigned estimator = number % GNP_ESTIMATOR_KINDS, regime = number / GNP_ESTIMATOR_KINDS % GNP_REGIMES;
		unsigned family = (unsigned)(number / GNP_ESTIMATOR_KINDS / GNP_REGIMES);
		if (selection->families >> family & selection->regimes >> regime & selection->estimators >> estimator & 1) {
			*next = (struct gnp_row){(enum gnp_family)family, (enum gnp_regime)regime, (enum gnp_estimator_kind)estimator};
			return true;
		}
	}
	return false;
}

gnp_status gnp_table_create(const struct gnp_protocol *protocol, const struct gnp_selection *selection,
                            struct gnp_table *out, struct gnp_error *error)
{
	if (!protocol->shapes || !protocol->centres)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "table: got %zu shapes and %zu centres, need at least 1",
		                     protocol->shapes, protocol->centres);
	struct gnp_table table = {.protocol = *protocol, .selection = *selection};
	size_t rows = (size_t)GNP_FAMILIES * GNP_REGIMES * GNP_ESTIMATOR_KINDS, items;
	bool fits = gnp_size_multiply(rows * GNP_SCORES, protocol->shapes, &items);
	table.errors = fits ? gnp_array_zero(items, sizeof *table.errors) : NULL;
	table.shapes = fits ? gnp_array_zero(GNP_FAMILIES * protocol->shapes, sizeof *table.shapes) : NULL;
	if (!table.errors || !table.shapes) {
		gnp_table_clear(&table);
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "table: no memory for %zu shapes", protocol->shapes);
	}
	*out = table;
	return GNP_OK;
}

void gnp_table_clear(struct gnp_table *table)
{
	free(table->shapes);
	free(table->errors);
	*table = (struct gnp_table){0};
}

struct gnp_table_shape *gnp_table_shape(const struct gnp_table *table, enum gnp_family family, size_t shape)
{
	return &table->shapes[family * table->protocol.shapes + shape];
}

double *gnp_table_errors(const struct gnp_table *table, const struct gnp_row *row, size_t shape)
{
	return table->errors + GNP_SCORES * (row_number(row) * table->protocol.shapes + shape);
}

double gnp_table_mean(const struct gnp_table *table, const struct gnp_row *row, enum gnp_score score)
{
	double sum = 0;
	for (size_t i = 0; i < table->protocol.shapes; i++)
		sum += gnp_table_errors(table, row, i)[score];
	return sum / (double)table->protocol.shapes;
}

/* The value with `rank` smaller ones; ties go by position. */
static double ranked(const struct gnp_table *table, const struct gnp_row *row, enum gnp_score score, size_t rank)
{
	size_t count = table->protocol.shapes;
	for (size_t i = 0; i < count; i++) {
		double value = gnp_table_errors(table, row, i)[score];
		size_t smaller = 0;
		for (size_t j = 0; j < count; j++) {
			double other = gnp_table_errors(table, row, j)[score];
			smaller += other < value || (other == value && j < i);
		}
		if (smaller == rank)
			return value;
	}
	return NAN;
}

double gnp_table_median(const struct gnp_table *table, const struct gnp_row *row, enum gnp_score score)
{
	size_t count = table->protocol.shapes;
	if (isnan(gnp_table_mean(table, row, score)))
		return NAN;
	return (ranked(table, row, score, (count - 1) / 2) + ranked(table, row, score, count / 2)) / 2;
}

bool gnp_table_beats(const struct gnp_table *table, const struct gnp_row *row, enum gnp_score score)
{
	double target;
	return gnp_published_target(row->family, row->regime, score, &target) && gnp_table_mean(table, row, score) < target;
}
