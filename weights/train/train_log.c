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

enum { COLUMNS = 6 + 2 * GNP_LOSS_TERMS + GNP_SCORES };

static double *column_of(struct gnp_train_row *row, int column)
{
	double *const first[6] = {&row->seconds, &row->patches_per_second, &row->report.rate, &row->report.norm, &row->report.loss,
	                          &row->report.operations};
	if (column < 6)
		return first[column];
	column -= 6;
	if (column < GNP_LOSS_TERMS)
		return &row->report.terms.patch[column];
	column -= GNP_LOSS_TERMS;
	return column < GNP_LOSS_TERMS ? &row->report.terms.centre[column] : &row->watched[column - GNP_LOSS_TERMS];
}

static void column_name(size_t at, char *name, size_t size)
{
	static const char *const first[6] = {"seconds", "patches_per_second", "rate", "gradient_norm", "loss", "operations_per_patch"};
	int column = (int)at;
	if (column < 6)
		snprintf(name, size, "%s", first[column]);
	else if (column < 6 + GNP_LOSS_TERMS)
		snprintf(name, size, "patch_%s", gnp_loss_name((enum gnp_loss_term)(column - 6)));
	else if (column < 6 + 2 * GNP_LOSS_TERMS)
		snprintf(name, size, "centre_%s", gnp_loss_name((enum gnp_loss_term)(column - 6 - GNP_LOSS_TERMS)));
	else
		snprintf(name, size, "watched_%s", gnp_score_name((enum gnp_score)(column - 6 - 2 * GNP_LOSS_TERMS)));
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
