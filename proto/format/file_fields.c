/* What the formats made of rows share: which field goes where, and which columns a file gets. */
#include <ctype.h>
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "proto/format/file_codec.h"
#include "proto/tensor/number.h"
#include "proto/tensor/scalar.h"
#include "proto/tensor/warnings.h"

gnp_status gnp_decode_check_points(const struct gnp_decode *decode, size_t count, struct gnp_error *error)
{
	size_t most = decode->wants.max_points;
	if (most && count > most)
		return gnp_error_set(error, GNP_TOO_LARGE, "points: got %zu, need at most %zu", count, most);
	return GNP_OK;
}

/* A file's name without the scalar_ that PLY and its readers put before scalars, some once more each time a file goes through them. */
static const char *bare_name(const char *text, size_t *length)
{
	size_t prefix = strlen("scalar_");
	for (; *length > prefix && memcmp(text, "scalar_", prefix) == 0; text += prefix)
		*length -= prefix;
	return text;
}

/* Whether a file's name stands for `name`. */
static bool spells(const char *text, size_t length, const char *name)
{
	text = bare_name(text, &length);
	return strlen(name) == length && memcmp(text, name, length) == 0;
}

static bool is_extra(const struct gnp_tensor_info *info)
{
	return strcmp(info->name, "points") != 0 && strcmp(info->name, "normals") != 0;
}

const struct gnp_tensor_info *gnp_decode_input(const struct gnp_decode *decode, const char *name)
{
	for (size_t i = 0; i < decode->wants.input_count; i++) {
		const struct gnp_tensor_info *info = &decode->wants.inputs[i];
		if (is_extra(info) && spells(name, strlen(name), info->name))
			return info;
	}
	return NULL;
}

enum { AXES = 6, NONE = -1 };

/* 0..2: x y z; 3..5: the normal; NONE otherwise. */
static int axis_of(const struct gnp_field *field)
{
	static const char *const prefixes[] = {"", "n", "normal_", "normal"};
	for (int p = 0; p < 4; p++) {
		size_t length = strlen(prefixes[p]);
		if (field->length == length + 1 && memcmp(field->name, prefixes[p], length) == 0) {
			char letter = field->name[length];
			if (letter >= 'x' && letter <= 'z')
				return (p ? 3 : 0) + letter - 'x';
		}
	}
	return NONE;
}

/* A tensor (rows, 3) of the widest floating type that its three fields need. */
static gnp_status bind_vector(const char *name, const struct gnp_field *fields, const int *axes, size_t rows,
                              struct gnp_tensors *tensors, struct gnp_column *columns, struct gnp_error *error)
{
	enum gnp_datatype datatype = GNP_FP32;
	for (int a = 0; a < 3; a++) {
		if (gnp_scalar_floating(fields[axes[a]].datatype) == GNP_FP64)
			datatype = GNP_FP64;
	}
	size_t shape[] = {rows, 3}, size = gnp_datatype_size(datatype);
	struct gnp_tensor *tensor;
	gnp_status status = gnp_tensors_add(tensors, name, datatype, 2, shape, &tensor, error);
	for (size_t a = 0; a < 3 && status == GNP_OK; a++)
		columns[axes[a]] = (struct gnp_column){(unsigned char *)tensor->data + a * size, 3 * size, datatype};
	return status;
}

static gnp_status bind_scalar(const struct gnp_field *field, size_t rows, struct gnp_tensors *tensors,
                              struct gnp_column *column, struct gnp_error *error)
{
	char name[GNP_TENSOR_NAME_MAX];
	size_t length = field->length;
	const char *bare = bare_name(field->name, &length);
	snprintf(name, sizeof name, "%.*s", (int)length, bare);
	if (gnp_tensors_find(tensors, name))
		return GNP_OK;
	struct gnp_tensor *tensor;
	gnp_status status = gnp_tensors_add(tensors, name, field->datatype, 1, &rows, &tensor, error);
	if (status == GNP_OK)
		*column = (struct gnp_column){tensor->data, gnp_datatype_size(field->datatype), field->datatype};
	return status;
}

