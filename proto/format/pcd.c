/* PCD in: ascii, binary and binary_compressed (LZF). */
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "proto/codec/comments.h"
#include "proto/codec/fields.h"
#include "proto/format/format.h"
#include "proto/tensor/number.h"
#include "proto/tensor/scalar.h"

enum { FIELDS_MAX = 128, ITEMS_MAX = 4096, LZF_RATIO_MAX = 88 };

struct word {
	const char *text;
	size_t length;
};

struct pcd {
	const unsigned char *p, *end;
	struct word names[FIELDS_MAX], sizes[FIELDS_MAX], types[FIELDS_MAX], counts[FIELDS_MAX];
	size_t name_count, size_count, type_count, count_count;
	size_t width, height, points;
	bool has_points;
	struct word data;
	struct gnp_field *fields; /* (items): every number of a row; those of wide fields are nameless */
	size_t items, row_bytes;
	struct gnp_error *error;
};

static gnp_status fail(struct pcd *pcd, const char *text)
{
	return gnp_error_set(pcd->error, GNP_INVALID_ARGUMENT, "pcd: %s", text);
}

static bool is(struct word word, const char *text)
{
	return strlen(text) == word.length && memcmp(text, word.text, word.length) == 0;
}

static bool to_size(struct word word, size_t *value)
{
	*value = 0;
	for (size_t i = 0; i < word.length; i++) {
		unsigned digit = (unsigned)(word.text[i] - '0');
		if (digit > 9 || __builtin_mul_overflow(*value, 10, value) || __builtin_add_overflow(*value, digit, value))
			return false;
	}
	return word.length > 0;
}

/* Cuts the next line into words; the first is its key. */
static bool next_line(struct pcd *pcd, struct word words[FIELDS_MAX + 1], size_t *count)
{
	const unsigned char *newline = memchr(pcd->p, '\n', (size_t)(pcd->end - pcd->p));
	if (!newline)
		return false;
	const char *p = (const char *)pcd->p, *stop = (const char *)newline;
	pcd->p = newline + 1;
	for (*count = 0; p < stop && *count <= FIELDS_MAX; ++*count) {
		while (p < stop && (unsigned char)*p <= ' ')
			p++;
		const char *word = p;
		while (p < stop && (unsigned char)*p > ' ')
			p++;
		if (p == word)
			break;
		words[*count] = (struct word){word, (size_t)(p - word)};
	}
	return true;
}

static gnp_status read_list(struct pcd *pcd, const struct word *words, size_t count, struct word *list,
                            size_t *list_count)
{
	if (count - 1 > FIELDS_MAX)
		return fail(pcd, "more than 128 fields");
	memcpy(list, words + 1, (count - 1) * sizeof *list);
	*list_count = count - 1;
	return GNP_OK;
}

static gnp_status read_header_line(struct pcd *pcd, const struct word *words, size_t count)
{
	bool fits = true;
	if (count == 0 || words[0].text[0] == '#')
		return GNP_OK;
	if (is(words[0], "FIELDS") || is(words[0], "COLUMNS"))
		return read_list(pcd, words, count, pcd->names, &pcd->name_count);
	if (is(words[0], "SIZE"))
		return read_list(pcd, words, count, pcd->sizes, &pcd->size_count);
	if (is(words[0], "TYPE"))
		return read_list(pcd, words, count, pcd->types, &pcd->type_count);
	if (is(words[0], "COUNT"))
		return read_list(pcd, words, count, pcd->counts, &pcd->count_count);
	if (is(words[0], "WIDTH") && count > 1)
		fits = to_size(words[1], &pcd->width);
	else if (is(words[0], "HEIGHT") && count > 1)
		fits = to_size(words[1], &pcd->height);
	else if (is(words[0], "POINTS") && count > 1)
		fits = pcd->has_points = to_size(words[1], &pcd->points);
	else if (is(words[0], "DATA") && count > 1)
		pcd->data = words[1];
	return fits ? GNP_OK : fail(pcd, "WIDTH, HEIGHT and POINTS need integers");
}

static gnp_status read_header(struct pcd *pcd)
{
	struct word words[FIELDS_MAX + 1];
	size_t count;
	pcd->height = 1;
	while (!pcd->data.text) {
		if (!next_line(pcd, words, &count))
			return fail(pcd, "the header has no DATA line");
		gnp_status status = read_header_line(pcd, words, count);
		if (status != GNP_OK)
			return status;
	}
	if (!pcd->has_points && !gnp_size_multiply(pcd->width, pcd->height, &pcd->points))
		return fail(pcd, "WIDTH times HEIGHT overflows");
	if (!pcd->name_count || pcd->size_count != pcd->name_count || pcd->type_count != pcd->name_count ||
	    (pcd->count_count && pcd->count_count != pcd->name_count))
		return fail(pcd, "FIELDS, SIZE, TYPE and COUNT need as many entries each");
	return GNP_OK;
}

