#include "proto/codec/fields.h"

#include <ctype.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "proto/tensor/scalar.h"

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
	const char *bare = gnp_decode_bare_name(field->name, &length);
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
		if (gnp_decode_spells(fields->items[i].name, fields->items[i].length, input))
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
	if (!digits || stem < 2 || field->name[stem - 1] != '_' || !gnp_decode_spells(field->name, stem - 1, input))
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

static gnp_status bind_wide(const char *name, const struct fields *fields, struct gnp_tensors *tensors,
                            struct gnp_column *columns, struct gnp_error *error)
{
	int *at = gnp_array_new(fields->count, sizeof *at);
	if (!at)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "%s: no memory for %zu columns", name, fields->count);
	size_t width = find_columns(fields, name, at);
	gnp_status status = width ? bind_columns(name, fields, at, width, tensors, columns, error) : GNP_OK;
	free(at);
	return status;
}

static gnp_status bind_input(const struct gnp_tensor_info *info, const struct fields *fields,
                             struct gnp_tensors *tensors, struct gnp_column *columns, struct gnp_error *error)
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
		if (gnp_decode_is_extra(&decode->wants.inputs[i]))
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

bool gnp_column_copy(const struct gnp_column *column, enum gnp_datatype datatype, const unsigned char *source,
                     size_t step, size_t rows)
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