struct fields {
	const struct gnp_field *items;
	size_t count, rows;
};

static int find_field(const struct fields *fields, const char *input)
{
	for (size_t i = 0; i < fields->count; i++) {
		if (spells(fields->items[i].name, fields->items[i].length, input))
			return (int)i;
	}
	return NONE;
}

/* i of a field called input_i, else NONE. */
static int column_index(const struct gnp_field *field, const char *input)
{
	size_t digits = 0;
	int index = 0;
	while (digits < field->length && digits < 5 && isdigit((unsigned char)field->name[field->length - 1 - digits]))
		digits++;
	size_t stem = field->length - digits;
	if (!digits || stem < 2 || field->name[stem - 1] != '_' || !spells(field->name, stem - 1, input))
		return NONE;
	for (size_t i = stem; i < field->length; i++)
		index = 10 * index + (field->name[i] - '0');
	return index;
}

/* at (fields->count): the fields called input_0, input_1, ...; returns how many there are without a gap. */
static size_t find_columns(const struct fields *fields, const char *input, int *at)
{
	size_t width = 0;
	for (size_t i = 0; i < fields->count; i++)
		at[i] = NONE;
	for (size_t i = 0; i < fields->count; i++) {
		int index = column_index(&fields->items[i], input);
		if (index != NONE && (size_t)index < fields->count && at[index] == NONE)
			at[index] = (int)i;
	}
	while (width < fields->count && at[width] != NONE)
		width++;
	return width;
}

/* One tensor of their type or, where they differ, of FP64. */
static gnp_status bind_columns(const char *name, const struct fields *fields, const int *at, size_t width,
                               struct gnp_tensors *tensors, struct gnp_column *columns, struct gnp_error *error)
{
	enum gnp_datatype datatype = fields->items[at[0]].datatype;
	for (size_t c = 1; c < width; c++) {
		if (fields->items[at[c]].datatype != datatype)
			datatype = GNP_FP64;
	}
	size_t shape[] = {fields->rows, width}, size = gnp_datatype_size(datatype);
	struct gnp_tensor *tensor;
	gnp_status status = gnp_tensors_add(tensors, name, datatype, 2, shape, &tensor, error);
	for (size_t c = 0; c < width && status == GNP_OK; c++)
		columns[at[c]] = (struct gnp_column){(unsigned char *)tensor->data + c * size, width * size, datatype};
	return status;
}

static gnp_status bind_wide(const char *name, const struct fields *fields, struct gnp_tensors *tensors, struct gnp_column *columns,
                            struct gnp_error *error)
{
	int *at = gnp_array_new(fields->count, sizeof *at);
	if (!at)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "%s: no memory for %zu columns", name, fields->count);
	size_t width = find_columns(fields, name, at);
	gnp_status status = width ? bind_columns(name, fields, at, width, tensors, columns, error) : GNP_OK;
	free(at);
	return status;
}

static gnp_status bind_input(const struct gnp_tensor_info *info, const struct fields *fields, struct gnp_tensors *tensors,
                             struct gnp_column *columns, struct gnp_error *error)
{
	int field = find_field(fields, info->name);
	if (field != NONE)
		return bind_scalar(&fields->items[field], fields->rows, tensors, &columns[field], error);
	return info->rank == 2 ? bind_wide(info->name, fields, tensors, columns, error) : GNP_OK;
}

static gnp_status bind_inputs(const struct gnp_decode *decode, const struct fields *fields, struct gnp_tensors *tensors,
                              struct gnp_column *columns, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	for (size_t i = 0; i < decode->wants.input_count && status == GNP_OK; i++) {
		if (is_extra(&decode->wants.inputs[i]))
			status = bind_input(&decode->wants.inputs[i], fields, tensors, columns, error);
	}
	return status;
}

