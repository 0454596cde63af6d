#include "proto/json/json_text.h"

#include <inttypes.h>
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "proto/json/json_memory.h"
#include "proto/tensor/number.h"

enum { DEPTH_MAX = 100, ENVELOPE_MAX = 1 << 20 };

/* Walks the text once: counts nesting, finds the arrays to cut, copies the rest. */
struct cutter {
	const char *p, *end;
	unsigned depth, target;
	const char *key;
	size_t key_length;
	bool matched; /* the last string was the key, at the target depth */
	struct gnp_buffer envelope;
	struct gnp_json_span *spans;
	size_t count, capacity;
	struct gnp_error *error;
};

const char *gnp_json_skip_string(const char *p, const char *end)
{
	for (p++; p < end && *p != '"'; p++)
		p += *p == '\\' && p + 1 < end;
	return p < end ? p + 1 : end;
}

static gnp_status too_deep(struct gnp_error *error)
{
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "JSON: nested deeper than %d", DEPTH_MAX);
}

/* *after: the address past the array that starts at p; the text's end when it never closes. */
static gnp_status skip_array(const char *p, const char *end, unsigned depth, const char **after,
                             struct gnp_error *error)
{
	unsigned inner = 0;
	while (p < end) {
		char c = *p;
		if (c == '"') {
			p = gnp_json_skip_string(p, end);
			continue;
		}
		if ((c == '[' || c == '{') && depth + ++inner > DEPTH_MAX)
			return too_deep(error);
		p++;
		if ((c == ']' || c == '}') && --inner == 0)
			break;
	}
	*after = p;
	return GNP_OK;
}

static gnp_status copy(struct cutter *c, const char *text, size_t size)
{
	if (c->envelope.size + size > ENVELOPE_MAX)
		return gnp_error_set(c->error, GNP_TOO_LARGE, "JSON: more than %d bytes besides the data arrays", ENVELOPE_MAX);
	return gnp_buffer_append(&c->envelope, text, size, c->error);
}

static char last_copied(const struct cutter *c)
{
	return c->envelope.size ? (char)c->envelope.data[c->envelope.size - 1] : ' ';
}

static gnp_status cut_array(struct cutter *c)
{
	const char *after = c->end;
	gnp_status status = skip_array(c->p, c->end, c->depth, &after, c->error);
	if (status != GNP_OK)
		return status;
	if (c->count == c->capacity) {
		size_t capacity = c->capacity ? 2 * c->capacity : 8;
		struct gnp_json_span *spans = realloc(c->spans, capacity * sizeof *spans);
		if (!spans)
			return gnp_error_set(c->error, GNP_OUT_OF_MEMORY, "JSON: no memory for %zu arrays", capacity);
		c->spans = spans;
		c->capacity = capacity;
	}
	c->spans[c->count] = (struct gnp_json_span){c->p, (size_t)(after - c->p)};
	c->p = after;
	c->matched = false;
	char index[24];
	return copy(c, index, (size_t)sprintf(index, "[%zu]", c->count++));
}

/* One string or one other character. A key counts once its colon was seen: `matched` survives only colons and
 * spaces. */
static gnp_status cut_step(struct cutter *c)
{
	const char *start = c->p;
	if (*start == '"') {
		c->p = gnp_json_skip_string(start, c->end);
		size_t length = (size_t)(c->p - start);
		c->matched = c->depth == c->target &&
		             (!c->key || (length == c->key_length + 2 && memcmp(start + 1, c->key, c->key_length) == 0));
		return copy(c, start, length);
	}
	if (*start == '[' && c->matched && last_copied(c) == ':')
		return cut_array(c);
	if (*start == '[' || *start == '{') {
		if (++c->depth > DEPTH_MAX)
			return too_deep(c->error);
	} else if ((*start == ']' || *start == '}') && c->depth) {
		c->depth--;
	}
	c->p++;
	if (strchr(" \n\r\t", *start) && *start)
		return strchr(" :,[{", last_copied(c)) ? GNP_OK : copy(c, " ", 1);
	c->matched = c->matched && *start == ':';
	return copy(c, start, 1);
}

/* The structure of the envelope, and what is reserved for it. On failure *out is unchanged and nothing stays
 * reserved. */
static gnp_status load(const struct gnp_buffer *envelope, const struct gnp_budget *budget,
                       struct gnp_json_document *out, struct gnp_error *error)
{
	if (envelope->size == 0)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "JSON: the text is empty");
	size_t bytes = gnp_json_memory_size(envelope->size);
	gnp_status status = gnp_budget_reserve(budget, bytes, error);
	if (status != GNP_OK)
		return status;
	json_error_t reason;
	void *memory;
	bool exhausted;
	json_t *root = gnp_json_memory_load((const char *)envelope->data, envelope->size, &memory, &exhausted, &reason);
	if (root && json_is_object(root)) {
		*out = (struct gnp_json_document){.root = root, .memory = memory, .budget = budget, .reserved = bytes};
		return GNP_OK;
	}
	if (exhausted)
		status = gnp_error_set(error, GNP_OUT_OF_MEMORY, "JSON: no memory for %zu bytes besides the data arrays",
		                       envelope->size);
	else
		status = gnp_error_set(error, GNP_INVALID_ARGUMENT, "JSON: %s", root ? "need an object" : reason.text);
	json_decref(root);
	free(memory);
	gnp_budget_release(budget, bytes);
	return status;
}

