#include "proto/format/ply_decode.h"

#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "proto/codec/fields.h"
#include "proto/tensor/number.h"
#include "proto/tensor/scalar.h"

enum { HEADER_MAX = 1 << 20, ELEMENTS_MAX = 256, PROPERTIES_MAX = 4096 };

enum encoding { ENCODING_NONE, ENCODING_ASCII, ENCODING_LITTLE, ENCODING_BIG };

struct property {
	const char *name; /* in the header */
	size_t name_length;
	enum gnp_datatype type; /* of a list: of its items */
	bool list;
	enum gnp_datatype count_type;
};

struct element {
	const char *name;
	size_t name_length;
	size_t count;
	size_t first, properties; /* range of ply.properties */
};

struct ply {
	const unsigned char *p, *end;
	enum encoding encoding;
	struct element elements[ELEMENTS_MAX];
	size_t element_count;
	struct property *properties; /* (PROPERTIES_MAX) */
	size_t property_count;
	struct gnp_error *error;
};

/* A header line cut into words. */
struct line {
	const char *words[8];
	size_t lengths[8];
	size_t count; /* of words; those past the eighth are dropped */
};

static bool word_is(const struct line *line, size_t i, const char *text)
{
	return i < line->count && strlen(text) == line->lengths[i] && memcmp(line->words[i], text, line->lengths[i]) == 0;
}

static gnp_status fail(struct ply *ply, const char *text)
{
	return gnp_error_set(ply->error, GNP_INVALID_ARGUMENT, "ply: %s", text);
}

/* Lines end in "\n", "\r\n" or, in old files, "\r". */
static bool read_line(struct ply *ply, struct line *line)
{
	const unsigned char *p = ply->p;
	while (p < ply->end && *p != '\n' && *p != '\r')
		p++;
	if (p == ply->end)
		return false;
	const char *c = (const char *)ply->p, *stop = (const char *)p;
	ply->p = p + 1;
	if (*p == '\r' && ply->p < ply->end && *ply->p == '\n')
		ply->p++;
	line->count = 0;
	while (c < stop && line->count < 8) {
		const char *word = c;
		while (c < stop && *c != ' ' && *c != '\t')
			c++;
		if (c > word) {
			line->words[line->count] = word;
			line->lengths[line->count++] = (size_t)(c - word);
		}
		c += c < stop;
	}
	return true;
}

static bool read_type(const struct line *line, size_t i, enum gnp_datatype *type)
{
	static const struct {
		const char *name;
		enum gnp_datatype type;
	} types[] = {
		{"char", GNP_INT8},     {"int8", GNP_INT8},     {"uchar", GNP_UINT8},   {"uint8", GNP_UINT8},
		{"short", GNP_INT16},   {"int16", GNP_INT16},   {"ushort", GNP_UINT16}, {"uint16", GNP_UINT16},
		{"int", GNP_INT32},     {"int32", GNP_INT32},   {"uint", GNP_UINT32},   {"uint32", GNP_UINT32},
		{"float", GNP_FP32},    {"float32", GNP_FP32},  {"double", GNP_FP64},   {"float64", GNP_FP64},
		{"int64", GNP_INT64},   {"uint64", GNP_UINT64},
	};
	for (size_t t = 0; t < sizeof types / sizeof types[0]; t++) {
		if (word_is(line, i, types[t].name)) {
			*type = types[t].type;
			return true;
		}
	}
	return false;
}

static gnp_status read_element(struct ply *ply, const struct line *line)
{
	size_t count = 0;
	if (line->count != 3)
		return fail(ply, "need `element NAME COUNT`");
	if (ply->element_count == ELEMENTS_MAX)
		return fail(ply, "more than 256 elements");
	for (size_t i = 0; i < line->lengths[2]; i++) {
		unsigned digit = (unsigned)(line->words[2][i] - '0');
		if (digit > 9 || __builtin_mul_overflow(count, 10, &count) || __builtin_add_overflow(count, digit, &count))
			return gnp_error_set(ply->error, GNP_INVALID_ARGUMENT, "ply: element %.*s: count %.*s, need an integer",
			                     (int)(line->lengths[1] < 40 ? line->lengths[1] : 40), line->words[1],
			                     (int)(line->lengths[2] < 40 ? line->lengths[2] : 40), line->words[2]);
	}
	ply->elements[ply->element_count++] =
		(struct element){line->words[1], line->lengths[1], count, ply->property_count, 0};
	return GNP_OK;
}

static gnp_status read_property(struct ply *ply, const struct line *line)
{
	struct property property = {.list = word_is(line, 1, "list")};
	size_t type = property.list ? 3 : 1;
	if (line->count != type + 2 || !read_type(line, type, &property.type) ||
	    (property.list && !read_type(line, 2, &property.count_type)))
		return fail(ply, "need `property TYPE NAME` or `property list TYPE TYPE NAME` with known types");
	if (ply->element_count == 0)
		return fail(ply, "a property before the first element");
	if (ply->property_count == PROPERTIES_MAX)
		return fail(ply, "more than 4096 properties");
	property.name = line->words[type + 1];
	property.name_length = line->lengths[type + 1];
	ply->properties[ply->property_count++] = property;
	ply->elements[ply->element_count - 1].properties++;
	return GNP_OK;
}

