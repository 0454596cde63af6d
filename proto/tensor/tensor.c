#include "proto/tensor/tensor.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/names.h"
#include "proto/tensor/scalar.h"

const struct gnp_tensor_info *gnp_tensor_infos_find(const struct gnp_tensor_info *infos, size_t count, const char *name,
                                                    size_t length)
{
	for (size_t i = 0; i < count; i++)
		if (strlen(infos[i].name) == length && memcmp(infos[i].name, name, length) == 0)
			return &infos[i];
	return NULL;
}

const char *gnp_tensor_infos_names(const struct gnp_tensor_info *infos, size_t count, const char *given, size_t length,
                                   struct gnp_names *list)
{
	gnp_names_begin(list, given, length);
	for (size_t i = 0; i < count; i++)
		gnp_names_add(list, infos[i].name);
	return gnp_names_end(list);
}

char gnp_extent_letter(int64_t extent)
{
	static const char letters[] = "nmstuv";
	assert(extent < 0 && extent >= -(int64_t)strlen(letters));
	return letters[-extent - 1];
}

bool gnp_tensor_elements(unsigned rank, const size_t *shape, size_t *elements)
{
	size_t product = 1;
	for (unsigned i = 0; i < rank; i++) {
		if (!gnp_size_multiply(product, shape[i], &product))
			return false;
	}
	*elements = product;
	return true;
}

static gnp_status tensor_bytes(const char *name, enum gnp_datatype datatype, unsigned rank, const size_t *shape,
                               size_t *bytes, struct gnp_error *error)
{
	if (strlen(name) >= GNP_TENSOR_NAME_MAX)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "tensor \"%.40s...\": name of %zu bytes, need at most %d",
		                     name, strlen(name), GNP_TENSOR_NAME_MAX - 1);
	if (rank > GNP_TENSOR_RANK_MAX)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "tensor \"%s\": rank %u, need at most %d", name, rank,
		                     GNP_TENSOR_RANK_MAX);
	size_t size = gnp_datatype_size(datatype), elements;
	if (!size)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "tensor \"%s\": datatype %s is not supported, need a numeric one",
		                     name, gnp_datatype_name(datatype));
	if (!gnp_tensor_elements(rank, shape, &elements) || !gnp_size_multiply(elements, size, bytes))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "tensor \"%s\": the shape's product overflows", name);
	return GNP_OK;
}

static gnp_status grow(struct gnp_tensors *tensors, struct gnp_error *error)
{
	if (tensors->count < tensors->capacity)
		return GNP_OK;
	size_t capacity = tensors->capacity ? 2 * tensors->capacity : 4, bytes;
	struct gnp_tensor *items = NULL;
	if (gnp_size_multiply(capacity, sizeof *items, &bytes))
		items = realloc(tensors->items, bytes);
	if (!items)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "tensors: no memory for %zu", capacity);
	tensors->items = items;
	tensors->capacity = capacity;
	return GNP_OK;
}

/* The checks are done and there is room. */
static void append(struct gnp_tensors *tensors, const char *name, enum gnp_datatype datatype, unsigned rank,
                   const size_t *shape, void *data, size_t bytes, bool owned, struct gnp_tensor **out)
{
	struct gnp_tensor *tensor = &tensors->items[tensors->count++];
	*tensor = (struct gnp_tensor){.datatype = datatype, .rank = rank, .data = data, .size = bytes, .owned = owned};
	strcpy(tensor->name, name);
	for (unsigned i = 0; i < rank; i++)
		tensor->shape[i] = shape[i];
	if (out)
		*out = tensor;
}

gnp_status gnp_tensors_add(struct gnp_tensors *tensors, const char *name, enum gnp_datatype datatype, unsigned rank,
                           const size_t *shape, struct gnp_tensor **out, struct gnp_error *error)
{
	size_t bytes;
	gnp_status status = tensor_bytes(name, datatype, rank, shape, &bytes, error);
	if (status == GNP_OK)
		status = grow(tensors, error);
	if (status == GNP_OK)
		status = gnp_budget_reserve(tensors->budget, bytes, error);
	if (status != GNP_OK)
		return status;
	void *data = gnp_array_new(bytes, 1);
	if (!data)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "tensor \"%s\": no memory for %zu bytes", name, bytes);
	append(tensors, name, datatype, rank, shape, data, bytes, true, out);
	return GNP_OK;
}

gnp_status gnp_tensors_add_data(struct gnp_tensors *tensors, const char *name, enum gnp_datatype datatype,
                                unsigned rank, const size_t *shape, void *data, bool owned,
                                struct gnp_tensor **out, struct gnp_error *error)
{
	size_t bytes;
	gnp_status status = tensor_bytes(name, datatype, rank, shape, &bytes, error);
	if (status == GNP_OK)
		status = grow(tensors, error);
	if (status == GNP_OK)
		append(tensors, name, datatype, rank, shape, data, bytes, owned, out);
	return status;
}

const struct gnp_tensor *gnp_tensors_find(const struct gnp_tensors *tensors, const char *name)
{
	for (size_t i = 0; i < tensors->count; i++) {
		if (strcmp(tensors->items[i].name, name) == 0)
			return &tensors->items[i];
	}
	return NULL;
}

void gnp_tensors_clear(struct gnp_tensors *tensors)
{
	for (size_t i = 0; i < tensors->count; i++) {
		if (tensors->items[i].owned)
			free(tensors->items[i].data);
	}
	free(tensors->items);
	*tensors = (struct gnp_tensors){0};
}

double gnp_tensor_get(const struct gnp_tensor *tensor, size_t i)
{
	return gnp_scalar_load(tensor->datatype, (const char *)tensor->data + i * gnp_datatype_size(tensor->datatype));
}

double *gnp_tensor_to_double(const struct gnp_tensor *tensor)
{
	size_t size = gnp_datatype_size(tensor->datatype), count = size ? tensor->size / size : 0;
	double *values = gnp_array_new(count, sizeof *values);
	if (!values)
		return NULL;
	if (tensor->datatype == GNP_FP64) {
		memcpy(values, tensor->data, tensor->size);
	} else if (tensor->datatype == GNP_FP32) {
		const float *source = tensor->data;
		for (size_t i = 0; i < count; i++)
			values[i] = source[i];
	} else {
		for (size_t i = 0; i < count; i++)
			values[i] = gnp_tensor_get(tensor, i);
	}
	return values;
}