static bool field_type(struct word type, struct word size, enum gnp_datatype *datatype)
{
	static const struct {
		const char *type, *size;
		enum gnp_datatype datatype;
	} types[] = {{"F", "4", GNP_FP32},   {"F", "8", GNP_FP64},   {"U", "1", GNP_UINT8}, {"U", "2", GNP_UINT16},
	             {"U", "4", GNP_UINT32}, {"U", "8", GNP_UINT64}, {"I", "1", GNP_INT8},  {"I", "2", GNP_INT16},
	             {"I", "4", GNP_INT32},  {"I", "8", GNP_INT64}};
	for (size_t i = 0; i < sizeof types / sizeof types[0]; i++) {
		if (is(type, types[i].type) && is(size, types[i].size)) {
			*datatype = types[i].datatype;
			return true;
		}
	}
	return false;
}

static gnp_status make_fields(struct pcd *pcd)
{
	pcd->fields = gnp_array_zero(ITEMS_MAX, sizeof *pcd->fields);
	if (!pcd->fields)
		return gnp_error_set(pcd->error, GNP_OUT_OF_MEMORY, "pcd: no memory for the fields");
	for (size_t f = 0; f < pcd->name_count; f++) {
		enum gnp_datatype datatype;
		size_t count = 1;
		if (!field_type(pcd->types[f], pcd->sizes[f], &datatype))
			return fail(pcd, "TYPE and SIZE need F 4|8, U or I 1|2|4|8");
		if (pcd->count_count && !to_size(pcd->counts[f], &count))
			return fail(pcd, "COUNT needs integers");
		if (count > ITEMS_MAX - pcd->items)
			return fail(pcd, "more than 4096 numbers a point");
		bool named = count == 1 && !is(pcd->names[f], "_");
		for (size_t i = 0; i < count; i++) {
			pcd->fields[pcd->items++] =
				(struct gnp_field){pcd->names[f].text, named ? pcd->names[f].length : 0, datatype};
			pcd->row_bytes += gnp_datatype_size(datatype);
		}
	}
	return GNP_OK;
}

/* The ascii body, a number at a time. */
static gnp_status read_ascii(struct pcd *pcd, const struct gnp_column *columns)
{
	const char *p = (const char *)pcd->p, *end = (const char *)pcd->end;
	for (size_t row = 0; row < pcd->points; row++) {
		for (size_t i = 0; i < pcd->items; i++) {
			double value;
			while (p < end && (unsigned char)*p <= ' ')
				p++;
			p = gnp_number_read(p, end, &value);
			bool fits = p && (p == end || (unsigned char)*p <= ' ');
			if (fits && columns[i].target)
				fits = gnp_scalar_store(columns[i].datatype, columns[i].target + row * columns[i].stride, value);
			if (!fits)
				return gnp_error_set(pcd->error, GNP_INVALID_ARGUMENT,
				                     "pcd: point %zu of %zu is cut short or holds something else than its numbers", row,
				                     pcd->points);
		}
	}
	return GNP_OK;
}

/* by_field: all numbers of a field together, as the compressed form has them. */
static void read_binary(struct pcd *pcd, const unsigned char *source, bool by_field, const struct gnp_column *columns)
{
	size_t i = 0;
	while (i < pcd->items) {
		/* The items of one wide field stay together within a point. */
		size_t size = gnp_datatype_size(pcd->fields[i].datatype), width = 1;
		while (pcd->fields[i].length == 0 && i + width < pcd->items &&
		       pcd->fields[i + width].name == pcd->fields[i].name)
			width++;
		if (columns[i].target)
			gnp_column_copy(&columns[i], pcd->fields[i].datatype, source, by_field ? size * width : pcd->row_bytes,
			                pcd->points);
		source += size * width * (by_field ? pcd->points : 1);
		i += width;
	}
}

/* Marc Lehmann's LZF: a control byte below 32 copies that many plus one literals, else a length and a distance back. */
static bool lzf_decompress(const unsigned char *in, size_t in_size, unsigned char *out, size_t out_size)
{
	const unsigned char *in_end = in + in_size;
	unsigned char *start = out, *out_end = out + out_size;
	while (in < in_end) {
		size_t control = *in++;
		if (control < 32) {
			size_t length = control + 1;
			if (length > (size_t)(in_end - in) || length > (size_t)(out_end - out))
				return false;
			memcpy(out, in, length);
			in += length;
			out += length;
			continue;
		}
		size_t length = control >> 5;
		if (length == 7 && in < in_end)
			length += *in++;
		if (in == in_end)
			return false;
		size_t distance = ((control & 31) << 8 | *in++) + 1;
		length += 2;
		if (distance > (size_t)(out - start) || length > (size_t)(out_end - out))
			return false;
		for (; length; length--, out++)
			*out = out[-(ptrdiff_t)distance];
	}
	return out == out_end;
}