gnp_status gnp_fields_bind(const struct gnp_decode *decode, const char *format, const struct gnp_field *fields,
                           size_t count, size_t rows, struct gnp_tensors *tensors, struct gnp_column *columns,
                           struct gnp_error *error)
{
	int axes[AXES] = {NONE, NONE, NONE, NONE, NONE, NONE};
	for (size_t i = 0; i < count; i++) {
		int axis = axis_of(&fields[i]);
		columns[i] = (struct gnp_column){0};
		if (axis != NONE && axes[axis] == NONE)
			axes[axis] = (int)i;
	}
	if (axes[0] == NONE || axes[1] == NONE || axes[2] == NONE)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: the points have no x, y and z", format);
	gnp_status status = bind_vector("points", fields, axes, rows, tensors, columns, error);
	if (status == GNP_OK && axes[3] != NONE && axes[4] != NONE && axes[5] != NONE)
		status = bind_vector("normals", fields, axes + 3, rows, tensors, columns, error);
	if (status == GNP_OK)
		status = bind_inputs(decode, &(struct fields){fields, count, rows}, tensors, columns, error);
	for (size_t i = 0; i < count && status == GNP_OK && decode->all; i++) {
		if (!columns[i].target && fields[i].length)
			status = bind_scalar(&fields[i], rows, tensors, &columns[i], error);
	}
	return status;
}

bool gnp_column_copy(const struct gnp_column *column, enum gnp_datatype datatype, const unsigned char *source, size_t step,
                     size_t rows)
{
	unsigned char *target = column->target;
	size_t size = gnp_datatype_size(datatype);
	for (size_t row = 0; row < rows; row++, source += step, target += column->stride) {
		if (datatype != column->datatype) {
			if (!gnp_scalar_store(column->datatype, target, gnp_scalar_load(datatype, source)))
				return false;
		} else if (size == 4) {
			memcpy(target, source, 4);
		} else {
			memcpy(target, source, size);
		}
	}
	return true;
}

gnp_status gnp_encode_points(const struct gnp_tensors *tensors, const char *format, const struct gnp_tensor **points,
                             struct gnp_error *error)
{
	const struct gnp_tensor *found = gnp_tensors_find(tensors, "points");
	if (!found || found->rank != 2 || found->shape[1] != 3)
		return gnp_error_set(error, GNP_NOT_ACCEPTABLE, "%s: needs points (n,3)", format);
	*points = found;
	return GNP_OK;
}

static bool fits_int32(const struct gnp_tensor *tensor)
{
	size_t count = tensor->size / gnp_datatype_size(tensor->datatype);
	for (size_t i = 0; i < count; i++) {
		double value = gnp_tensor_get(tensor, i);
		if (value < INT32_MIN || value > INT32_MAX)
			return false;
	}
	return true;
}

enum gnp_datatype gnp_stored_type(const struct gnp_tensor *tensor)
{
	switch (tensor->datatype) {
	case GNP_BOOL: return GNP_UINT8;
	case GNP_FP16: return GNP_FP32;
	case GNP_INT64:
	case GNP_UINT64: return fits_int32(tensor) ? GNP_INT32 : GNP_FP64;
	default: return tensor->datatype;
	}
}

static bool is_vector(const struct gnp_tensor *tensor, const char *name)
{
	return strcmp(tensor->name, name) == 0 && tensor->rank == 2 && tensor->shape[1] == 3;
}

static size_t row_width(const struct gnp_tensor *tensor)
{
	size_t width = 1;
	for (unsigned d = 1; d < tensor->rank; d++)
		width *= tensor->shape[d];
	return width;
}

static void add_item(struct gnp_row_item *items, size_t *count, const struct gnp_tensor *tensor, size_t index,
                     const char *prefix, const char *name, bool numbered)
{
	struct gnp_row_item *item = &items[(*count)++];
	*item = (struct gnp_row_item){.tensor = tensor, .item = index};
	if (numbered)
		snprintf(item->name, sizeof item->name, "%s%s_%zu", prefix, name, index);
	else
		snprintf(item->name, sizeof item->name, "%s%s", prefix, name);
}

