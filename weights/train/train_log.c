#include "weights/train/train_log.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "clients/file_io.h"
#include "proto/tensor/message.h"

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
	double *const first[FIRST] = {&row->seconds, &row->patches_per_second, &row->report.rate, &row->report.norm, &row->report.loss,
	                          &row->report.operations};
	double *const kinds[KINDS] = {terms->patch, terms->centre, terms->cell, terms->near};
	if (column < FIRST)
		return first[column];
	column -= FIRST;
	if (column < KINDS * GNP_LOSS_TERMS)
		return &kinds[column / GNP_LOSS_TERMS][column % GNP_LOSS_TERMS];
	return &row->watched[column - KINDS * GNP_LOSS_TERMS];
}

static void column_name(int column, char *name, size_t size)
{
	static const char *const kinds[KINDS] = {"patch", "centre", "cell", "near"};
	static const char *const first[FIRST] = {"seconds", "patches_per_second", "rate", "gradient_norm", "loss", "operations_per_patch"};
	int rest = column - FIRST;
	if (column < FIRST)
		snprintf(name, size, "%s", first[column]);
	else if (rest < KINDS * GNP_LOSS_TERMS)
		snprintf(name, size, "%s_%s", kinds[rest / GNP_LOSS_TERMS], gnp_loss_name((enum gnp_loss_term)(rest % GNP_LOSS_TERMS)));
	else
		snprintf(name, size, "watched_%s", gnp_score_name((enum gnp_score)(rest - KINDS * GNP_LOSS_TERMS)));
}

gnp_status gnp_train_log_save(const struct gnp_train_log *log, const char *path, struct gnp_error *error)
{
	struct gnp_buffer text = {0};
	char name[64];
	gnp_status status = gnp_buffer_printf(&text, error, "step");
	for (int c = 0; c < COLUMNS && status == GNP_OK; c++) {
		column_name(c, name, sizeof name);
		status = gnp_buffer_printf(&text, error, ",%s%s", name, c == COLUMNS - 1 ? "\n" : "");
	}
	for (size_t i = 0; i < log->count && status == GNP_OK; i++) {
		struct gnp_train_row row = log->rows[i];
		status = gnp_buffer_printf(&text, error, "%llu", (unsigned long long)row.step);
		for (int c = 0; c < COLUMNS && status == GNP_OK; c++)
			status = gnp_buffer_printf(&text, error, ",%.6g%s", *column_of(&row, c), c == COLUMNS - 1 ? "\n" : "");
	}
	if (status == GNP_OK)
		status = gnp_file_write(path, text.data, text.size, error);
	gnp_buffer_clear(&text);
	return status;
}

static bool parse_row(const char *line, struct gnp_train_row *row)
{
	char *end;
	*row = (struct gnp_train_row){.step = strtoull(line, &end, 10)};
	for (int c = 0; c < COLUMNS; c++) {
		if (*end != ',')
			return false;
		*column_of(row, c) = strtod(end + 1, &end);
	}
	return *end == '\n';
}

gnp_status gnp_train_log_load(const char *path, uint64_t last_step, struct gnp_train_log *log, struct gnp_error *error)
{
	struct gnp_buffer text = {0};
	struct gnp_train_row row;
	if (access(path, F_OK) != 0)
		return GNP_OK;
	gnp_status status = gnp_file_read(path, &text, error);
	if (status == GNP_OK)
		status = gnp_buffer_append(&text, "", 1, error);
	const char *line = status == GNP_OK ? strchr((char *)text.data, '\n') : NULL;
	while (line && line[1] && status == GNP_OK) {
		if (!parse_row(line + 1, &row))
			status = gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: row %zu is no row of a training's history", path, log->count + 1);
		else if (row.step <= last_step)
			status = gnp_train_log_add(log, &row, error);
		line = strchr(line + 1, '\n');
	}
	gnp_buffer_clear(&text);
	return status;
}
