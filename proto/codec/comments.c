#include "proto/codec/comments.h"

#include <inttypes.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "proto/tensor/number.h"
#include "proto/tensor/warnings.h"

/* ---- Writing ---- */

static void comment_text(const struct gnp_value *value, char *text, size_t size)
{
	switch (value->type) {
	case GNP_VALUE_BOOL: snprintf(text, size, "%s", value->boolean ? "true" : "false"); break;
	case GNP_VALUE_INTEGER: snprintf(text, size, "%" PRId64, value->integer); break;
	case GNP_VALUE_NUMBER: text[gnp_number_write_double(text, value->number)] = '\0'; break;
	default: snprintf(text, size, "%s", value->string); break;
	}
	for (; *text; text++) {
		if ((unsigned char)*text < 0x20)
			*text = ' ';
	}
}

/* A line each: readers of some formats have no room for all in one. */
static gnp_status write_warnings(const char *joined, const char *prefix, struct gnp_buffer *buffer,
                                 struct gnp_error *error)
{
	const char *text;
	size_t length;
	gnp_status status = GNP_OK;
	while (status == GNP_OK && gnp_warnings_next(&joined, &text, &length))
		status = gnp_buffer_printf(buffer, error, "%s" GNP_WARNINGS_NAME " %.*s\n", prefix, (int)length, text);
	return status;
}

gnp_status gnp_comments_write(const struct gnp_values *comments, const char *prefix, struct gnp_buffer *buffer,
                              struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	for (size_t i = 0; comments && i < comments->count && status == GNP_OK; i++) {
		char text[512];
		if (strcmp(comments->items[i].name, GNP_WARNINGS_NAME) == 0) {
			status = write_warnings(comments->items[i].string, prefix, buffer, error);
			continue;
		}
		comment_text(&comments->items[i], text, sizeof text);
		status = gnp_buffer_printf(buffer, error, "%s%s %s\n", prefix, comments->items[i].name, text);
	}
	return status;
}

/* ---- Reading ---- */

static struct gnp_value *find_warnings(struct gnp_values *values)
{
	for (size_t i = 0; i < values->count; i++)
		if (strcmp(values->items[i].name, GNP_WARNINGS_NAME) == 0)
			return &values->items[i];
	return NULL;
}

/* Comments have a line for each warning: they become one text again. */
static gnp_status join_warning(struct gnp_value *warnings, const char *text, struct gnp_error *error)
{
	struct gnp_buffer joined = {0};
	gnp_status status = gnp_buffer_printf(&joined, error, "%s; %s", warnings->string, text);
	if (status != GNP_OK)
		return status;
	free(warnings->string);
	warnings->string = (char *)joined.data;
	return GNP_OK;
}

static bool is_blank(char c)
{
	return c == ' ' || c == '\t' || c == '\r';
}

gnp_status gnp_comments_add(const char *p, const char *end, struct gnp_values *values, struct gnp_error *error)
{
	enum { LINE_MAX_LENGTH = 8192 };
	char line[LINE_MAX_LENGTH];
	while (p < end && is_blank(*p))
		p++;
	while (end > p && is_blank(end[-1]))
		end--;
	size_t length = (size_t)(end - p) < sizeof line ? (size_t)(end - p) : sizeof line - 1;
	memcpy(line, p, length);
	line[length] = '\0';
	char *text = line + strcspn(line, " \t");
	if (*text)
		*text++ = '\0';
	text += strspn(text, " \t");
	bool heading = strcasecmp(line, "x") == 0 || strncasecmp(line, "x,", 2) == 0 || strncasecmp(line, "x;", 2) == 0;
	if (!*line || heading || *line == '%')
		return GNP_OK;
	struct gnp_value *warnings = strcmp(line, GNP_WARNINGS_NAME) == 0 ? find_warnings(values) : NULL;
	return warnings ? join_warning(warnings, text, error) : gnp_values_add_string(values, line, text, error);
}

gnp_status gnp_comments_read(const unsigned char *body, size_t size, const char *mark, const char *last,
                             struct gnp_values *values, struct gnp_error *error)
{
	enum { COMMENTS_MAX = 4096 };
	const char *p = (const char *)body, *end = p + size;
	size_t length = strlen(mark), stop = last ? strlen(last) : 0;
	gnp_status status = GNP_OK;
	while (p < end && status == GNP_OK && values->count < COMMENTS_MAX) {
		const char *newline = memchr(p, '\n', (size_t)(end - p)), *after = newline ? newline : end;
		size_t line = (size_t)(after - p);
		bool comment = line >= length && memcmp(p, mark, length) == 0;
		if (comment)
			status = gnp_comments_add(p + length, after, values, error);
		else if (last && line >= stop && memcmp(p, last, stop) == 0)
			break;
		p = newline ? newline + 1 : end;
	}
	return status;
}