static gnp_status read_format(struct ply *ply, const struct line *line)
{
	if (word_is(line, 1, "ascii"))
		ply->encoding = ENCODING_ASCII;
	else if (word_is(line, 1, "binary_little_endian"))
		ply->encoding = ENCODING_LITTLE;
	else if (word_is(line, 1, "binary_big_endian"))
		ply->encoding = ENCODING_BIG;
	else
		return fail(ply, "unknown format, need ascii, binary_little_endian or binary_big_endian");
	return GNP_OK;
}

static gnp_status read_header(struct ply *ply)
{
	const unsigned char *start = ply->p;
	struct line line;
	if (!read_line(ply, &line) || !word_is(&line, 0, "ply"))
		return fail(ply, "the first line is not `ply`");
	for (;;) {
		if (!read_line(ply, &line) || ply->p - start > HEADER_MAX)
			return fail(ply, "no end_header within the first MiB");
		gnp_status status = GNP_OK;
		if (word_is(&line, 0, "end_header"))
			break;
		if (word_is(&line, 0, "format"))
			status = read_format(ply, &line);
		else if (word_is(&line, 0, "element"))
			status = read_element(ply, &line);
		else if (word_is(&line, 0, "property"))
			status = read_property(ply, &line);
		else if (line.count && !word_is(&line, 0, "comment") && !word_is(&line, 0, "obj_info"))
			status = fail(ply, "unknown line in the header");
		if (status != GNP_OK)
			return status;
	}
	return ply->encoding == ENCODING_NONE ? fail(ply, "no format line") : GNP_OK;
}

/* The fewest bytes a row takes: a number and a separator each in ascii. */
static size_t least_row(const struct ply *ply, const struct element *element)
{
	size_t bytes = 0;
	for (size_t i = 0; i < element->properties; i++) {
		const struct property *property = &ply->properties[element->first + i];
		enum gnp_datatype type = property->list ? property->count_type : property->type;
		bytes += ply->encoding == ENCODING_ASCII ? 2 : gnp_datatype_size(type);
	}
	return bytes;
}

/* The next number of an ascii body. */
static bool next_number(struct ply *ply, double *value)
{
	while (ply->p < ply->end && *ply->p <= ' ')
		ply->p++;
	const char *after = gnp_number_read((const char *)ply->p, (const char *)ply->end, value);
	if (!after || (after < (const char *)ply->end && (unsigned char)*after > ' '))
		return false;
	ply->p = (const unsigned char *)after;
	return true;
}

static bool next_binary(struct ply *ply, enum gnp_datatype type, double *value)
{
	unsigned char swapped[8];
	size_t size = gnp_datatype_size(type);
	if ((size_t)(ply->end - ply->p) < size)
		return false;
	const unsigned char *source = ply->p;
	if (ply->encoding == ENCODING_BIG) {
		gnp_scalar_swap(swapped, source, 1, size);
		source = swapped;
	}
	*value = gnp_scalar_load(type, source);
	ply->p += size;
	return true;
}

static bool next(struct ply *ply, enum gnp_datatype type, double *value)
{
	return ply->encoding == ENCODING_ASCII ? next_number(ply, value) : next_binary(ply, type, value);
}

static bool skip_list(struct ply *ply, const struct property *property)
{
	double count, item;
	if (!next(ply, property->count_type, &count) || !(count >= 0 && count <= (double)(ply->end - ply->p)))
		return false;
	size_t items = (size_t)count, size = gnp_datatype_size(property->type);
	if (ply->encoding != ENCODING_ASCII) {
		if (items > (size_t)(ply->end - ply->p) / size)
			return false;
		ply->p += items * size;
		return true;
	}
	for (size_t i = 0; i < items; i++) {
		if (!next_number(ply, &item))
			return false;
	}
	return true;
}

static bool read_row(struct ply *ply, const struct element *element, const struct gnp_column *columns, size_t row)
{
	for (size_t i = 0; i < element->properties; i++) {
		const struct property *property = &ply->properties[element->first + i];
		double value;
		if (property->list) {
			if (!skip_list(ply, property))
				return false;
			continue;
		}
		if (!next(ply, property->type, &value))
			return false;
		if (columns && columns[i].target &&
		    !gnp_scalar_store(columns[i].datatype, columns[i].target + row * columns[i].stride, value))
			return false;
	}
	return true;
}

static bool has_list(const struct ply *ply, const struct element *element)
{
	for (size_t i = 0; i < element->properties; i++) {
		if (ply->properties[element->first + i].list)
			return true;
	}
	return false;
}

/* Rows of one width in the machine's byte order: a column at a time. Numbers of columns go to floats wide enough. */
static void read_plain(struct ply *ply, const struct element *element, const struct gnp_column *columns, size_t width)
{
	const unsigned char *source = ply->p;
	for (size_t i = 0; i < element->properties; i++) {
		enum gnp_datatype type = ply->properties[element->first + i].type;
		if (columns[i].target)
			gnp_column_copy(&columns[i], type, source, width, element->count);
		source += gnp_datatype_size(type);
	}
	ply->p += element->count * width;
}

