#include "proto/file/file.h"

#include <ctype.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "proto/format/file_codec.h"

static const struct {
	const char *name, *media_type, *extension;
	bool readable, writable, of_rows;
} formats[] = {
#define ROW(id, name, media, extension, in, out, rows) [id] = {name, media, extension, in, out, rows},
	GNP_FORMAT_TABLE(ROW)
#undef ROW
};

static const gnp_decode_fn decoders[GNP_FORMAT_COUNT] = {
	[GNP_FORMAT_PLY] = gnp_ply_decode, [GNP_FORMAT_NPY] = gnp_npy_decode, [GNP_FORMAT_NPZ] = gnp_npz_decode,
	[GNP_FORMAT_XYZ] = gnp_xyz_decode, [GNP_FORMAT_CSV] = gnp_xyz_decode, [GNP_FORMAT_PCD] = gnp_pcd_decode, [GNP_FORMAT_OBJ] = gnp_obj_decode,
	[GNP_FORMAT_JSON] = gnp_json_file_decode,
};

static const gnp_encode_fn encoders[GNP_FORMAT_COUNT] = {
	[GNP_FORMAT_PLY] = gnp_ply_encode, [GNP_FORMAT_NPY] = gnp_npy_encode, [GNP_FORMAT_NPZ] = gnp_npz_encode,
	[GNP_FORMAT_XYZ] = gnp_xyz_encode, [GNP_FORMAT_CSV] = gnp_csv_encode, [GNP_FORMAT_VTK] = gnp_vtk_encode, [GNP_FORMAT_MTX] = gnp_mtx_encode,
	[GNP_FORMAT_JSON] = gnp_json_file_encode,
};

/* Read like any table, but not written: that has blanks. */
static const char tabs_media_type[] = "text/tab-separated-values";

/* Other names and media types in use. */
static const struct {
	const char *name;
	enum gnp_format format;
} name_synonyms[] = {
	{"txt", GNP_FORMAT_XYZ}, {"pts", GNP_FORMAT_XYZ}, {"asc", GNP_FORMAT_XYZ}, {"xyzn", GNP_FORMAT_XYZ},
}, media_synonyms[] = {
	{"model/ply", GNP_FORMAT_PLY},           {"application/x-ply", GNP_FORMAT_PLY}, {"application/npy", GNP_FORMAT_NPY},
	{"application/npz", GNP_FORMAT_NPZ},     {"application/zip", GNP_FORMAT_NPZ},   {"text/x-xyz", GNP_FORMAT_XYZ},
	{tabs_media_type, GNP_FORMAT_XYZ},       {"application/pcd", GNP_FORMAT_PCD},
	{"application/vnd.pcd", GNP_FORMAT_PCD}, {"text/x-obj", GNP_FORMAT_OBJ},        {"application/vtk", GNP_FORMAT_VTK},
	{"text/json", GNP_FORMAT_JSON},
};

static const char generic_media_type[] = "application/octet-stream";

#define LENGTH(array) (sizeof(array) / sizeof((array)[0]))

const char *gnp_format_name(enum gnp_format format)
{
	return format < GNP_FORMAT_COUNT ? formats[format].name : "unknown";
}

const char *gnp_format_media_type(enum gnp_format format)
{
	return format < GNP_FORMAT_COUNT ? formats[format].media_type : generic_media_type;
}

bool gnp_format_readable(enum gnp_format format)
{
	return format < GNP_FORMAT_COUNT && formats[format].readable;
}

bool gnp_format_writable(enum gnp_format format)
{
	return format < GNP_FORMAT_COUNT && formats[format].writable;
}

bool gnp_format_of_rows(enum gnp_format format)
{
	return format < GNP_FORMAT_COUNT && formats[format].of_rows;
}

