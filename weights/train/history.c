#include "weights/train/history.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "clients/file_io.h"
#include "core/base/memory.h"
#include "proto/tensor/message.h"

void gnp_history_clear(struct gnp_history *history)
{
	free(history->steps);
	free(history->values);
	*history = (struct gnp_history){.columns = history->columns};
}

static gnp_status grow(struct gnp_history *history, struct gnp_error *error)
{
	size_t capacity = history->capacity ? 2 * history->capacity : 64, columns = history->columns->count;
	uint64_t *steps = realloc(history->steps, capacity * sizeof *steps);
	if (steps)
		history->steps = steps;
	double *values = steps ? realloc(history->values, capacity * columns * sizeof *values) : NULL;
	if (!values)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "training log: no memory for %zu rows", capacity);
	history->values = values;
	history->capacity = capacity;
	return GNP_OK;
}

gnp_status gnp_history_add(struct gnp_history *history, uint64_t step, const double *values, struct gnp_error *error)
{
	size_t columns = history->columns->count;
	gnp_status status = history->count == history->capacity ? grow(history, error) : GNP_OK;
	if (status != GNP_OK)
		return status;
	history->steps[history->count] = step;
	memcpy(history->values + history->count * columns, values, columns * sizeof *values);
	history->count++;
	return GNP_OK;
}

gnp_status gnp_history_save(const struct gnp_history *history, const char *path, struct gnp_error *error)
{
	struct gnp_buffer text = {0};
	size_t columns = history->columns->count;
	char name[64];
	gnp_status status = gnp_buffer_printf(&text, error, "step");
	for (size_t c = 0; c < columns && status == GNP_OK; c++) {
		history->columns->name(c, name, sizeof name);
		status = gnp_buffer_printf(&text, error, ",%s%s", name, c == columns - 1 ? "\n" : "");
	}
	for (size_t i = 0; i < history->count && status == GNP_OK; i++) {
		status = gnp_buffer_printf(&text, error, "%llu", (unsigned long long)history->steps[i]);
		for (size_t c = 0; c < columns && status == GNP_OK; c++)
			status = gnp_buffer_printf(&text, error, ",%.6g%s", history->values[i * columns + c],
			                           c == columns - 1 ? "\n" : "");
	}
	if (status == GNP_OK)
		status = gnp_file_write(path, text.data, text.size, error);
	gnp_buffer_clear(&text);
	return status;
}

static bool parse_row(const char *line, size_t columns, uint64_t *step, double *values)
{
	char *end;
	*step = strtoull(line, &end, 10);
	for (size_t c = 0; c < columns; c++) {
		if (*end != ',')
			return false;
		values[c] = strtod(end + 1, &end);
	}
	return *end == '\n';
}

static gnp_status read_rows(const char *path, const char *line, uint64_t last_step, double *values,
                            struct gnp_history *history, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	uint64_t step;
	for (; line && line[1] && status == GNP_OK; line = strchr(line + 1, '\n')) {
		if (!parse_row(line + 1, history->columns->count, &step, values))
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: row %zu is no row of a training's history", path,
			                     history->count + 1);
		if (step <= last_step)
			status = gnp_history_add(history, step, values, error);
	}
	return status;
}

gnp_status gnp_history_load(const char *path, uint64_t last_step, struct gnp_history *history, struct gnp_error *error)
{
	struct gnp_buffer text = {0};
	if (access(path, F_OK) != 0)
		return GNP_OK;
	double *values = gnp_array_new(history->columns->count, sizeof *values);
	gnp_status status = values ? gnp_file_read(path, &text, error)
	                           : gnp_error_set(error, GNP_OUT_OF_MEMORY, "training log: no memory for a row");
	if (status == GNP_OK)
		status = gnp_buffer_append(&text, "", 1, error);
	if (status == GNP_OK)
		status = read_rows(path, strchr((char *)text.data, '\n'), last_step, values, history, error);
	gnp_buffer_clear(&text);
	free(values);
	return status;
}
