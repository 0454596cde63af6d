#include "proto/oip/oip_tensor.h"

#include <inttypes.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "proto/json/json_numbers.h"
#include "proto/oip/oip.h"

enum { TENSORS_MAX = 256 };

gnp_status gnp_oip_split(const unsigned char *body, size_t size, size_t header_length, const struct gnp_budget *budget,
                         struct gnp_json_document *document, struct gnp_oip_binary *binary, struct gnp_error *error)
{
	bool whole = header_length == GNP_OIP_NO_HEADER;
	if (!whole && header_length > size)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "Inference-Header-Content-Length: got %zu, need at most the body's %zu bytes", header_length, size);
	size_t json_size = whole ? size : header_length;
	*binary = (struct gnp_oip_binary){body + json_size, body + size, !whole};
	return gnp_json_parse((const char *)body, json_size, 3, "data", budget, document, error);
}

struct description {
	const char *name;
	enum gnp_datatype datatype;
	unsigned rank;
	size_t shape[GNP_TENSOR_RANK_MAX];
};

static gnp_status decode_shape(const json_t *shape, struct description *d, struct gnp_error *error)
{
	if (!json_is_array(shape))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "tensor \"%s\": shape: need an array of integers", d->name);
	if (json_array_size(shape) > GNP_TENSOR_RANK_MAX)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "tensor \"%s\": rank %zu, need at most %d", d->name,
		                     json_array_size(shape), GNP_TENSOR_RANK_MAX);
	d->rank = (unsigned)json_array_size(shape);
	for (unsigned i = 0; i < d->rank; i++) {
		const json_t *extent = json_array_get(shape, i);
		if (!json_is_integer(extent) || json_integer_value(extent) < 0)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "tensor \"%s\": shape[%u]: need an integer of at least 0",
			                     d->name, i);
		d->shape[i] = (size_t)json_integer_value(extent);
	}
	return GNP_OK;
}

static gnp_status describe(const json_t *object, const char *list, size_t index, struct description *d,
                           struct gnp_error *error)
{
	if (!json_is_object(object))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s[%zu]: need an object", list, index);
	d->name = json_string_value(json_object_get(object, "name"));
	if (!d->name || !*d->name)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s[%zu]: name: need a string", list, index);
	const char *datatype = json_string_value(json_object_get(object, "datatype"));
	if (!datatype || !gnp_datatype_find(datatype, &d->datatype))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "tensor \"%.60s\": datatype: got %.40s, need one such as FP32",
		                     d->name, datatype ? datatype : "none");
	return decode_shape(json_object_get(object, "shape"), d, error);
}

/* Borrows the bytes, or copies them where they are misaligned for their type. */
static gnp_status take_binary(const struct description *d, const json_t *declared, struct gnp_oip_binary *binary,
                              struct gnp_tensors *tensors, struct gnp_error *error)
{
	size_t item = gnp_datatype_size(d->datatype), left = (size_t)(binary->end - binary->next), elements;
	if (!item)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "tensor \"%.60s\": datatype BYTES is not supported", d->name);
	if (!json_is_integer(declared) || json_integer_value(declared) < 0)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "tensor \"%.60s\": binary_data_size: need an integer of at least 0",
		                     d->name);
	if (!binary->allowed)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "tensor \"%.60s\": binary data needs the header Inference-Header-Content-Length", d->name);
	size_t size = (size_t)json_integer_value(declared);
	if (!gnp_tensor_elements(d->rank, d->shape, &elements) || elements > SIZE_MAX / item)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "tensor \"%.60s\": the shape's product overflows", d->name);
	if (size != elements * item)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "tensor \"%.60s\": binary_data_size: got %zu, need %zu as the shape",
		                     d->name, size, elements * item);
	if (size > left)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "tensor \"%.60s\": binary_data_size: got %zu, the body has %zu left",
		                     d->name, size, left);
	const unsigned char *source = binary->next;
	gnp_status status;
	if ((uintptr_t)source % item == 0) {
		/* Borrowed tensors are never written; the field is not const for the sake of owned ones. */
		status = gnp_tensors_add_data(tensors, d->name, d->datatype, d->rank, d->shape, (void *)(uintptr_t)source, false,
		                              NULL, error);
	} else {
		struct gnp_tensor *tensor;
		status = gnp_tensors_add(tensors, d->name, d->datatype, d->rank, d->shape, &tensor, error);
		if (status == GNP_OK)
			memcpy(tensor->data, source, size);
	}
	if (status == GNP_OK)
		binary->next += size;
	return status;
}