bool gnp_format_by_name(const char *name, enum gnp_format *format)
{
	for (int i = 0; i < GNP_FORMAT_COUNT; i++) {
		if (strcasecmp(name, formats[i].name) == 0 || strcasecmp(name, formats[i].extension) == 0) {
			*format = (enum gnp_format)i;
			return true;
		}
	}
	for (size_t i = 0; i < LENGTH(name_synonyms); i++) {
		if (strcasecmp(name, name_synonyms[i].name) == 0) {
			*format = name_synonyms[i].format;
			return true;
		}
	}
	return false;
}

static bool same_word(const char *word, size_t length, const char *known)
{
	return strlen(known) == length && strncasecmp(word, known, length) == 0;
}

/* *known: the type as the tables spell it. */
static bool find_media_type(const char *type, size_t length, enum gnp_format *format, const char **known)
{
	for (int i = 0; i < GNP_FORMAT_COUNT; i++) {
		if (same_word(type, length, formats[i].media_type)) {
			*format = (enum gnp_format)i;
			*known = formats[i].media_type;
			return true;
		}
	}
	for (size_t i = 0; i < LENGTH(media_synonyms); i++) {
		if (same_word(type, length, media_synonyms[i].name)) {
			*format = media_synonyms[i].format;
			*known = media_synonyms[i].name;
			return true;
		}
	}
	return false;
}

bool gnp_format_by_media_type(const char *media_type, enum gnp_format *format)
{
	const char *known;
	media_type += strspn(media_type, " \t");
	return find_media_type(media_type, strcspn(media_type, "; \t"), format, &known);
}

const char *gnp_format_media_type_spelled(const char *media_type)
{
	enum gnp_format format;
	const char *known = NULL;
	if (same_word(media_type, strlen(media_type), generic_media_type))
		return generic_media_type;
	return find_media_type(media_type, strlen(media_type), &format, &known) ? known : NULL;
}

static const char *skip_blank(const char *p, const char *end)
{
	while (p < end && isspace((unsigned char)*p))
		p++;
	return p;
}

static bool begins(const char *p, const char *end, const char *word)
{
	size_t length = strlen(word);
	return (size_t)(end - p) >= length && memcmp(p, word, length) == 0;
}

/* Past lines that begin with '#'. */
static const char *skip_comments(const char *p, const char *end)
{
	for (p = skip_blank(p, end); p < end && *p == '#'; p = skip_blank(p, end)) {
		const char *line = memchr(p, '\n', (size_t)(end - p));
		p = line ? line : end;
	}
	return p;
}

