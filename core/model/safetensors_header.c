#include "core/model/safetensors_header.h"

#include <jansson.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/headroom.h"
#include "core/base/memory.h"

static const char metadata_key[] = "__metadata__";
enum { NESTING_MAX = 4, SHOWN = 60 };

static gnp_status bad_tensor(const struct gnp_safetensors *file, const char *name, struct gnp_error *error,
                             const char *format, ...) __attribute__((format(printf, 4, 5)));

static gnp_status bad_tensor(const struct gnp_safetensors *file, const char *name, struct gnp_error *error,
                             const char *format, ...)
{
	char text[220];
	va_list arguments;
	va_start(arguments, format);
	vsnprintf(text, sizeof text, format, arguments);
	va_end(arguments);
	return gnp_safetensors_fail(file->path, error, GNP_INVALID_ARGUMENT, "tensor \"%.64s\": %s", name, text);
}

/* The parser recurses; what it is given does not nest deeper than a file of tensors does. */
static bool nests_too_deep(const char *text, size_t size)
{
	int depth = 0;
	bool quoted = false;
	for (size_t i = 0; i < size && depth <= NESTING_MAX; i++) {
		if (quoted && text[i] == '\\')
			i++;
		else if (text[i] == '"')
			quoted = !quoted;
		else if (!quoted)
			depth += (text[i] == '{' || text[i] == '[') - (text[i] == '}' || text[i] == ']');
	}
	return depth > NESTING_MAX;
}

/* Bytes jansson takes for a byte of text, at most. */
enum { HEADER_COST = 128 };

static gnp_status parse_header(struct gnp_safetensors *weights, const char *text, size_t size, struct gnp_error *error)
{
	json_error_t fault;
	if (text[0] != '{')
		return gnp_safetensors_fail(weights->path, error, GNP_INVALID_ARGUMENT, "header: got byte 0x%02x first, need {",
		              (unsigned char)text[0]);
	if (nests_too_deep(text, size))
		return gnp_safetensors_fail(weights->path, error, GNP_INVALID_ARGUMENT,
		                            "header: nested deeper than %d, need a table of tensors",
		              NESTING_MAX);
	/* jansson does not bear to run out of memory: it fails an assertion. */
	if (gnp_headroom_need(weights->path, HEADER_COST * size, error) != GNP_OK)
		return GNP_OUT_OF_MEMORY;
	weights->root = json_loadb(text, size, JSON_REJECT_DUPLICATES, &fault);
	if (!weights->root)
		return gnp_safetensors_fail(weights->path, error, GNP_INVALID_ARGUMENT,
		                            "header: not strict JSON at byte %d: %.120s",
		              fault.position, fault.text);
	return GNP_OK;
}

static bool name_fits(const char *name)
{
	size_t length = strlen(name);
	for (size_t i = 0; i < length; i++)
		if ((unsigned char)name[i] < ' ' || name[i] == 0x7f)
			return false;
	return length >= 1 && length <= GNP_SAFETENSORS_NAME_MAX;
}

static gnp_status bad_name(const char *path, const char *what, const char *name, struct gnp_error *error)
{
	return gnp_safetensors_fail(path, error, GNP_INVALID_ARGUMENT,
	                            "%s name \"%.64s\" of %zu bytes: need 1..%d without control characters",
	              what, name, strlen(name), GNP_SAFETENSORS_NAME_MAX);
}

static int by_key(const void *a, const void *b)
{
	const struct gnp_safetensors_metadata *left = a, *right = b;
	return strcmp(left->key, right->key);
}

