/* gnp info: prints what a cloud's file holds, with the spread of every field. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "clients/command.h"
#include "clients/fields.h"
#include "clients/file_io.h"
#include "clients/notices.h"
#include "core/base/memory.h"
#include "core/base/vector.h"
#include "proto/file/file.h"

static const struct gnp_option options[] = {
	{"input-format", 0, "NAME", "format of the input (default: by extension, else by its first bytes)"},
	{"fields", 0, "A,B,...", "show these only (default: all)"},
};

/* name, type, shape, then least, quantiles, greatest, mean of the finite values, and how many are not finite. */
static void print_spread(const char *label, double *values, size_t count)
{
	size_t finite = 0;
	double sum = 0;
	for (size_t i = 0; i < count; i++) {
		if (!isfinite(values[i]))
			continue;
		values[finite++] = values[i];
		sum += values[finite - 1];
	}
	printf("%-26s", label);
	if (finite) {
		static const double quantiles[] = {0, 0.02, 0.5, 0.98, 1};
		qsort(values, finite, sizeof *values, gnp_double_compare);
		for (size_t q = 0; q < sizeof quantiles / sizeof quantiles[0]; q++)
			printf(" %11.4g", values[(size_t)(quantiles[q] * (double)(finite - 1) + 0.5)]);
		printf(" %11.4g", sum / (double)finite);
	}
	if (finite < count)
		printf("  %zu not finite", count - finite);
	putchar('\n');
}

static gnp_status print_field(const struct gnp_tensor *field, struct gnp_error *error)
{
	size_t elements = 0, columns;
	gnp_tensor_elements(field->rank, field->shape, &elements);
	size_t rows = field->rank ? field->shape[0] : 1;
	if (field->datatype == GNP_BYTES || !elements) {
		printf("%-26s %s\n", field->name, elements ? "text" : "empty");
		return GNP_OK;
	}
	columns = elements / rows;
	double *values = gnp_array_new(rows, sizeof *values);
	if (!values)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "%s: no memory for %zu values", field->name, rows);
	for (size_t column = 0; column < columns; column++) {
		char label[GNP_TENSOR_NAME_MAX + 24];
		for (size_t i = 0; i < rows; i++)
			values[i] = gnp_tensor_get(field, i * columns + column);
		if (columns > 1)
			snprintf(label, sizeof label, "%s[%zu]", field->name, column);
		else
			snprintf(label, sizeof label, "%s", field->name);
		print_spread(label, values, rows);
	}
	free(values);
	return GNP_OK;
}

static void print_head(const char *path, const struct gnp_tensors *tensors)
{
	const struct gnp_tensor *points = gnp_tensors_find(tensors, "points");
	printf("%s: %zu points; fields:", path, points && points->rank ? points->shape[0] : 0);
	for (size_t i = 0; i < tensors->count; i++)
		printf("%s %s %s", i ? "," : "", tensors->items[i].name, gnp_datatype_name(tensors->items[i].datatype));
	printf("\n%-26s %11s %11s %11s %11s %11s %11s\n", "field", "least", "2%", "median", "98%", "greatest", "mean");
}

static gnp_status print_named(const struct gnp_tensors *tensors, const char *names, struct gnp_error *error)
{
	char *copy = strdup(names), *rest = NULL;
	gnp_status status = GNP_OK;
	if (!copy)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "--fields: no memory");
	for (char *name = strtok_r(copy, ",", &rest); name && status == GNP_OK; name = strtok_r(NULL, ",", &rest)) {
		const struct gnp_tensor *field = gnp_field_find(tensors, name);
		status = field ? print_field(field, error)
		               : gnp_error_set(error, GNP_NOT_FOUND, "field %.64s: not in the file", name);
	}
	free(copy);
	return status;
}

static gnp_status print_fields(const char *path, const struct gnp_arguments *arguments, const struct gnp_buffer *content,
                               struct gnp_error *error)
{
	const char *names = gnp_arguments_get(arguments, "fields", NULL);
	struct gnp_tensors tensors = {0};
	gnp_status status = gnp_file_unpack(path, gnp_arguments_get(arguments, "input-format", NULL), content, &tensors, error);
	if (status == GNP_OK) {
		print_head(path, &tensors);
		if (names)
			status = print_named(&tensors, names, error);
		for (size_t i = 0; !names && i < tensors.count && status == GNP_OK; i++)
			status = print_field(&tensors.items[i], error);
	}
	gnp_tensors_clear(&tensors);
	return status;
}

/* What the file says of itself. */
static gnp_status print_notices(const struct gnp_format *format, const struct gnp_buffer *content, struct gnp_error *error)
{
	struct gnp_values parameters = {0};
	gnp_status status = gnp_file_parameters(format, content->data, content->size, &parameters, error);
	if (status == GNP_OK && parameters.count) {
		puts("\nwhat the file says of itself");
		gnp_notices_print(&parameters);
	}
	gnp_values_clear(&parameters);
	return status;
}

/* Of formats that are only written, what the file says of itself is all that can be told. */
static enum gnp_exit run(const struct gnp_command *command, const struct gnp_arguments *arguments, struct gnp_error *error)
{
	(void)command;
	const char *path = arguments->operands[0];
	struct gnp_buffer content = {0};
	const struct gnp_format *format = NULL;
	gnp_status status = gnp_file_read(path, &content, error);
	bool known = status == GNP_OK && gnp_file_format_any(gnp_arguments_get(arguments, "input-format", NULL), path, &content, &format);
	if (known && !gnp_format_readable(format))
		printf("%s: %s, %zu bytes\n", path, gnp_format_name(format), content.size);
	else if (status == GNP_OK)
		status = print_fields(path, arguments, &content, error);
	if (status == GNP_OK)
		status = print_notices(format, &content, error);
	gnp_buffer_clear(&content);
	return gnp_exit_of(status, false);
}

const struct gnp_command gnp_command_info = {
	.name = "info",
	.operands = "FILE [--fields A,B,...]",
	.help = "what a cloud's file holds, with statistics of every field, and what it says of how it was made",
	.options = options,
	.option_count = sizeof options / sizeof options[0],
	.operands_least = 1,
	.operands_most = 1,
	.run = run,
};