/* A row that begins with nan or inf is a row of numbers, whose fault the decoder tells. */
static bool is_no_number(const char *p, const char *end)
{
	static const char *const words[] = {"nan", "inf", "infinity"};
	const char *after = p;
	while (after < end && isalpha((unsigned char)*after))
		after++;
	for (size_t i = 0; i < LENGTH(words); i++)
		if (after < end && strchr(" \t,;", *after) && same_word(p, (size_t)(after - p), words[i]))
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

bool gnp_format_by_magic(const unsigned char *data, size_t size, enum gnp_format *format)
{
	const char *p = (const char *)data, *end = p + (size < 65536 ? size : 65536);
	const char *first = skip_comments(p, end);
	char separator;
	if (begins(p, end, "ply\n") || begins(p, end, "ply\r"))
		*format = GNP_FORMAT_PLY;
	else if (begins(p, end, "\x93NUMPY"))
		*format = GNP_FORMAT_NPY;
	else if (begins(p, end, "PK\x03\x04") || begins(p, end, "PK\x05\x06"))
		*format = GNP_FORMAT_NPZ;
	else if (begins(p, end, "# vtk DataFile"))
		*format = GNP_FORMAT_VTK;
	else if (begins(p, end, "# .PCD") || begins(first, end, "VERSION ") || begins(first, end, "FIELDS "))
		*format = GNP_FORMAT_PCD;
	else if (begins(first, end, "{"))
		*format = GNP_FORMAT_JSON;
	else if (begins(first, end, "v ") || begins(first, end, "vn ") || begins(first, end, "o ") ||
	         begins(first, end, "g ") || begins(first, end, "mtllib "))
		*format = GNP_FORMAT_OBJ;
	else if (first < end && (isdigit((unsigned char)*first) || (*first && strchr("+-.", *first)) || is_no_number(first, end)))
		*format = GNP_FORMAT_XYZ;
	else if (is_heading(first, end, &separator))
		*format = separator == ',' || separator == ';' ? GNP_FORMAT_CSV : GNP_FORMAT_XYZ;
	else
		return false;
	return true;
}

/* ---- Accept ---- */

/* One entry of the header: a type or a range, and its q. */
struct entry {
	const char *type;
	size_t length;
	double quality; /* 0: not to be had */
};

/* 0 to 1 with at most three decimals. */
static bool read_quality(const char *p, size_t length, double *quality)
{
	double value = *p - '0', unit = 0.1;
	if (length < 1 || length > 5 || (*p != '0' && *p != '1') || (length > 1 && p[1] != '.'))
		return false;
	for (size_t i = 2; i < length; i++, unit /= 10) {
		if (!isdigit((unsigned char)p[i]))
			return false;
		value += unit * (p[i] - '0');
	}
	*quality = value;
	return value <= 1;
}

/* q of the parameters that follow a type, 1 when there is none; false when it is malformed. */
static bool find_quality(const char *p, const char *end, double *quality)
{
	*quality = 1;
	while (p < end) {
		p += strspn(p, "; \t");
		size_t length = strcspn(p, "; \t,");
		if (length > 1 && (*p == 'q' || *p == 'Q') && p[1] == '=')
			return read_quality(p + 2, length - 2, quality);
		p += length + (p + length < end && length == 0);
	}
	return true;
}

/* The next entry whose q is well-formed; false at the end. */
static bool next_entry(const char **accept, struct entry *entry)
{
	while (**accept) {
		*accept += strspn(*accept, " \t,");
		const char *end = *accept + strcspn(*accept, ",");
		entry->type = *accept;
		entry->length = strcspn(*accept, ",; \t");
		*accept = end;
		if (entry->length && find_quality(entry->type + entry->length, end, &entry->quality))
			return true;
	}
	return false;
}

static bool is_entry(const struct entry *entry, const char *text)
{
	return same_word(entry->type, entry->length, text);
}

/* Whether an entry is a range that covers a media type. */
static bool covers(const struct entry *entry, const char *media_type)
{
	if (is_entry(entry, "*/*") || is_entry(entry, generic_media_type))
		return true;
	size_t stem = entry->length ? entry->length - 1 : 0;
	return stem > 1 && entry->type[stem] == '*' && entry->type[stem - 1] == '/' && strncasecmp(entry->type, media_type, stem) == 0;
}

/* Whether the header names a format with q=0. */
static bool is_refused(const char *accept, enum gnp_format format)
{
	struct entry entry;
	const char *media_type;
	enum gnp_format named;
	while (next_entry(&accept, &entry))
		if (entry.quality == 0 && find_media_type(entry.type, entry.length, &named, &media_type) && named == format)
			return true;
	return false;
}

/* What an entry makes of the choice; false when there is nothing of its kind that can be written. */
static bool choose(const struct entry *entry, const char *accept, struct gnp_format_choice *choice)
{
	enum gnp_format named;
	if (find_media_type(entry->type, entry->length, &named, &choice->media_type)) {
		choice->format = named;
		choice->asked = true;
		return formats[named].writable && choice->media_type != tabs_media_type;
	}
	bool bytes = is_entry(entry, generic_media_type), found = false;
	if (!covers(entry, formats[choice->format].media_type) || is_refused(accept, choice->format)) {
		for (int i = 0; i < GNP_FORMAT_COUNT && !found; i++) {
			found = formats[i].writable && covers(entry, formats[i].media_type) && !is_refused(accept, (enum gnp_format)i);
			choice->format = found ? (enum gnp_format)i : choice->format;
		}
		if (!found)
			return false;
		choice->asked = false;
	}
	if (!covers(entry, formats[GNP_FORMAT_NPZ].media_type) || is_refused(accept, GNP_FORMAT_NPZ))
		choice->asked = true; /* what would take its place is not acceptable */
	choice->media_type = bytes ? generic_media_type : formats[choice->format].media_type;
	return true;
}

bool gnp_format_by_accept(const char *accept, struct gnp_format_choice *choice)
{
	struct gnp_format_choice best = *choice;
	struct entry entry;
	double quality = 0;
	for (const char *rest = accept; next_entry(&rest, &entry);) {
		struct gnp_format_choice candidate = *choice;
		if (entry.quality > quality && choose(&entry, accept, &candidate)) {
			quality = entry.quality;
			best = candidate;
		}
	}
	*choice = best;
	return quality > 0;
}

static gnp_status take_all(struct gnp_tensors *from, struct gnp_tensors *to, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	size_t before = to->count;
	for (size_t i = 0; i < from->count && status == GNP_OK; i++) {
		struct gnp_tensor *t = &from->items[i];
		status = gnp_tensors_add_data(to, t->name, t->datatype, t->rank, t->shape, t->data, t->owned, NULL, error);
	}
	if (status != GNP_OK) {
		to->count = before; /* still owned by `from` */
		return status;
	}
	for (size_t i = 0; i < from->count; i++)
		from->items[i].owned = false;
	return GNP_OK;
}

/* A list of single numbers serves an input of rank 2 as its only column. */
static void give_columns(const struct gnp_decode *request, struct gnp_tensors *tensors)
{
	for (size_t i = 0; i < tensors->count; i++) {
		struct gnp_tensor *tensor = &tensors->items[i];
		const struct gnp_tensor_info *info = gnp_decode_input(request, tensor->name);
		if (info && info->rank == 2 && tensor->rank == 1) {
			tensor->rank = 2;
			tensor->shape[1] = 1;
		}
	}
}

static gnp_status decode(enum gnp_format format, const struct gnp_decode *request, struct gnp_tensors *tensors,
                         struct gnp_error *error)
{
	if (!gnp_format_readable(format))
		return gnp_error_set(error, GNP_UNSUPPORTED_MEDIA, "format %s cannot be read", gnp_format_name(format));
	struct gnp_tensors made = {.budget = tensors->budget};
	gnp_status status = decoders[format](request, &made, error);
	if (status == GNP_OK) {
		give_columns(request, &made);
		status = take_all(&made, tensors, error);
	}
	gnp_tensors_clear(&made);
	return status;
}

gnp_status gnp_file_decode(enum gnp_format format, const unsigned char *body, size_t size, const struct gnp_file_wants *wants,
                           struct gnp_tensors *tensors, struct gnp_error *error)
{
	struct gnp_decode request = {.body = body, .size = size, .wants = wants ? *wants : (struct gnp_file_wants){0}};
	return decode(format, &request, tensors, error);
}

gnp_status gnp_file_decode_all(enum gnp_format format, const unsigned char *body, size_t size,
                               struct gnp_tensors *tensors, struct gnp_error *error)
{
	struct gnp_decode request = {.body = body, .size = size, .all = true};
	return decode(format, &request, tensors, error);
}

gnp_status gnp_file_encode(enum gnp_format format, const struct gnp_tensors *tensors, const struct gnp_values *comments,
                           struct gnp_buffer *buffer, struct gnp_error *error)
{
	if (!gnp_format_writable(format))
		return gnp_error_set(error, GNP_NOT_ACCEPTABLE, "format %s cannot be written", gnp_format_name(format));
	size_t before = buffer->size;
	gnp_status status = encoders[format](tensors, comments, buffer, error);
	if (status != GNP_OK)
		buffer->size = before;
	return status;
}
