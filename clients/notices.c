#include "clients/notices.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "proto/file/file.h"
#include "proto/tensor/number.h"
#include "proto/tensor/warnings.h"

enum { NAME_WIDTH = 26 };

/* What a terminal would take for more than text becomes spaces. */
static void print_text(const char *text, size_t length, FILE *out)
{
	for (size_t i = 0; i < length; i++)
		putc((unsigned char)text[i] < 0x20 || text[i] == 0x7f ? ' ' : text[i], out);
}

static void print_line(const char *name, const char *text, size_t length)
{
	size_t width = strlen(name);
	print_text(name, width, stdout);
	printf("%*s ", width < NAME_WIDTH ? (int)(NAME_WIDTH - width) : 0, "");
	print_text(text, length, stdout);
	putchar('\n');
}

void gnp_notices_warn(const struct gnp_values *parameters, const struct gnp_arguments *arguments)
{
	const char *joined = gnp_warnings_of(parameters), *text;
	size_t length;
	while (!gnp_arguments_has(arguments, "quiet") && gnp_warnings_next(&joined, &text, &length)) {
		fputs("gnp: warning: ", stderr);
		print_text(text, length, stderr);
		putc('\n', stderr);
	}
}

void gnp_notices_of_answer(const struct gnp_format *format, const struct gnp_buffer *answer, const struct gnp_buffer *header,
                           struct gnp_values *parameters)
{
	if (answer->size)
		gnp_file_parameters(format, answer->data, answer->size, parameters, NULL);
	if (!parameters->count && header->size)
		gnp_parameters_read((const char *)header->data, header->size, parameters, NULL);
}

static void print_value(const struct gnp_value *value)
{
	char text[GNP_NUMBER_LENGTH_MAX + 1];
	switch (value->type) {
	case GNP_VALUE_BOOL: snprintf(text, sizeof text, "%s", value->boolean ? "true" : "false"); break;
	case GNP_VALUE_INTEGER: snprintf(text, sizeof text, "%" PRId64, value->integer); break;
	case GNP_VALUE_NUMBER: text[gnp_number_write_double(text, value->number)] = '\0'; break;
	case GNP_VALUE_STRING: print_line(value->name, value->string, strlen(value->string)); return;
	}
	print_line(value->name, text, strlen(text));
}

void gnp_notices_print(const struct gnp_values *parameters)
{
	const char *joined = gnp_warnings_of(parameters), *text;
	size_t length;
	for (size_t i = 0; i < parameters->count; i++)
		if (strcmp(parameters->items[i].name, GNP_WARNINGS_NAME) != 0)
			print_value(&parameters->items[i]);
	while (gnp_warnings_next(&joined, &text, &length))
		print_line("warning", text, length);
}