static gnp_status read_rows(struct ply *ply, const struct element *element, const struct gnp_column *columns)
{
	size_t width = least_row(ply, element);
	if (width == 0)
		return GNP_OK;
	if (ply->encoding != ENCODING_ASCII && !has_list(ply, element) && !columns) {
		ply->p += element->count * width;
		return GNP_OK;
	}
	if (ply->encoding == ENCODING_LITTLE && !has_list(ply, element)) {
		read_plain(ply, element, columns, width);
		return GNP_OK;
	}
	for (size_t row = 0; row < element->count; row++) {
		if (!read_row(ply, element, columns, row))
			return gnp_error_set(ply->error, GNP_INVALID_ARGUMENT,
			                     "ply: element %.*s: row %zu of %zu is cut short or holds something else than its "
			                     "numbers",
			                     (int)(element->name_length < 40 ? element->name_length : 40), element->name, row,
			                     element->count);
	}
	return GNP_OK;
}

/* No count is believed that the rest of the body cannot hold. */
static gnp_status check_count(struct ply *ply, const struct element *element)
{
	size_t least = least_row(ply, element), left = (size_t)(ply->end - ply->p);
	left += ply->encoding == ENCODING_ASCII; /* the last number needs no separator */
	if (least && element->count > left / least)
		return gnp_error_set(ply->error, GNP_INVALID_ARGUMENT,
		                     "ply: element %.*s: got %zu rows, the body has room for %zu",
		                     (int)(element->name_length < 40 ? element->name_length : 40), element->name,
		                     element->count, left / least);
	return GNP_OK;
}

static gnp_status read_vertices(struct ply *ply, const struct element *element, const struct gnp_decode *decode,
                                struct gnp_tensors *tensors)
{
	gnp_status status = gnp_decode_check_points(decode, element->count, ply->error);
	if (status != GNP_OK)
		return status;
	struct gnp_field *fields = gnp_array_zero(element->properties, sizeof *fields);
	struct gnp_column *columns = gnp_array_zero(element->properties, sizeof *columns);
	if (!fields || !columns) {
		status = gnp_error_set(ply->error, GNP_OUT_OF_MEMORY, "ply: no memory for %zu properties", element->properties);
		goto done;
	}
	for (size_t i = 0; i < element->properties; i++) {
		const struct property *property = &ply->properties[element->first + i];
		if (!property->list)
			fields[i] = (struct gnp_field){property->name, property->name_length, property->type};
	}
	status = gnp_fields_bind(decode, "ply", fields, element->properties, element->count, tensors, columns, ply->error);
	if (status == GNP_OK)
		status = read_rows(ply, element, columns);
done:
	free(fields);
	free(columns);
	return status;
}

/* More rows after the last element than it was said to have: a count that lies low would drop points silently. Less
 * than a row of a binary body is let pass: some writers end it with a line break. */
static gnp_status check_rest(struct ply *ply, const struct element *last)
{
	size_t least = least_row(ply, last);
	if (ply->encoding == ENCODING_ASCII) {
		while (ply->p < ply->end && *ply->p <= ' ')
			ply->p++;
		least = 1;
	}
	size_t left = (size_t)(ply->end - ply->p);
	if (least && left >= least)
		return gnp_error_set(ply->error, GNP_INVALID_ARGUMENT,
		                     "ply: %zu bytes after the last of the %zu rows of element %.*s",
		                     left, last->count, (int)(last->name_length < 40 ? last->name_length : 40), last->name);
	return GNP_OK;
}

static gnp_status read_body(struct ply *ply, const struct gnp_decode *decode, struct gnp_tensors *tensors)
{
	for (size_t i = 0; i < ply->element_count; i++) {
		const struct element *element = &ply->elements[i];
		bool vertex = element->name_length == 6 && memcmp(element->name, "vertex", 6) == 0;
		gnp_status status = check_count(ply, element);
		if (status == GNP_OK && vertex) {
			status = read_vertices(ply, element, decode, tensors);
			return status == GNP_OK && i + 1 == ply->element_count ? check_rest(ply, element) : status;
		}
		if (status == GNP_OK)
			status = read_rows(ply, element, NULL);
		if (status != GNP_OK)
			return status;
	}
	return fail(ply, "no element vertex");
}

gnp_status gnp_ply_decode(const struct gnp_decode *decode, struct gnp_tensors *tensors, struct gnp_error *error)
{
	struct ply ply = {.p = decode->body, .end = decode->body + decode->size, .error = error};
	ply.properties = gnp_array_new(PROPERTIES_MAX, sizeof *ply.properties);
	if (!ply.properties)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "ply: no memory for the header");
	gnp_status status = read_header(&ply);
	if (status == GNP_OK)
		status = read_body(&ply, decode, tensors);
	free(ply.properties);
	return status;
}
