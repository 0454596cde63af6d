#include "proto/format/parameters.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "proto/format/file_codec.h"
#include "proto/json/json_text.h"
#include "proto/tensor/warnings.h"

/* ---- Writing ---- */

/* The code point of the valid UTF-8 at p; *length: its bytes. */
static unsigned read_utf8(const unsigned char *p, size_t *length)
{
	*length = p[0] < 0x80 ? 1 : p[0] < 0xe0 ? 2 : p[0] < 0xf0 ? 3 : 4;
	unsigned code = *length == 1 ? p[0] : p[0] & (0x7fu >> *length);
	for (size_t i = 1; i < *length; i++)
		code = code << 6 | (p[i] & 0x3f);
	return code;
}

/* Valid UTF-8, with everything beyond ASCII as \u. */
static gnp_status append_ascii(const struct gnp_buffer *json, struct gnp_buffer *buffer, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	size_t length;
	for (size_t i = 0; i < json->size && status == GNP_OK; i += length) {
		unsigned code = read_utf8(json->data + i, &length);
		if (code < 0x80)
			status = gnp_buffer_append(buffer, json->data + i, 1, error);
		else if (code < 0x10000)
			status = gnp_buffer_printf(buffer, error, "\\u%04x", code);
		else
			status = gnp_buffer_printf(buffer, error, "\\u%04x\\u%04x", 0xd800 + ((code - 0x10000) >> 10), 0xdc00 + (code & 0x3ff));
	}
	return status;
}

gnp_status gnp_parameters_write(const struct gnp_values *values, struct gnp_buffer *buffer, struct gnp_error *error)
{
	struct gnp_buffer json = {0};
	gnp_status status = gnp_json_write_values(values, &json, error);
	if (status == GNP_OK)
		status = append_ascii(&json, buffer, error);
	gnp_buffer_clear(&json);
	return status;
}

/* "precision; coincident" of the warnings' texts, in place. */
static void keep_kinds(char *joined)
{
	const char *rest = joined, *text;
	size_t length;
	char *to = joined;
	while (gnp_warnings_next(&rest, &text, &length)) {
		const char *colon = memchr(text, ':', length);
		size_t kind = colon ? (size_t)(colon - text) : length;
		memmove(to, text, kind);
		to += kind;
		if (*rest) {
			*to++ = ';';
			*to++ = ' ';
		}
	}
	*to = '\0';
}

/* The values with their warnings' kinds; what it holds is borrowed, but for *kinds. */
static gnp_status write_kinds(const struct gnp_values *values, struct gnp_buffer *buffer, struct gnp_error *error)
{
	char *kinds = strdup(gnp_warnings_of(values));
	struct gnp_values shorter = {.count = values->count};
	shorter.items = malloc(values->count * sizeof *shorter.items);
	gnp_status status = GNP_OK;
	if (!kinds || !shorter.items) {
		status = gnp_error_set(error, GNP_OUT_OF_MEMORY, "parameters: no memory for %zu", values->count);
	} else {
		memcpy(shorter.items, values->items, values->count * sizeof *shorter.items);
		keep_kinds(kinds);
		for (size_t i = 0; i < shorter.count; i++)
			if (strcmp(shorter.items[i].name, GNP_WARNINGS_NAME) == 0)
				shorter.items[i].string = kinds;
		status = gnp_parameters_write(&shorter, buffer, error);
	}
	free(shorter.items);
	free(kinds);
	return status;
}

gnp_status gnp_parameters_write_short(const struct gnp_values *values, struct gnp_buffer *buffer, struct gnp_error *error)
{
	size_t before = buffer->size;
	gnp_status status = gnp_parameters_write(values, buffer, error);
	if (status == GNP_OK && buffer->size - before > GNP_PARAMETERS_HEADER_MAX && *gnp_warnings_of(values)) {
		buffer->size = before;
		status = write_kinds(values, buffer, error);
	}
	if (status != GNP_OK || buffer->size - before > GNP_PARAMETERS_HEADER_MAX)
		buffer->size = before;
	return status;
}

/* ---- Reading JSON ---- */

static gnp_status add_member(const char *name, const json_t *value, struct gnp_values *values, struct gnp_error *error)
{
	if (json_is_string(value))
		return gnp_values_add_string(values, name, json_string_value(value), error);
	if (json_is_boolean(value))
		return gnp_values_add_bool(values, name, json_is_true(value), error);
	if (json_is_integer(value))
		return gnp_values_add_integer(values, name, json_integer_value(value), error);
	return json_is_real(value) ? gnp_values_add_number(values, name, json_real_value(value), error) : GNP_OK;
}

