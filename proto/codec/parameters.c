#include "proto/codec/parameters.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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
			status = gnp_buffer_printf(buffer, error, "\\u%04x\\u%04x", 0xd800 + ((code - 0x10000) >> 10),
			                           0xdc00 + (code & 0x3ff));
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

gnp_status gnp_parameters_write_short(const struct gnp_values *values, struct gnp_buffer *buffer,
                                      struct gnp_error *error)
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

/* ---- Reading ---- */

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

/* key: of the member whose members are added; NULL: the document's own. */
static gnp_status read_members(const char *text, size_t size, const char *key, struct gnp_values *values,
                               struct gnp_error *error)
{
	struct gnp_json_document document = {0};
	gnp_status status = gnp_json_parse(text, size, 1, NULL, NULL, &document, error);
	if (status == GNP_OK)
		status = add_members(key ? json_object_get(document.root, key) : document.root, values, error);
	gnp_json_clear(&document);
	return status;
}

gnp_status gnp_parameters_read(const char *text, size_t size, struct gnp_values *values, struct gnp_error *error)
{
	return read_members(text, size, NULL, values, error);
}

gnp_status gnp_parameters_read_member(const char *text, size_t size, struct gnp_values *values, struct gnp_error *error)
{
	return read_members(text, size, GNP_PARAMETERS_NAME, values, error);
}
