/* XYZ, TXT, PTS and CSV: a row of numbers a line, separated by blanks, commas or semicolons. A heading line or
 * comment that names x, y and z names the columns; without one the first three are the point and, of exactly six,
 * the rest the normal. */
#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "core/base/memory.h"
#include "proto/codec/comments.h"
#include "proto/codec/fields.h"
#include "proto/codec/rows.h"
#include "proto/format/format.h"
#include "proto/tensor/number.h"

enum { COLUMNS_MAX = 256, NAME_MAX_LENGTH = 48 };

struct table {
	const char *p, *end;
	size_t line; /* of the file, from 1 */
	char names[COLUMNS_MAX][NAME_MAX_LENGTH];
	size_t named;   /* columns of the heading */
	size_t columns; /* of the first row */
	size_t rows, capacity;
	double *values; /* (capacity, columns) */
	const struct gnp_budget *budget; /* holds what values take */
	struct gnp_error *error;
};

static bool is_separator(char c)
{
	return c == ' ' || c == '\t' || c == ',' || c == ';' || c == '\r';
}

/* The next line's ends; false at the end of the file. */
static bool next_line(struct table *t, const char **start, const char **stop)
{
	if (t->p >= t->end)
		return false;
	const char *newline = memchr(t->p, '\n', (size_t)(t->end - t->p));
	*start = t->p;
	*stop = newline ? newline : t->end;
	t->p = newline ? newline + 1 : t->end;
	t->line++;
	return true;
}

/* Takes the line as the heading when it names x, y and z. */
static void read_heading(struct table *t, const char *p, const char *stop)
{
	unsigned seen = 0;
	size_t count = 0;
	while (p < stop && (*p == '#' || *p == '/' || is_separator(*p)))
		p++;
	while (p < stop && count < COLUMNS_MAX) {
		size_t length = 0;
		char *name = t->names[count];
		for (; p < stop && !is_separator(*p); p++) {
			if (*p != '"' && length + 1 < NAME_MAX_LENGTH)
				name[length++] = (char)tolower((unsigned char)*p);
		}
		name[length] = '\0';
		if (length == 1 && name[0] >= 'x' && name[0] <= 'z')
			seen |= 1u << (name[0] - 'x');
		count++;
		while (p < stop && is_separator(*p))
			p++;
	}
	if (seen == 7)
		t->named = count;
}

/* Numbers of a line into values (COLUMNS_MAX); false when something else is there. */
static bool read_numbers(const char *p, const char *stop, double *values, size_t *count)
{
	*count = 0;
	for (;;) {
		while (p < stop && is_separator(*p))
			p++;
		if (p == stop || *p == '#')
			return true;
		if (*count == COLUMNS_MAX)
			return false;
		p = gnp_number_read(p, stop, &values[*count]);
		if (!p || (p < stop && !is_separator(*p)))
			return false;
		++*count;
	}
}

static gnp_status bad_line(struct table *t, const char *start, const char *stop)
{
	size_t length = (size_t)(stop - start);
	return gnp_error_set(t->error, GNP_INVALID_ARGUMENT, "xyz: line %zu: \"%.*s\": need %s numbers", t->line,
	                     (int)(length < 40 ? length : 40), start,
	                     t->columns ? "the first row's count of" : "3 or more");
}

/* Rows to make room for: half as many again, but not more than the rest of the text can hold, with a digit and a
 * separator a number. */
static size_t next_capacity(const struct table *t)
{
	size_t most = t->rows + 1 + ((size_t)(t->end - t->p) + 1) / (2 * t->columns),
	              more = t->capacity + t->capacity / 2 + 1024;
	return more < most ? more : most;
}

static gnp_status grow(struct table *t)
{
	if (t->rows < t->capacity)
		return GNP_OK;
	size_t width = t->columns * sizeof *t->values, capacity = next_capacity(t), bytes;
	double *values = NULL;
	bool fits = gnp_size_multiply(capacity, width, &bytes);
	gnp_status status = fits ? gnp_budget_reserve(t->budget, bytes - t->capacity * width, t->error) : GNP_OK;
	if (status != GNP_OK)
		return status;
	if (fits)
		values = realloc(t->values, bytes);
	if (!values)
		return gnp_error_set(t->error, GNP_OUT_OF_MEMORY, "xyz: no memory for %zu rows", capacity);
	t->values = values;
	t->capacity = capacity;
	return GNP_OK;
}

/* A line of data. A lone number before the first row is the count that PTS files begin with. */
static gnp_status read_row(struct table *t, const char *start, const char *stop)
{
	double row[COLUMNS_MAX];
	size_t count;
	if (!read_numbers(start, stop, row, &count))
		return bad_line(t, start, stop);
	if (count == 0 || (count == 1 && !t->columns))
		return GNP_OK;
	if (!t->columns) {
		if (count < 3 || (t->named && t->named != count))
			return bad_line(t, start, stop);
		t->columns = count;
	}
	if (count != t->columns)
		return bad_line(t, start, stop);
	gnp_status status = grow(t);
	if (status == GNP_OK)
		memcpy(t->values + t->rows++ * count, row, count * sizeof *row);
	return status;
}