static gnp_status read_compressed(struct pcd *pcd, const struct gnp_budget *budget, const struct gnp_column *columns)
{
	uint32_t sizes[2];
	memcpy(sizes, pcd->p, sizeof sizes);
	gnp_status status = gnp_budget_reserve(budget, sizes[1], pcd->error);
	if (status != GNP_OK)
		return status;
	unsigned char *plain = gnp_array_new(sizes[1], 1);
	if (!plain)
		return gnp_error_set(pcd->error, GNP_OUT_OF_MEMORY, "pcd: no memory for %u bytes", sizes[1]);
	bool good = lzf_decompress(pcd->p + 8, sizes[0], plain, sizes[1]);
	if (good)
		read_binary(pcd, plain, true, columns);
	free(plain);
	gnp_budget_release(budget, sizes[1]);
	return good ? GNP_OK : fail(pcd, "the compressed data is corrupt");
}

/* That the body can hold the points, before anything is made for them. */
static gnp_status check_body(struct pcd *pcd)
{
	size_t left = (size_t)(pcd->end - pcd->p), need;
	if (is(pcd->data, "ascii")) {
		if (!gnp_size_multiply(pcd->points, 2 * pcd->items, &need) || need > left + 1)
			return gnp_error_set(pcd->error, GNP_INVALID_ARGUMENT, "pcd: got %zu points, the body has room for %zu",
			                     pcd->points, (left + 1) / (2 * pcd->items));
		return GNP_OK;
	}
	if (!gnp_size_multiply(pcd->points, pcd->row_bytes, &need))
		return fail(pcd, "the number of points overflows");
	if (is(pcd->data, "binary"))
		return need <= left ? GNP_OK
		                    : gnp_error_set(pcd->error, GNP_INVALID_ARGUMENT,
		                                    "pcd: the points need %zu bytes, the body has %zu", need, left);
	if (!is(pcd->data, "binary_compressed"))
		return fail(pcd, "DATA needs ascii, binary or binary_compressed");
	uint32_t sizes[2] = {0, 0};
	if (left >= sizeof sizes)
		memcpy(sizes, pcd->p, sizeof sizes);
	if (left < sizeof sizes || sizes[0] > left - sizeof sizes || sizes[1] != need ||
	    sizes[1] / LZF_RATIO_MAX > sizes[0])
		return gnp_error_set(pcd->error, GNP_INVALID_ARGUMENT,
		                     "pcd: %u compressed bytes for %u, the points need %zu and the body has %zu", sizes[0],
		                     sizes[1], need, left);
	return GNP_OK;
}

static gnp_status read_body(struct pcd *pcd, const struct gnp_decode *decode, struct gnp_tensors *tensors)
{
	struct gnp_column *columns = gnp_array_zero(pcd->items, sizeof *columns);
	if (!columns)
		return gnp_error_set(pcd->error, GNP_OUT_OF_MEMORY, "pcd: no memory for %zu fields", pcd->items);
	gnp_status status = gnp_fields_bind(decode, "pcd", pcd->fields, pcd->items, pcd->points, tensors, columns,
	                                    pcd->error);
	if (status == GNP_OK && is(pcd->data, "ascii"))
		status = read_ascii(pcd, columns);
	else if (status == GNP_OK && is(pcd->data, "binary"))
		read_binary(pcd, pcd->p, false, columns);
	else if (status == GNP_OK)
		status = read_compressed(pcd, tensors->budget, columns);
	free(columns);
	return status;
}

static gnp_status decode_file(const struct gnp_decode *decode, struct gnp_tensors *tensors, struct gnp_error *error)
{
	struct pcd pcd = {.p = decode->body, .end = decode->body + decode->size, .error = error};
	gnp_status status = read_header(&pcd);
	if (status == GNP_OK)
		status = make_fields(&pcd);
	if (status == GNP_OK && pcd.items == 0)
		status = fail(&pcd, "no fields");
	if (status == GNP_OK)
		status = check_body(&pcd);
	if (status == GNP_OK)
		status = gnp_decode_check_points(decode, pcd.points, error);
	if (status == GNP_OK)
		status = read_body(&pcd, decode, tensors);
	free(pcd.fields);
	return status;
}

/* Past the comment of the first line. */
static bool begins(const char *text, const char *end)
{
	return gnp_format_begins(text, end, "VERSION ") || gnp_format_begins(text, end, "FIELDS ");
}

static gnp_status parameters(const unsigned char *body, size_t size, struct gnp_values *values, struct gnp_error *error)
{
	return gnp_comments_read(body, size, "#", "DATA", values, error);
}

static const char *const magic[] = {"# .PCD", NULL};
static const char *const other_media_types[] = {"application/pcd", "application/vnd.pcd", NULL};

const struct gnp_format gnp_format_pcd = {
	.name = "pcd", .media_type = "application/x-pcd", .extension = "pcd", .other_media_types = other_media_types,
	.holds = GNP_HOLDS_ROWS, .magic = magic, .begins = begins, .decode = decode_file, .parameters = parameters};
