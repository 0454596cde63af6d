#include "proto/format/npy.h"

#include <ctype.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "proto/format/format.h"
#include "proto/tensor/scalar.h"

/* dtype kinds and sizes as numpy spells them. */
static const struct {
	char code[4];
	enum gnp_datatype datatype;
} dtypes[] = {
	{"b1", GNP_BOOL}, {"u1", GNP_UINT8}, {"u2", GNP_UINT16}, {"u4", GNP_UINT32}, {"u8", GNP_UINT64}, {"i1", GNP_INT8},
	{"i2", GNP_INT16}, {"i4", GNP_INT32}, {"i8", GNP_INT64}, {"f2", GNP_FP16}, {"f4", GNP_FP32}, {"f8", GNP_FP64},
};

static gnp_status fail(struct gnp_error *error, const char *text)
{
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "npy: %s", text);
}

/* The value of a key of the header's dictionary; NULL when it is absent. */
static const char *dictionary_value(const char *p, const char *end, const char *key)
{
	size_t length = strlen(key);
	for (; (size_t)(end - p) > length + 2; p++) {
		if ((*p != '\'' && *p != '"') || memcmp(p + 1, key, length) != 0 || p[length + 1] != *p)
			continue;
		for (p += length + 2; p < end && isspace((unsigned char)*p); p++)
			continue;
		if (p == end || *p++ != ':')
			return NULL;
		while (p < end && isspace((unsigned char)*p))
			p++;
		return p < end ? p : NULL;
	}
	return NULL;
}

static gnp_status read_descr(const char *p, const char *end, struct gnp_npy *npy, struct gnp_error *error)
{
	if (!p)
		return fail(error, "the header has no descr");
	if (*p != '\'' && *p != '"')
		return fail(error, "structured arrays are not supported");
	const char *close = memchr(p + 1, *p, (size_t)(end - p - 1));
	size_t length = close ? (size_t)(close - p - 1) : 0;
	if (length == 3 && strchr("<>|=", p[1])) {
		for (size_t i = 0; i < sizeof dtypes / sizeof dtypes[0]; i++) {
			if (memcmp(p + 2, dtypes[i].code, 2) != 0)
				continue;
			npy->datatype = dtypes[i].datatype;
			npy->swapped = p[1] == '>';
			return GNP_OK;
		}
	}
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "npy: descr \"%.*s\": need booleans, integers or f2, f4, f8",
	                     (int)(length < 40 ? length : 40), p + 1);
}

static gnp_status read_shape(const char *p, const char *end, struct gnp_npy *npy, struct gnp_error *error)
{
	if (!p || *p++ != '(')
		return fail(error, "the header has no shape");
	while (p < end && *p != ')') {
		if (isspace((unsigned char)*p) || *p == ',' || *p == 'L') {
			p++;
			continue;
		}
		if (!isdigit((unsigned char)*p))
			return fail(error, "shape: need integers of at least 0");
		if (npy->rank == GNP_TENSOR_RANK_MAX)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "npy: rank over %d", GNP_TENSOR_RANK_MAX);
		size_t extent = 0;
		for (; p < end && isdigit((unsigned char)*p); p++) {
			if (__builtin_mul_overflow(extent, 10, &extent) ||
			    __builtin_add_overflow(extent, (size_t)(*p - '0'), &extent))
				return fail(error, "shape: an extent overflows");
		}
		npy->shape[npy->rank++] = extent;
	}
	size_t elements;
	if (p == end)
		return fail(error, "the header's shape does not close");
	if (!gnp_tensor_elements(npy->rank, npy->shape, &elements) ||
	    !gnp_size_multiply(elements, gnp_datatype_size(npy->datatype), &npy->bytes))
		return fail(error, "the shape's product overflows");
	return GNP_OK;
}

gnp_status gnp_npy_read_header(const unsigned char *file, size_t size, struct gnp_npy *npy, struct gnp_error *error)
{
	*npy = (struct gnp_npy){0};
	if (size < 12 || memcmp(file, "\x93NUMPY", 6) != 0)
		return fail(error, "the magic bytes are missing");
	if (file[6] < 1 || file[6] > 3)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "npy: version %u.%u, need 1.0, 2.0 or 3.0", file[6], file[7]);
	size_t start = file[6] == 1 ? 10 : 12, length = file[8] | (size_t)file[9] << 8;
	if (file[6] > 1)
		length |= (size_t)file[10] << 16 | (size_t)file[11] << 24;
	if (length > size - start)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "npy: header of %zu bytes, the file has %zu", length,
		                     size - start);
	const char *text = (const char *)file + start, *end = text + length;
	gnp_status status = read_descr(dictionary_value(text, end, "descr"), end, npy, error);
	const char *order = dictionary_value(text, end, "fortran_order");
	npy->fortran = order && *order == 'T';
	if (status == GNP_OK)
		status = read_shape(dictionary_value(text, end, "shape"), end, npy, error);
	npy->header = start + length;
	return status;
}