/* A letter or a quote: of a name, unless it is nan or inf. */
static bool begins_with_name(const char *start, const char *stop)
{
	double value;
	if (!isalpha((unsigned char)*start) && *start != '"')
		return false;
	const char *after = gnp_number_read(start, stop, &value);
	return !after || (after < stop && !is_separator(*after));
}

static gnp_status read_lines(struct table *t, const struct gnp_decode *decode)
{
	const char *start, *stop;
	while (next_line(t, &start, &stop)) {
		while (start < stop && isspace((unsigned char)*start))
			start++;
		if (start == stop)
			continue;
		bool comment = *start == '#' || (*start == '/' && stop - start > 1 && start[1] == '/');
		gnp_status status = GNP_OK;
		if (!comment && (t->columns || !begins_with_name(start, stop)))
			status = read_row(t, start, stop);
		else if (!t->columns)
			read_heading(t, start, stop);
		if (status == GNP_OK && decode->wants.max_points && t->rows > decode->wants.max_points)
			status = gnp_error_set(t->error, GNP_TOO_LARGE, "points: got more than %zu, need at most %zu",
			                       decode->wants.max_points, decode->wants.max_points);
		if (status != GNP_OK)
			return status;
	}
	return t->rows ? GNP_OK : gnp_error_set(t->error, GNP_INVALID_ARGUMENT, "xyz: no row of numbers");
}

static gnp_status name_columns(struct table *t)
{
	static const char *const standard[] = {"x", "y", "z", "nx", "ny", "nz"};
	if (t->named)
		return GNP_OK;
	for (size_t c = 0; c < t->columns; c++) {
		if (c < 3 || t->columns == 6)
			strcpy(t->names[c], standard[c]);
		else
			snprintf(t->names[c], NAME_MAX_LENGTH, "column_%zu", c);
	}
	gnp_status status = GNP_OK;
	for (size_t row = 0; row < t->rows && t->columns == 6 && status == GNP_OK; row++)
		status = gnp_decode_check_normal("xyz", row, t->values + 6 * row + 3, "a heading such as # x y z r g b",
		                                 t->error);
	return status;
}

static gnp_status make_tensors(struct table *t, const struct gnp_decode *decode, struct gnp_tensors *tensors)
{
	struct gnp_field fields[COLUMNS_MAX];
	struct gnp_column columns[COLUMNS_MAX];
	gnp_status status = name_columns(t);
	if (status != GNP_OK)
		return status;
	for (size_t c = 0; c < t->columns; c++)
		fields[c] = (struct gnp_field){t->names[c], strlen(t->names[c]), GNP_FP64};
	status = gnp_fields_bind(decode, "xyz", fields, t->columns, t->rows, tensors, columns, t->error);
	for (size_t c = 0; c < t->columns && status == GNP_OK; c++) {
		if (columns[c].target)
			gnp_column_copy(&columns[c], GNP_FP64, (const unsigned char *)(t->values + c), t->columns * sizeof(double),
			                t->rows);
	}
	return status;
}

static gnp_status decode_file(const struct gnp_decode *decode, struct gnp_tensors *tensors, struct gnp_error *error)
{
	struct table t = {.p = (const char *)decode->body, .budget = tensors->budget, .error = error};
	t.end = t.p + decode->size;
	gnp_status status = read_lines(&t, decode);
	if (status == GNP_OK)
		status = make_tensors(&t, decode, tensors);
	free(t.values);
	gnp_budget_release(t.budget, t.capacity * t.columns * sizeof *t.values);
	return status;
}

static gnp_status write_row(const struct gnp_row_item *items, size_t count, size_t row, size_t rows, char separator,
                            struct gnp_buffer *buffer, struct gnp_error *error)
{
	gnp_status status = gnp_buffer_reserve(buffer, count * (GNP_NUMBER_LENGTH_MAX + 1), error);
	if (status != GNP_OK)
		return status;
	char *p = (char *)buffer->data + buffer->size;
	for (size_t i = 0; i < count; i++) {
		const struct gnp_tensor *tensor = items[i].tensor;
		size_t width = tensor->size / rows / gnp_datatype_size(tensor->datatype);
		double value = gnp_tensor_get(tensor, row * width + items[i].item);
		p += tensor->datatype == GNP_FP32 ? gnp_number_write_float(p, (float)value) : gnp_number_write_double(p, value);
		*p++ = i + 1 < count ? separator : '\n';
	}
	buffer->size = (size_t)(p - (char *)buffer->data);
	return GNP_OK;
}