static gnp_status add_members(json_t *object, struct gnp_values *values, struct gnp_error *error)
{
	const char *name;
	json_t *value;
	gnp_status status = GNP_OK;
	json_object_foreach(object, name, value) {
		status = add_member(name, value, values, error);
		if (status != GNP_OK)
			break;
	}
	return status;
}

gnp_status gnp_parameters_read(const char *text, size_t size, struct gnp_values *values, struct gnp_error *error)
{
	struct gnp_json_document document = {0};
	gnp_status status = gnp_json_parse(text, size, 1, NULL, NULL, &document, error);
	if (status == GNP_OK)
		status = add_members(document.root, values, error);
	gnp_json_clear(&document);
	return status;
}

static gnp_status read_json_file(const unsigned char *body, size_t size, struct gnp_values *values, struct gnp_error *error)
{
	struct gnp_json_document document = {0};
	gnp_status status = gnp_json_parse((const char *)body, size, 1, NULL, NULL, &document, error);
	if (status == GNP_OK)
		status = add_members(json_object_get(document.root, GNP_PARAMETERS_NAME), values, error);
	gnp_json_clear(&document);
	return status;
}

static gnp_status read_npz(const unsigned char *body, size_t size, struct gnp_values *values, struct gnp_error *error)
{
	struct gnp_buffer json = {0};
	gnp_status status = gnp_npz_parameters(body, size, &json, error);
	if (status == GNP_OK && json.size)
		status = gnp_parameters_read((const char *)json.data, json.size, values, error);
	gnp_buffer_clear(&json);
	return status;
}

/* ---- Reading comments ---- */

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

/* A comment, without what marks it as one. The names of columns are none, nor is the first line of Matrix Market. */
static gnp_status add_comment(const char *p, const char *end, struct gnp_values *values, struct gnp_error *error)
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

/* Lines that begin with `mark`, up to the line that begins with `last`, or to the end where that is NULL; "": to the first other line. */
static gnp_status read_comments(const unsigned char *body, size_t size, const char *mark, const char *last, struct gnp_values *values,
                                struct gnp_error *error)
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
			status = add_comment(p + length, after, values, error);
		else if (last && line >= stop && memcmp(p, last, stop) == 0)
			break;
		p = newline ? newline + 1 : end;
	}
	return status;
}

/* The field that answers have, or the title. */
static gnp_status read_vtk(const unsigned char *body, size_t size, struct gnp_values *values, struct gnp_error *error)
{
	enum { HEAD = 1024 };
	static const char field[] = "\nFIELD FieldData 1\n" GNP_PARAMETERS_NAME " 1 ";
	const char *text = (const char *)body, *end = text + size;
	const char *at = memmem(text, size < HEAD ? size : HEAD, field, sizeof field - 1);
	size_t count = 0;
	for (at = at ? at + sizeof field - 1 : NULL; at && at < end && *at >= '0' && *at <= '9' && count <= size; at++)
		count = 10 * count + (size_t)(*at - '0');
	const char *data = at ? memchr(at, '\n', (size_t)(end - at)) : NULL;
	if (data && count < (size_t)(end - data))
		return gnp_parameters_read(data + 1, count, values, error);
	const char *first = memchr(text, '\n', size), *title = first ? first + 1 : end, *stop = memchr(title, '\n', (size_t)(end - title));
	return stop ? add_comment(title, stop, values, error) : GNP_OK;
}

gnp_status gnp_file_parameters(enum gnp_format format, const unsigned char *body, size_t size, struct gnp_values *values,
                               struct gnp_error *error)
{
	switch (format) {
	case GNP_FORMAT_PLY: return read_comments(body, size, "comment ", "end_header", values, error);
	case GNP_FORMAT_PCD: return read_comments(body, size, "#", "DATA", values, error);
	case GNP_FORMAT_MTX: return read_comments(body, size, "%", "", values, error);
	case GNP_FORMAT_XYZ:
	case GNP_FORMAT_CSV:
	case GNP_FORMAT_OBJ: return read_comments(body, size, "#", NULL, values, error);
	case GNP_FORMAT_NPZ: return read_npz(body, size, values, error);
	case GNP_FORMAT_VTK: return read_vtk(body, size, values, error);
	case GNP_FORMAT_JSON: return read_json_file(body, size, values, error);
	default: return GNP_OK;
	}
}