/* Upper bound of the columns, after checking that every tensor has one row a point. */
static gnp_status count_items(const struct gnp_tensors *tensors, const char *format, size_t rows, size_t *most,
                              struct gnp_error *error)
{
	*most = 1;
	for (size_t i = 0; i < tensors->count; i++) {
		const struct gnp_tensor *t = &tensors->items[i];
		if (t->rank == 0 || t->shape[0] != rows)
			return gnp_error_set(error, GNP_NOT_ACCEPTABLE, "%s: \"%s\" has %zu rows, need %zu as points has: ask for npz",
			                     format, t->name, t->rank ? t->shape[0] : 0, rows);
		*most += rows ? row_width(t) : 0;
		if (*most > GNP_FORMAT_COLUMNS_MAX)
			return gnp_error_set(error, GNP_NOT_ACCEPTABLE, "%s: more than %d columns: ask for npz", format, GNP_FORMAT_COLUMNS_MAX);
	}
	return GNP_OK;
}

gnp_status gnp_row_items(const struct gnp_tensors *tensors, const char *format, const char *prefix, bool quality,
                         struct gnp_row_item **items, size_t *count, struct gnp_error *error)
{
	static const char *const axes[] = {"x", "y", "z", "nx", "ny", "nz"};
	const struct gnp_tensor *points = NULL;
	size_t most, made = 0;
	gnp_status status = gnp_encode_points(tensors, format, &points, error);
	if (status == GNP_OK)
		status = count_items(tensors, format, points->shape[0], &most, error);
	if (status != GNP_OK)
		return status;
	struct gnp_row_item *list = gnp_array_new(most + 6, sizeof *list);
	if (!list)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "%s: no memory for %zu columns", format, most);
	for (size_t a = 0; a < 3; a++)
		add_item(list, &made, points, a, "", axes[a], false);
	const struct gnp_tensor *normals = gnp_tensors_find(tensors, "normals"), *scalar = NULL;
	if (normals && !is_vector(normals, "normals"))
		normals = NULL;
	for (size_t a = 0; a < 3 && normals; a++)
		add_item(list, &made, normals, a, "", axes[3 + a], false);
	for (size_t i = 0; i < tensors->count && !scalar; i++)
		scalar = tensors->items[i].rank == 1 ? &tensors->items[i] : NULL;
	const struct gnp_tensor *named = gnp_tensors_find(tensors, "quality");
	if (named && named->rank == 1)
		scalar = named;
	if (quality && scalar)
		add_item(list, &made, scalar, 0, "", "quality", false);
	for (size_t i = 0; i < tensors->count; i++) {
		const struct gnp_tensor *t = &tensors->items[i];
		size_t width = t == points || t == normals || (quality && t == scalar && t == named) ? 0 : row_width(t);
		for (size_t w = 0; w < width && points->shape[0]; w++)
			add_item(list, &made, t, w, prefix, t->name, t->rank > 1);
	}
	*items = list;
	*count = made;
	return GNP_OK;
}

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
static gnp_status write_warnings(const char *joined, const char *prefix, struct gnp_buffer *buffer, struct gnp_error *error)
{
	const char *text;
	size_t length;
	gnp_status status = GNP_OK;
	while (status == GNP_OK && gnp_warnings_next(&joined, &text, &length))
		status = gnp_buffer_printf(buffer, error, "%s" GNP_WARNINGS_NAME " %.*s\n", prefix, (int)length, text);
	return status;
}

gnp_status gnp_check_normal_columns(const char *what, size_t row, const double normal[3], const char *otherwise, struct gnp_error *error)
{
	double length = sqrt(normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2]);
	if (fabs(length - 1) < 0.05)
		return GNP_OK;
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: row %zu: columns 4 to 6 have length %g, need unit normals or %s", what, row, length,
	                     otherwise);
}

gnp_status gnp_write_comments(const struct gnp_values *comments, const char *prefix, struct gnp_buffer *buffer,
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