/* target[i, j, ...] = source[..., j, i] as stored. */
static void transpose(const struct gnp_npy *npy, unsigned char *target, const unsigned char *source)
{
	size_t size = gnp_datatype_size(npy->datatype), stride[GNP_TENSOR_RANK_MAX], index[GNP_TENSOR_RANK_MAX] = {0};
	size_t step = size, offset = 0;
	for (unsigned d = 0; d < npy->rank; d++) {
		stride[d] = step;
		step *= npy->shape[d];
	}
	for (size_t done = 0; done < npy->bytes; done += size, target += size) {
		memcpy(target, source + offset, size);
		for (unsigned d = npy->rank; d-- > 0;) {
			offset += stride[d];
			if (++index[d] < npy->shape[d])
				break;
			offset -= stride[d] * npy->shape[d];
			index[d] = 0;
		}
	}
}

static gnp_status add_copy(const struct gnp_npy *npy, const char *name, const unsigned char *data,
                           struct gnp_tensors *tensors, struct gnp_error *error)
{
	struct gnp_tensor *tensor;
	gnp_status status = gnp_tensors_add(tensors, name, npy->datatype, npy->rank, npy->shape, &tensor, error);
	if (status != GNP_OK)
		return status;
	size_t size = gnp_datatype_size(npy->datatype);
	if (npy->fortran && npy->rank > 1)
		transpose(npy, tensor->data, data);
	else
		memcpy(tensor->data, data, npy->bytes);
	if (!npy->swapped || size == 1)
		return GNP_OK;
	unsigned char *item = tensor->data;
	for (size_t i = 0; i < npy->bytes; i += size) {
		unsigned char swapped[8];
		gnp_scalar_swap(swapped, item + i, 1, size);
		memcpy(item + i, swapped, size);
	}
	return GNP_OK;
}

gnp_status gnp_npy_add(const struct gnp_npy *npy, const char *name, unsigned char *data, bool take,
                       struct gnp_tensors *tensors, struct gnp_error *error)
{
	size_t size = gnp_datatype_size(npy->datatype);
	bool usable = !(npy->fortran && npy->rank > 1) && (!npy->swapped || size == 1) && (uintptr_t)data % size == 0;
	gnp_status status;
	if (usable)
		status = gnp_tensors_add_data(tensors, name, npy->datatype, npy->rank, npy->shape, data, take, NULL, error);
	else
		status = add_copy(npy, name, data, tensors, error);
	if (take && (!usable || status != GNP_OK)) {
		free(data);
		gnp_budget_release(tensors->budget, npy->bytes);
	}
	return status;
}

/* Columns [first, first + 3) of source as a floating tensor. */
static gnp_status add_vectors(const struct gnp_tensor *source, const char *name, size_t first,
                              struct gnp_tensors *tensors, struct gnp_error *error)
{
	size_t shape[] = {source->shape[0], 3}, width = source->shape[1];
	enum gnp_datatype datatype = gnp_scalar_floating(source->datatype);
	size_t size = gnp_datatype_size(datatype);
	struct gnp_tensor *tensor;
	gnp_status status = gnp_tensors_add(tensors, name, datatype, 2, shape, &tensor, error);
	unsigned char *target = status == GNP_OK ? tensor->data : NULL;
	for (size_t i = 0; status == GNP_OK && i < 3 * shape[0]; i++, target += size)
		gnp_scalar_store(datatype, target, gnp_tensor_get(source, i / 3 * width + first + i % 3));
	return status;
}

static gnp_status check_normals(const struct gnp_tensor *source, const char *name, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	for (size_t row = 0; row < source->shape[0] && status == GNP_OK; row++) {
		double n[3];
		for (size_t c = 0; c < 3; c++)
			n[c] = gnp_tensor_get(source, 6 * row + 3 + c);
		status = gnp_decode_check_normal(name, row, n, "the first three columns alone where they are colours", error);
	}
	return status;
}

static bool is_points(const char *name)
{
	return strcmp(name, "points") == 0;
}

gnp_status gnp_npy_check_vectors(const struct gnp_npy *npy, const char *name, struct gnp_error *error)
{
	bool both = is_points(name) && npy->rank == 2 && npy->shape[1] == 6;
	if (npy->rank != 2 || (npy->shape[1] != 3 && !both))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: array of rank %u with %zu columns, need (n,3)%s", name,
		                     npy->rank,
		                     npy->rank > 1 ? npy->shape[1] : 1, is_points(name) ? " or (n,6) with normals" : "");
	return GNP_OK;
}

gnp_status gnp_npy_check_input(const struct gnp_npy *npy, const struct gnp_tensor_info *input, struct gnp_error *error)
{
	if (npy->rank == input->rank || (npy->rank == 1 && input->rank == 2))
		return GNP_OK;
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: array of rank %u, need rank %u", input->name, npy->rank,
	                     input->rank);
}