gnp_status gnp_json_parse(const char *text, size_t size, unsigned depth, const char *key,
                          const struct gnp_budget *budget, struct gnp_json_document *out, struct gnp_error *error)
{
	struct cutter c = {.p = text, .end = text + size, .target = depth, .key = key, .key_length = key ? strlen(key) : 0,
	                   .error = error};
	gnp_status status = GNP_OK;
	while (c.p < c.end && status == GNP_OK)
		status = cut_step(&c);
	if (status == GNP_OK)
		status = load(&c.envelope, budget, out, error);
	if (status == GNP_OK) {
		out->spans = c.spans;
		out->count = c.count;
		c.spans = NULL;
	}
	free(c.spans);
	gnp_buffer_clear(&c.envelope);
	return status;
}

void gnp_json_clear(struct gnp_json_document *document)
{
	json_decref(document->root);
	free(document->memory);
	free(document->spans);
	gnp_budget_release(document->budget, document->reserved);
	*document = (struct gnp_json_document){0};
}

const struct gnp_json_span *gnp_json_member_span(const struct gnp_json_document *document, const json_t *member)
{
	const json_t *index = json_array_get(member, 0);
	if (json_array_size(member) != 1 || !json_is_integer(index))
		return NULL;
	json_int_t i = json_integer_value(index);
	return i >= 0 && (size_t)i < document->count ? &document->spans[i] : NULL;
}

/* Length of the valid UTF-8 sequence at text (NUL-terminated), 0 when there is none. */
static size_t utf8_length(const unsigned char *text)
{
	static const unsigned smallest[] = {0, 0, 0x80, 0x800, 0x10000};
	size_t length = text[0] < 0x80 ? 1 : text[0] >> 5 == 6 ? 2 : text[0] >> 4 == 14 ? 3 : text[0] >> 3 == 30 ? 4 : 0;
	if (length < 2)
		return length;
	unsigned code = text[0] & (0xffu >> (length + 1));
	for (size_t i = 1; i < length; i++) {
		if (text[i] >> 6 != 2)
			return 0;
		code = code << 6 | (text[i] & 63);
	}
	return code < smallest[length] || code > 0x10ffff || code >> 11 == 0x1b ? 0 : length;
}

gnp_status gnp_json_write_string(const char *text, struct gnp_buffer *buffer, struct gnp_error *error)
{
	gnp_status status = gnp_buffer_append(buffer, "\"", 1, error);
	for (const unsigned char *p = (const unsigned char *)text; *p && status == GNP_OK;) {
		size_t length = utf8_length(p);
		if (!length)
			status = gnp_buffer_append(buffer, "\xef\xbf\xbd", 3, error);
		else if (*p < 0x20 || *p == 0x7f)
			status = gnp_buffer_printf(buffer, error, "\\u%04x", *p);
		else if (*p == '"' || *p == '\\')
			status = gnp_buffer_printf(buffer, error, "\\%c", *p);
		else
			status = gnp_buffer_append(buffer, p, length, error);
		p += length ? length : 1;
	}
	return status == GNP_OK ? gnp_buffer_append(buffer, "\"", 1, error) : status;
}

void gnp_json_put_string(struct gnp_writer *writer, const char *text)
{
	if (writer->status == GNP_OK)
		writer->status = gnp_json_write_string(text, writer->buffer, writer->error);
}

static void put_number(struct gnp_writer *w, double number)
{
	char text[GNP_NUMBER_LENGTH_MAX + 1];
	text[gnp_number_write_double(text, number)] = '\0';
	gnp_writer_text(w, isfinite(number) ? text : "null");
}

static void put_value(struct gnp_writer *w, const struct gnp_value *value)
{
	switch (value->type) {
	case GNP_VALUE_BOOL: gnp_writer_text(w, value->boolean ? "true" : "false"); break;
	case GNP_VALUE_INTEGER: gnp_writer_printf(w, "%" PRId64, value->integer); break;
	case GNP_VALUE_STRING: gnp_json_put_string(w, value->string); break;
	case GNP_VALUE_NUMBER: put_number(w, value->number); break;
	}
}

gnp_status gnp_json_write_values(const struct gnp_values *values, struct gnp_buffer *buffer, struct gnp_error *error)
{
	struct gnp_writer w = gnp_writer_to(buffer, error);
	gnp_writer_text(&w, "{");
	for (size_t i = 0; i < values->count; i++) {
		gnp_writer_text(&w, i ? "," : "");
		gnp_json_put_string(&w, values->items[i].name);
		gnp_writer_text(&w, ":");
		put_value(&w, &values->items[i]);
	}
	gnp_writer_text(&w, "}");
	return w.status;
}