/* A heading, which begins with `lead`, and the rows. */
static gnp_status write_table(const struct gnp_row_item *items, size_t count, const char *lead, char separator,
                              struct gnp_buffer *buffer, struct gnp_error *error)
{
	size_t rows = items[0].tensor->shape[0];
	gnp_status status = gnp_buffer_printf(buffer, error, "%s%s", lead, items[0].name);
	for (size_t i = 1; i < count && status == GNP_OK; i++)
		status = gnp_buffer_printf(buffer, error, "%c%s", separator, items[i].name);
	if (status == GNP_OK)
		status = gnp_buffer_append(buffer, "\n", 1, error);
	for (size_t row = 0; row < rows && status == GNP_OK; row++)
		status = write_row(items, count, row, rows, separator, buffer, error);
	return status;
}

static gnp_status encode_xyz(const struct gnp_tensors *tensors, const struct gnp_values *comments,
                             struct gnp_buffer *buffer,
                          struct gnp_error *error)
{
	struct gnp_row_item *items;
	size_t count;
	gnp_status status = gnp_row_items(tensors, "xyz", "", false, &items, &count, error);
	if (status != GNP_OK)
		return status;
	status = gnp_comments_write(comments, "# ", buffer, error);
	if (status == GNP_OK)
		status = write_table(items, count, "# ", ' ', buffer, error);
	free(items);
	return status;
}

/* Commas and a plain heading; there is no place for comments. */
static gnp_status encode_csv(const struct gnp_tensors *tensors, const struct gnp_values *comments,
                             struct gnp_buffer *buffer,
                          struct gnp_error *error)
{
	struct gnp_row_item *items;
	size_t count;
	(void)comments; /* the format has no place for them */
	gnp_status status = gnp_row_items(tensors, "csv", "", false, &items, &count, error);
	if (status != GNP_OK)
		return status;
	status = write_table(items, count, "", ',', buffer, error);
	free(items);
	return status;
}

/* ---- How files begin ---- */

static bool is_word(const char *p, size_t length, const char *known)
{
	return strlen(known) == length && strncasecmp(p, known, length) == 0;
}

/* A row that begins with nan or inf is a row of numbers, whose fault the decoder tells. */
static bool is_no_number(const char *p, const char *end)
{
	static const char *const words[] = {"nan", "inf", "infinity"};
	const char *after = p;
	while (after < end && isalpha((unsigned char)*after))
		after++;
	for (size_t i = 0; i < sizeof words / sizeof words[0]; i++)
		if (after < end && strchr(" \t,;", *after) && is_word(p, (size_t)(after - p), words[i]))
			return true;
	return false;
}

static bool is_one_of(const char *p, const char *end, const char *characters)
{
	return p < end && *p && strchr(characters, *p);
}

/* A heading that begins with x, y and z, which may stand in quotes. *separator: what follows x. */
static bool is_heading(const char *p, const char *end, char *separator)
{
	for (char axis = 'x'; axis <= 'z'; axis++) {
		bool quoted = p < end && *p == '"';
		p += quoted;
		if (p == end || tolower((unsigned char)*p++) != axis || (quoted && (p == end || *p++ != '"')))
			return false;
		if (axis == 'z')
			return p == end || is_one_of(p, end, " \t,;\r\n");
		if (!is_one_of(p, end, " \t,;"))
			return false;
		if (axis == 'x')
			*separator = *p;
		while (is_one_of(p, end, " \t,;"))
			p++;
	}
	return false;
}

static bool is_heading_with(const char *text, const char *end, bool commas)
{
	char separator;
	return is_heading(text, end, &separator) && (separator == ',' || separator == ';') == commas;
}

static bool begins_xyz(const char *text, const char *end)
{
	bool number = text < end && (isdigit((unsigned char)*text) || is_one_of(text, end, "+-."));
	return number || is_no_number(text, end) || is_heading_with(text, end, false);
}

static bool begins_csv(const char *text, const char *end)
{
	return is_heading_with(text, end, true);
}

static gnp_status parameters(const unsigned char *body, size_t size, struct gnp_values *values, struct gnp_error *error)
{
	return gnp_comments_read(body, size, "#", NULL, values, error);
}

static const char *const other_names[] = {"txt", "pts", "asc", "xyzn", NULL};
static const char *const other_media_types[] = {"text/x-xyz", NULL};
/* Read like any table, but not written: that has blanks. */
static const char *const body_media_types[] = {"text/tab-separated-values", NULL};

const struct gnp_format gnp_format_xyz = {
	.name = "xyz", .media_type = "text/plain", .extension = "xyz", .other_names = other_names,
	.other_media_types = other_media_types, .body_media_types = body_media_types, .holds = GNP_HOLDS_ROWS,
	.begins = begins_xyz, .decode = decode_file, .encode = encode_xyz, .parameters = parameters};

const struct gnp_format gnp_format_csv = {
	.name = "csv", .media_type = "text/csv", .extension = "csv", .holds = GNP_HOLDS_ROWS, .begins = begins_csv,
	.decode = decode_file, .encode = encode_csv, .parameters = parameters};