static gnp_status read_metadata(struct gnp_safetensors *file, const json_t *object, struct gnp_error *error)
{
	const char *key;
	json_t *value;
	if (!json_is_object(object))
		return gnp_safetensors_fail(file->path, error, GNP_INVALID_ARGUMENT,
		                            "%s: need an object of strings", metadata_key);
	file->metadata = gnp_array_new(json_object_size(object), sizeof *file->metadata);
	if (!file->metadata)
		return gnp_safetensors_no_memory(file->path, json_object_size(object) * sizeof *file->metadata, error);
	json_object_foreach((json_t *)object, key, value)
	{
		if (!name_fits(key))
			return bad_name(file->path, metadata_key, key, error);
		if (!json_is_string(value))
			return gnp_safetensors_fail(file->path, error, GNP_INVALID_ARGUMENT,
			                            "%s: \"%.64s\" is no string, need one", metadata_key, key);
		file->metadata[file->metadata_count++] = (struct gnp_safetensors_metadata){key, json_string_value(value)};
	}
	qsort(file->metadata, file->metadata_count, sizeof *file->metadata, by_key);
	return GNP_OK;
}

static bool read_size(const json_t *value, size_t *size)
{
	if (!json_is_integer(value) || json_integer_value(value) < 0)
		return false;
	*size = (size_t)json_integer_value(value);
	return true;
}

/* A value of the header as a message shows it, cut to fit. */
static const char *show(const json_t *value, char text[SHOWN + 1])
{
	size_t length = value ? json_dumpb(value, text, SHOWN, JSON_ENCODE_ANY | JSON_COMPACT) : 0;
	text[length < SHOWN ? length : SHOWN] = '\0';
	return value ? text : "none";
}

static gnp_status read_shape(const struct gnp_safetensors *file, const json_t *shape,
                             struct gnp_safetensors_tensor *tensor, size_t *bytes, struct gnp_error *error)
{
	char shown[SHOWN + 1];
	size_t rank = json_array_size(shape), count = 1;
	bool fits = json_is_array(shape) && rank <= GNP_SAFETENSORS_RANK_MAX;
	for (size_t d = 0; d < rank && fits; d++)
		fits = read_size(json_array_get(shape, d), &tensor->shape[d]) && tensor->shape[d] > 0;
	if (!fits)
		return bad_tensor(file, tensor->name, error, "shape: got %s, need at most %d integers of at least 1",
		                  show(shape, shown), GNP_SAFETENSORS_RANK_MAX);
	for (size_t d = 0; d < rank && fits; d++)
		fits = gnp_size_multiply(count, tensor->shape[d], &count);
	if (!fits || !gnp_size_multiply(count, sizeof(float), bytes) || *bytes > file->data_size)
		return bad_tensor(file, tensor->name, error, "shape: got %s of 4 bytes each, the file has %zu bytes of data",
		                  show(shape, shown), file->data_size);
	tensor->rank = rank;
	tensor->count = count;
	return GNP_OK;
}

static gnp_status read_place(const struct gnp_safetensors *file, const json_t *offsets, size_t bytes,
                             struct gnp_safetensors_tensor *tensor, struct gnp_error *error)
{
	char shown[SHOWN + 1];
	size_t begin, end;
	if (json_array_size(offsets) != 2 || !read_size(json_array_get(offsets, 0), &begin) ||
	    !read_size(json_array_get(offsets, 1), &end) || begin > end || end > file->data_size)
		return bad_tensor(file, tensor->name, error, "data_offsets: got %s, need two ascending integers of 0..%zu",
		                  show(offsets, shown), file->data_size);
	if (end - begin != bytes)
		return bad_tensor(file, tensor->name, error,
		                  "data_offsets: got %zu bytes, need %zu for its shape", end - begin, bytes);
	tensor->data = (const float *)(const void *)(file->data + begin);
	return GNP_OK;
}

static gnp_status read_tensor(const struct gnp_safetensors *file, const char *name, const json_t *entry,
                              struct gnp_safetensors_tensor *tensor, struct gnp_error *error)
{
	const json_t *dtype = json_object_get(entry, "dtype");
	char shown[SHOWN + 1];
	const char *key;
	json_t *value;
	size_t bytes;
	*tensor = (struct gnp_safetensors_tensor){.name = name};
	if (!name_fits(name))
		return bad_name(file->path, "tensor", name, error);
	json_object_foreach((json_t *)entry, key, value)
	{
		if (strcmp(key, "dtype") != 0 && strcmp(key, "shape") != 0 && strcmp(key, "data_offsets") != 0)
			return bad_tensor(file, name, error, "unknown key \"%.40s\", need dtype, shape, data_offsets", key);
	}
	if (!json_is_string(dtype) || strcmp(json_string_value(dtype), "F32") != 0)
		return bad_tensor(file, name, error, "dtype: got %s, need \"F32\"", show(dtype, shown));
	gnp_status status = read_shape(file, json_object_get(entry, "shape"), tensor, &bytes, error);
	return status == GNP_OK ? read_place(file, json_object_get(entry, "data_offsets"), bytes, tensor, error) : status;
}

