#include "weights/validate/table.h"

#include <math.h>
#include <stdlib.h>

#include "core/base/memory.h"

gnp_status gnp_table_create(const struct gnp_protocol *protocol, const struct gnp_selection *selection, struct gnp_models *models,
                            struct gnp_table *out, struct gnp_error *error)
{
	if (!protocol->shapes || !protocol->centres)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "table: got %zu shapes and %zu centres, need at least 1",
		                     protocol->shapes, protocol->centres);
	gnp_status status = gnp_selection_check(selection, models, error);
	if (status != GNP_OK)
		return status;
	struct gnp_table table = {.protocol = *protocol, .selection = *selection, .models = gnp_models_retain(models)};
	size_t items;
	bool fits = gnp_size_multiply((size_t)GNP_ROWS * GNP_SCORES, protocol->shapes, &items);
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
	gnp_models_release(table->models);
	free(table->shapes);
	free(table->errors);
	*table = (struct gnp_table){0};
}

struct gnp_table_shape *gnp_table_shape(const struct gnp_table *table, enum gnp_family family, size_t shape)
{
	return &table->shapes[family * table->protocol.shapes + shape];
}

const struct gnp_model *gnp_table_model(const struct gnp_table *table, const struct gnp_row *row)
{
	const struct gnp_model *model;
	gnp_method_model(row->method, row->regime, table->models, &model, NULL); /* there, as create saw to */
	return model;
}

int gnp_table_k(const struct gnp_table *table, const struct gnp_row *row)
{
	const struct gnp_model *model = gnp_table_model(table, row);
	bool own = model && model->architecture.head != GNP_HEAD_WEIGHTED; /* that finds its neighbourhoods by itself */
	return own ? (int)model->recipe.k : gnp_regime_info(row->regime)->k;
}

double *gnp_table_errors(const struct gnp_table *table, const struct gnp_row *row, size_t shape)
{
	return table->errors + GNP_SCORES * (gnp_row_number(row) * table->protocol.shapes + shape);
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

bool gnp_table_next_ratio(const struct gnp_table *table, enum gnp_method other, const struct gnp_row *row,
                          struct gnp_row *next)
{
	struct gnp_row at;
	for (bool more = gnp_selection_next(&table->selection, row, &at); more; more = gnp_selection_next(&table->selection, &at, &at)) {
		const struct gnp_regime_info *info = gnp_regime_info(at.regime);
		const struct gnp_row beside = {at.family, at.regime, other};
		bool passed = other == GNP_METHOD_ADAPTIVE && info->noise == 0 && info->outlier_fraction == 0;
		if (at.method == GNP_METHOD_GNP && !passed && gnp_selection_has(&table->selection, &beside)) {
			*next = at;
			return true;
		}
	}
	return false;
}

double gnp_table_ratio(const struct gnp_table *table, const struct gnp_row *row, enum gnp_method other, enum gnp_score score)
{
	const struct gnp_row beside = {row->family, row->regime, other};
	return gnp_table_mean(table, row, score) / gnp_table_mean(table, &beside, score);
}

bool gnp_table_beats_one(const struct gnp_table *table, const struct gnp_row *row, enum gnp_published_model model,
                         enum gnp_score score)
{
	return !gnp_published_is_outlying(row->family, row->regime, model, score) &&
	       gnp_table_mean(table, row, score) < gnp_published_error(row->family, row->regime, model, score);
}

bool gnp_table_beats(const struct gnp_table *table, const struct gnp_row *row, enum gnp_score score)
{
	double target;
	return gnp_published_target(row->family, row->regime, score, &target) && gnp_table_mean(table, row, score) < target;
}

struct gnp_verdict gnp_table_verdict(const struct gnp_table *table, enum gnp_method method)
{
	struct gnp_verdict verdict = {0};
	struct gnp_row row;
	double target;
	for (bool more = gnp_selection_next(&table->selection, NULL, &row); more; more = gnp_selection_next(&table->selection, &row, &row))
		for (int s = 0; s < GNP_SCORES && row.method == method; s++) {
			enum gnp_score score = (enum gnp_score)s;
			verdict.cells++;
			verdict.below_gnp += gnp_table_beats_one(table, &row, GNP_PUBLISHED_GNP, score);
			verdict.judged += gnp_published_target(row.family, row.regime, score, &target);
			verdict.below_both += gnp_table_beats(table, &row, score);
		}
	return verdict;
}