gnp_status gnp_npy_split_vectors(struct gnp_tensors *tensors, const char *name, struct gnp_error *error)
{
	struct gnp_tensor source = tensors->items[tensors->count - 1];
	bool both = source.shape[1] == 6;
	if (!both && (source.datatype == GNP_FP32 || source.datatype == GNP_FP64))
		return GNP_OK;
	tensors->count--;
	gnp_status status = both ? check_normals(&source, name, error) : GNP_OK;
	if (status == GNP_OK)
		status = add_vectors(&source, name, 0, tensors, error);
	if (status == GNP_OK && both)
		status = add_vectors(&source, "normals", 3, tensors, error);
	if (source.owned) {
		free(source.data);
		gnp_budget_release(tensors->budget, source.size);
	}
	return status;
}

static gnp_status decode_file(const struct gnp_decode *decode, struct gnp_tensors *tensors, struct gnp_error *error)
{
	struct gnp_npy npy;
	gnp_status status = gnp_npy_read_header(decode->body, decode->size, &npy, error);
	if (status != GNP_OK)
		return status;
	size_t left = decode->size - npy.header;
	if (npy.bytes != left)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "npy: the shape needs %zu bytes, the file has %zu", npy.bytes,
		                     left);
	if (!decode->all)
		status = gnp_npy_check_vectors(&npy, "points", error);
	if (status == GNP_OK)
		status = gnp_decode_check_points(decode, npy.rank ? npy.shape[0] : 0, error);
	if (status != GNP_OK)
		return status;
	bool points = !decode->all || (npy.rank == 2 && npy.shape[1] == 3);
	/* Borrowed tensors are never written. */
	status = gnp_npy_add(&npy, points ? "points" : "data", (unsigned char *)(uintptr_t)decode->body + npy.header, false,
	                     tensors, error);
	return status == GNP_OK && !decode->all ? gnp_npy_split_vectors(tensors, "points", error) : status;
}

gnp_status gnp_npy_write_header(const struct gnp_tensor *tensor, struct gnp_buffer *buffer, struct gnp_error *error)
{
	const char *code = NULL;
	for (size_t i = 0; i < sizeof dtypes / sizeof dtypes[0]; i++) {
		if (dtypes[i].datatype == tensor->datatype)
			code = dtypes[i].code;
	}
	if (!code)
		return gnp_error_set(error, GNP_NOT_ACCEPTABLE, "npy: \"%s\": datatype %s has no form", tensor->name,
		                     gnp_datatype_name(tensor->datatype));
	size_t before = buffer->size;
	gnp_status status = gnp_buffer_append(buffer, "\x93NUMPY\x01\x00\x00\x00", 10, error);
	if (status == GNP_OK)
		status = gnp_buffer_printf(buffer, error, "{'descr': '%c%s', 'fortran_order': False, 'shape': (",
		                           gnp_datatype_size(tensor->datatype) == 1 ? '|' : '<', code);
	for (unsigned d = 0; d < tensor->rank && status == GNP_OK; d++)
		status = gnp_buffer_printf(buffer, error, "%zu%s", tensor->shape[d], d + 1 < tensor->rank ? ", "
		                           : tensor->rank == 1 ? "," : "");
	if (status == GNP_OK)
		status = gnp_buffer_printf(buffer, error, "), }");
	if (status == GNP_OK)
		status = gnp_buffer_printf(buffer, error, "%*s\n", (int)(63 - (buffer->size - before) % 64), "");
	if (status != GNP_OK)
		return status;
	size_t length = buffer->size - before - 10;
	buffer->data[before + 8] = (unsigned char)length;
	buffer->data[before + 9] = (unsigned char)(length >> 8);
	return GNP_OK;
}

/* The array of a file that holds one: the only tensor, or the only one beside points. */
static const struct gnp_tensor *only_array(const struct gnp_tensors *tensors)
{
	if (tensors->count == 1)
		return &tensors->items[0];
	for (size_t i = 0; tensors->count == 2 && i < 2; i++) {
		if (strcmp(tensors->items[i].name, "points") == 0)
			return &tensors->items[1 - i];
	}
	return NULL;
}

static gnp_status encode_file(const struct gnp_tensors *tensors, const struct gnp_values *comments,
                              struct gnp_buffer *buffer,
                          struct gnp_error *error)
{
	(void)comments; /* the format has no place for them */
	const struct gnp_tensor *tensor = only_array(tensors);
	if (!tensor)
		return gnp_error_set(error, GNP_NOT_ACCEPTABLE, "npy: holds one array beside points, got %zu: ask for npz",
		                     tensors->count);
	gnp_status status = gnp_npy_write_header(tensor, buffer, error);
	return status == GNP_OK ? gnp_buffer_append(buffer, tensor->data, tensor->size, error) : status;
}

static const char *const magic[] = {"\x93NUMPY", NULL};
static const char *const other_media_types[] = {"application/npy", NULL};

const struct gnp_format gnp_format_npy = {
	.name = "npy", .media_type = "application/x-npy", .extension = "npy", .other_media_types = other_media_types,
	.holds = GNP_HOLDS_ARRAY, .magic = magic, .decode = decode_file, .encode = encode_file};