static int by_place(const void *a, const void *b)
{
	const struct gnp_safetensors_tensor *left = a, *right = b;
	if (left->data != right->data)
		return left->data < right->data ? -1 : 1;
	return strcmp(left->name, right->name);
}

static size_t offset_of(const struct gnp_safetensors *file, const struct gnp_safetensors_tensor *tensor)
{
	return (size_t)((const unsigned char *)(const void *)tensor->data - file->data);
}

/* Each tensor begins where the one before it ends, and the last ends with the file. */
static gnp_status check_cover(const struct gnp_safetensors *file, struct gnp_error *error)
{
	size_t end = 0;
	for (size_t i = 0; i < file->tensor_count; i++) {
		const struct gnp_safetensors_tensor *tensor = &file->tensors[i];
		size_t begin = offset_of(file, tensor);
		if (begin < end)
			return bad_tensor(file, tensor->name, error,
			                  "begins at byte %zu of the data and overlaps \"%.64s\", need %zu",
			                  begin, file->tensors[i - 1].name, end);
		if (begin > end)
			return bad_tensor(file, tensor->name, error,
			                  "begins at byte %zu of the data and leaves a hole, need %zu", begin, end);
		end = begin + tensor->count * sizeof(float);
	}
	if (end != file->data_size)
		return gnp_safetensors_fail(file->path, error, GNP_INVALID_ARGUMENT,
		                            "got %zu bytes of data, need the %zu of its %zu tensors",
		              file->data_size, end, file->tensor_count);
	return GNP_OK;
}

static gnp_status check_finite(const struct gnp_safetensors *file, struct gnp_error *error)
{
	for (size_t i = 0; i < file->tensor_count; i++) {
		const struct gnp_safetensors_tensor *tensor = &file->tensors[i];
		for (size_t j = 0; j < tensor->count; j++)
			if (!isfinite(tensor->data[j]))
				return bad_tensor(file, tensor->name, error, "value %zu: got %g, need a finite number", j,
				                  (double)tensor->data[j]);
	}
	return GNP_OK;
}

static gnp_status read_tensors(struct gnp_safetensors *file, struct gnp_error *error)
{
	size_t most = json_object_size(file->root);
	const char *name;
	json_t *entry;
	gnp_status status = GNP_OK;
	if (most > GNP_SAFETENSORS_TENSORS_MAX)
		return gnp_safetensors_fail(file->path, error, GNP_INVALID_ARGUMENT, "got %zu tensors, need at most %d", most,
		              GNP_SAFETENSORS_TENSORS_MAX);
	file->tensors = gnp_array_new(most, sizeof *file->tensors);
	if (!file->tensors)
		return gnp_safetensors_no_memory(file->path, most * sizeof *file->tensors, error);
	json_object_foreach(file->root, name, entry)
	{
		if (strcmp(name, metadata_key) == 0)
			status = read_metadata(file, entry, error);
		else
			status = read_tensor(file, name, entry, &file->tensors[file->tensor_count++], error);
		if (status != GNP_OK)
			return status;
	}
	qsort(file->tensors, file->tensor_count, sizeof *file->tensors, by_place);
	status = check_cover(file, error);
	return status == GNP_OK ? check_finite(file, error) : status;
}

gnp_status gnp_safetensors_header_read(struct gnp_safetensors *file, const char *text, size_t size,
                                       struct gnp_error *error)
{
	gnp_status status = parse_header(file, text, size, error);
	return status == GNP_OK ? read_tensors(file, error) : status;
}

void gnp_safetensors_header_free(struct gnp_safetensors *file)
{
	json_decref(file->root);
	free(file->metadata);
}
