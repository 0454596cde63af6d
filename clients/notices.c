#include "notices.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "number.h"
#include "warnings.h"

void gnp_notices_warn(const struct gnp_values *parameters, const struct gnp_arguments *arguments)
{
	const char *joined = gnp_warnings_of(parameters), *text;
	size_t length;
	while (!gnp_arguments_has(arguments, "quiet") && gnp_warnings_next(&joined, &text, &length))
		fprintf(stderr, "gnp: warning: %.*s\n", (int)length, text);
}

void gnp_notices_of_answer(enum gnp_format format, const struct gnp_buffer *answer, const struct gnp_buffer *header,
                           struct gnp_values *parameters)
{
	if (answer->size)
		gnp_file_parameters(format, answer->data, answer->size, parameters, NULL);
	if (!parameters->count && header->size)
		gnp_parameters_read((const char *)header->data, header->size, parameters, NULL);
}

static void print_value(const struct gnp_value *value)
{
	char number[GNP_NUMBER_LENGTH_MAX + 1];
	switch (value->type) {
	case GNP_VALUE_BOOL: printf("%-26s %s\n", value->name, value->boolean ? "true" : "false"); break;
	case GNP_VALUE_INTEGER: printf("%-26s %" PRId64 "\n", value->name, value->integer); break;
	case GNP_VALUE_STRING: printf("%-26s %s\n", value->name, value->string); break;
	default:
		number[gnp_number_write_double(number, value->number)] = '\0';
		printf("%-26s %s\n", value->name, number);
	}
}

void gnp_notices_print(const struct gnp_values *parameters)
{
	const char *joined = gnp_warnings_of(parameters), *text;
	size_t length;
	for (size_t i = 0; i < parameters->count; i++)
		if (strcmp(parameters->items[i].name, GNP_WARNINGS_NAME) != 0)
			print_value(&parameters->items[i]);
	while (gnp_warnings_next(&joined, &text, &length))
		printf("%-26s %.*s\n", "warning", (int)length, text);
}