static gnp_status decode_tensor(const struct gnp_json_document *document, const json_t *object, const char *list,
                                size_t index, struct gnp_oip_binary *binary, struct gnp_tensors *tensors,
                                struct gnp_error *error)
{
	struct description d;
	gnp_status status = describe(object, list, index, &d, error);
	if (status != GNP_OK)
		return status;
	if (gnp_tensors_find(tensors, d.name))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: \"%.60s\" is given twice", list, d.name);
	const json_t *data = json_object_get(object, "data"), *parameters = json_object_get(object, "parameters");
	const json_t *declared = json_object_get(parameters, "binary_data_size");
	if (data && declared)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "tensor \"%.60s\": both data and binary_data_size", d.name);
	if (declared)
		return take_binary(&d, declared, binary, tensors, error);
	const struct gnp_json_span *span = gnp_json_member_span(document, data);
	if (!span)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "tensor \"%.60s\": need an array data or the parameter binary_data_size",
		                     d.name);
	return gnp_json_numbers_read(span->text, span->size, d.name, d.datatype, d.rank, d.shape, tensors, error);
}

gnp_status gnp_oip_decode_tensors(const struct gnp_json_document *document, const char *list,
                                  struct gnp_oip_binary *binary, struct gnp_tensors *tensors, struct gnp_error *error)
{
	const json_t *array = json_object_get(document->root, list);
	if (!json_is_array(array))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: need an array of tensors", list);
	if (json_array_size(array) > TENSORS_MAX)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: got %zu, need at most %d", list, json_array_size(array),
		                     TENSORS_MAX);
	for (size_t i = 0; i < json_array_size(array); i++) {
		gnp_status status = decode_tensor(document, json_array_get(array, i), list, i, binary, tensors, error);
		if (status != GNP_OK)
			return status;
	}
	if (binary->next != binary->end)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "body: %zu bytes after the last tensor's",
		                     (size_t)(binary->end - binary->next));
	return GNP_OK;
}

gnp_status gnp_oip_decode_values(const json_t *object, struct gnp_values *values, struct gnp_error *error)
{
	if (object && !json_is_object(object))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "parameters: need an object");
	const char *key;
	json_t *value;
	json_object_foreach((json_t *)(uintptr_t)object, key, value) {
		gnp_status status;
		if (json_is_string(value))
			status = gnp_values_add_string(values, key, json_string_value(value), error);
		else if (json_is_integer(value))
			status = gnp_values_add_integer(values, key, json_integer_value(value), error);
		else if (json_is_real(value))
			status = gnp_values_add_number(values, key, json_real_value(value), error);
		else if (json_is_boolean(value))
			status = gnp_values_add_bool(values, key, json_is_true(value), error);
		else
			status = gnp_error_set(error, GNP_INVALID_ARGUMENT, "parameters: \"%.60s\": need a string, number or boolean", key);
		if (status != GNP_OK)
			return status;
	}
	return GNP_OK;
}

gnp_status gnp_oip_encode_tensor(const struct gnp_tensor *tensor, struct gnp_buffer *buffer, struct gnp_error *error)
{
	gnp_status status = gnp_buffer_append(buffer, "{\"name\":", 8, error);
	if (status == GNP_OK)
		status = gnp_json_write_string(tensor->name, buffer, error);
	if (status == GNP_OK)
		status = gnp_buffer_printf(buffer, error, ",\"datatype\":\"%s\",\"shape\":[", gnp_datatype_name(tensor->datatype));
	for (unsigned d = 0; d < tensor->rank && status == GNP_OK; d++)
		status = gnp_buffer_printf(buffer, error, "%s%zu", d ? "," : "", tensor->shape[d]);
	return status == GNP_OK ? gnp_buffer_append(buffer, "]", 1, error) : status;
}
