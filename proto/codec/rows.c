#include "proto/codec/rows.h"

#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "core/base/memory.h"

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
			return gnp_error_set(error, GNP_NOT_ACCEPTABLE,
			                     "%s: \"%s\" has %zu rows, need %zu as points has: ask for npz",
			                     format, t->name, t->rank ? t->shape[0] : 0, rows);
		*most += rows ? row_width(t) : 0;
		if (*most > GNP_FORMAT_COLUMNS_MAX)
			return gnp_error_set(error, GNP_NOT_ACCEPTABLE, "%s: more than %d columns: ask for npz", format,
			                     GNP_FORMAT_COLUMNS_MAX);
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
