#include "weights/train/train_log.h"

#include <stdio.h>
#include <stdlib.h>

#include "weights/train/history.h"

void gnp_train_log_clear(struct gnp_train_log *log)
{
	free(log->rows);
	*log = (struct gnp_train_log){0};
}

gnp_status gnp_train_log_add(struct gnp_train_log *log, const struct gnp_train_row *row, struct gnp_error *error)
{
	if (log->count == log->capacity) {
		size_t capacity = log->capacity ? 2 * log->capacity : 64;
		struct gnp_train_row *rows = realloc(log->rows, capacity * sizeof *rows);
		if (!rows)
			return gnp_error_set(error, GNP_OUT_OF_MEMORY, "training log: no memory for %zu rows", capacity);
		log->rows = rows;
		log->capacity = capacity;
	}
	log->rows[log->count++] = *row;
	return GNP_OK;
}

/* ---- Columns: every number of a row but the step ---- */

enum { FIRST = 6, KINDS = 4, COLUMNS = FIRST + KINDS * GNP_LOSS_TERMS + GNP_SCORES };

static double *column_of(struct gnp_train_row *row, int column)
{
	struct gnp_loss_terms *terms = &row->report.terms;
	double *const first[FIRST] = {&row->seconds,     &row->patches_per_second, &row->report.rate,
	                              &row->report.norm, &row->report.loss,        &row->report.operations};
	double *const kinds[KINDS] = {terms->patch, terms->centre, terms->cell, terms->near};
	if (column < FIRST)
		return first[column];
	column -= FIRST;
	if (column < KINDS * GNP_LOSS_TERMS)
		return &kinds[column / GNP_LOSS_TERMS][column % GNP_LOSS_TERMS];
	return &row->watched[column - KINDS * GNP_LOSS_TERMS];
}

static void column_name(size_t at, char *name, size_t size)
{
	static const char *const kinds[KINDS] = {"patch", "centre", "cell", "near"};
	static const char *const first[FIRST] = {"seconds", "patches_per_second",  "rate", "gradient_norm",
	                                         "loss",    "operations_per_patch"};
	int column = (int)at, rest = column - FIRST;
	if (column < FIRST)
		snprintf(name, size, "%s", first[column]);
	else if (rest < KINDS * GNP_LOSS_TERMS)
		snprintf(name, size, "%s_%s", kinds[rest / GNP_LOSS_TERMS],
		         gnp_loss_name((enum gnp_loss_term)(rest % GNP_LOSS_TERMS)));
	else
		snprintf(name, size, "watched_%s", gnp_score_name((enum gnp_score)(rest - KINDS * GNP_LOSS_TERMS)));
}

static const struct gnp_history_columns columns = {COLUMNS, column_name};

/* ---- As a history ---- */

static gnp_status to_history(const struct gnp_train_log *log, struct gnp_history *history, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	*history = (struct gnp_history){.columns = &columns};
	for (size_t i = 0; i < log->count && status == GNP_OK; i++) {
		double values[COLUMNS];
		for (int c = 0; c < COLUMNS; c++)
			values[c] = *column_of(&log->rows[i], c);
		status = gnp_history_add(history, log->rows[i].step, values, error);
	}
	return status;
}

gnp_status gnp_train_log_save(const struct gnp_train_log *log, const char *path, struct gnp_error *error)
{
	struct gnp_history history;
	gnp_status status = to_history(log, &history, error);
	if (status == GNP_OK)
		status = gnp_history_save(&history, path, error);
	gnp_history_clear(&history);
	return status;
}

gnp_status gnp_train_log_load(const char *path, uint64_t last_step, struct gnp_train_log *log, struct gnp_error *error)
{
	struct gnp_history history = {.columns = &columns};
	gnp_status status = gnp_history_load(path, last_step, &history, error);
	for (size_t i = 0; i < history.count && status == GNP_OK; i++) {
		struct gnp_train_row row = {.step = history.steps[i]};
		for (int c = 0; c < COLUMNS; c++)
			*column_of(&row, c) = history.values[i * COLUMNS + (size_t)c];
		status = gnp_train_log_add(log, &row, error);
	}
	gnp_history_clear(&history);
	return status;
}

gnp_status gnp_train_log_draw(const struct gnp_train_log *log, const char *title, const char *path, struct gnp_error *error)
{
	enum { LOSS = 4, WATCHED = 6 + 2 * GNP_LOSS_TERMS };
	static const struct gnp_history_curve curves[] = {{"loss", {150, 150, 150}, LOSS},
	                                                  {"shape", {200, 120, 20}, WATCHED + GNP_SCORE_SECOND_FORM},
	                                                  {"gaussian", {190, 30, 45}, WATCHED + GNP_SCORE_GAUSSIAN},
	                                                  {"mean", {30, 90, 180}, WATCHED + GNP_SCORE_MEAN}};
	struct gnp_history history;
	gnp_status status = to_history(log, &history, error);
	if (status == GNP_OK)
		status = gnp_history_draw(&history, curves, sizeof curves / sizeof *curves, title, path, error);
	gnp_history_clear(&history);
	return status;
}
