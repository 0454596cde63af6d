#include "clients/fields.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/names.h"

static const struct gnp_tensor *find_spelled(const struct gnp_tensors *tensors, const char *name, const char *ending)
{
	char spelled[GNP_TENSOR_NAME_MAX + 16];
	snprintf(spelled, sizeof spelled, "scalar_%s%s", name, ending);
	const struct gnp_tensor *tensor = gnp_tensors_find(tensors, spelled + strlen("scalar_"));
	return tensor ? tensor : gnp_tensors_find(tensors, spelled);
}

static const struct gnp_tensor *find_column(const struct gnp_tensors *tensors, const char *name, size_t column)
{
	char ending[24];
	snprintf(ending, sizeof ending, "_%zu", column);
	return find_spelled(tensors, name, ending);
}

const struct gnp_tensor *gnp_field_find(const struct gnp_tensors *tensors, const char *name)
{
	const struct gnp_tensor *tensor = find_spelled(tensors, name, "");
	return tensor ? tensor : find_column(tensors, name, 0);
}

static gnp_status not_found(const struct gnp_tensors *tensors, const char *name, struct gnp_error *error)
{
	struct gnp_names list;
	gnp_names_begin(&list, name, strlen(name));
	for (size_t i = 0; i < tensors->count; i++)
		gnp_names_add(&list, tensors->items[i].name);
	return gnp_error_set(error, GNP_NOT_FOUND, "field %.64s: not in the file, which has %s", name, gnp_names_end(&list));
}

static gnp_status wrong_size(const char *name, const struct gnp_tensor *tensor, size_t count, size_t width,
                             struct gnp_error *error)
{
	size_t elements = 0;
	gnp_tensor_elements(tensor->rank, tensor->shape, &elements);
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "field %.64s: got %zu values of type %s, need %zu a point for %zu points",
	                     name, elements, gnp_datatype_name(tensor->datatype), width, count);
}

/* Copies one tensor into column `column` of values; stride columns a row. */
static bool copy_columns(const struct gnp_tensor *tensor, size_t count, size_t columns, double *values, size_t column,
                         size_t stride)
{
	size_t elements, wanted;
	if (!gnp_tensor_elements(tensor->rank, tensor->shape, &elements) || !gnp_size_multiply(count, columns, &wanted) ||
	    elements != wanted || tensor->datatype == GNP_BYTES)
		return false;
	for (size_t i = 0; i < count; i++)
		for (size_t j = 0; j < columns; j++)
			values[i * stride + column + j] = gnp_tensor_get(tensor, i * columns + j);
	return true;
}

gnp_status gnp_field_load(const struct gnp_tensors *tensors, const char *name, size_t count, size_t width, double **out,
                          struct gnp_error *error)
{
	const struct gnp_tensor *whole = find_spelled(tensors, name, "");
	size_t elements;
	double *values = gnp_size_multiply(count, width, &elements) ? gnp_array_new(elements, sizeof *values) : NULL;
	if (!values)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "field %.64s: no memory for %zu points", name, count);
	gnp_status status = GNP_OK;
	if (whole && !copy_columns(whole, count, width, values, 0, width))
		status = wrong_size(name, whole, count, width, error);
	for (size_t column = 0; !whole && column < width && status == GNP_OK; column++) {
		const struct gnp_tensor *part = find_column(tensors, name, column);
		if (!part)
			status = not_found(tensors, name, error);
		else if (!copy_columns(part, count, 1, values, column, width))
			status = wrong_size(name, part, count, 1, error);
	}
	if (status != GNP_OK) {
		free(values);
		return status;
	}
	*out = values;
	return GNP_OK;
}

gnp_status gnp_field_points(const struct gnp_tensors *tensors, size_t *count, double **out, struct gnp_error *error)
{
	const struct gnp_tensor *points = gnp_tensors_find(tensors, "points");
	double *values;
	if (!points || points->rank != 2 || points->shape[0] == 0)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "points: none in the file");
	gnp_status status = gnp_field_load(tensors, "points", points->shape[0], 3, &values, error);
	if (status != GNP_OK)
		return status;
	for (size_t i = 0; i < 3 * points->shape[0]; i++) {
		if (isfinite(values[i]))
			continue;
		status = gnp_error_set(error, GNP_INVALID_ARGUMENT, "points: got %g in row %zu, need finite numbers", values[i], i / 3);
		free(values);
		return status;
	}
	*count = points->shape[0];
	*out = values;
	return GNP_OK;
}
