#include "core/network/safetensors.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <jansson.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/base/memory.h"
#include "core/base/headroom.h"
#include "core/base/sha256.h"

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "tensors are used as they lie in the file");

static const char metadata_key[] = "__metadata__";
enum { PREFIX = 8, NESTING_MAX = 4, SHOWN = 60 };

struct gnp_safetensors {
	char *path;
	char sha256[GNP_SHA256_TEXT];
	json_t *root; /* the header; owns every string below */
	unsigned char *data;
	size_t data_size;
	struct gnp_safetensors_tensor *tensors;
	size_t tensor_count;
	struct gnp_safetensors_metadata *metadata;
	size_t metadata_count;
};

/* "FILE: TEXT"; of a long path the end, which tells more. */
static gnp_status refuse(const char *path, struct gnp_error *error, gnp_status status, const char *format, ...)
	__attribute__((format(printf, 4, 5)));

static gnp_status refuse(const char *path, struct gnp_error *error, gnp_status status, const char *format, ...)
{
	enum { PATH_SHOWN = 100 };
	size_t length = strlen(path);
	bool cut = length > PATH_SHOWN;
	char text[300];
	va_list arguments;
	va_start(arguments, format);
	vsnprintf(text, sizeof text, format, arguments);
	va_end(arguments);
	return gnp_error_set(error, status, "%s%s: %s", cut ? "..." : "", path + (cut ? length - PATH_SHOWN : 0), text);
}

static gnp_status bad_tensor(const struct gnp_safetensors *weights, const char *name, struct gnp_error *error,
                             const char *format, ...) __attribute__((format(printf, 4, 5)));

static gnp_status bad_tensor(const struct gnp_safetensors *weights, const char *name, struct gnp_error *error,
                             const char *format, ...)
{
	char text[220];
	va_list arguments;
	va_start(arguments, format);
	vsnprintf(text, sizeof text, format, arguments);
	va_end(arguments);
	return refuse(weights->path, error, GNP_INVALID_ARGUMENT, "tensor \"%.64s\": %s", name, text);
}

static gnp_status no_memory(const char *path, size_t bytes, struct gnp_error *error)
{
	return refuse(path, error, GNP_OUT_OF_MEMORY, "no memory for %zu bytes", bytes);
}

/* ---- The bytes: an open file, or memory ---- */

struct input {
	const char *path;
	int fd; /* -1: memory */
	const unsigned char *bytes;
	size_t size, at;
};

static gnp_status take(struct input *input, void *target, size_t size, struct gnp_error *error)
{
	if (input->fd < 0) {
		memcpy(target, input->bytes + input->at, size);
		input->at += size;
		return GNP_OK;
	}
	for (size_t done = 0; done < size;) {
		ssize_t some = read(input->fd, (char *)target + done, size - done);
		if (some < 0 && errno == EINTR)
			continue;
		if (some < 0)
			return refuse(input->path, error, GNP_IO, "%s", strerror(errno));
		if (some == 0)
			return refuse(input->path, error, GNP_IO, "ended after %zu bytes while it was read, need %zu", input->at,
			              input->size);
		done += (size_t)some;
		input->at += (size_t)some;
	}
	return GNP_OK;
}

/* Nothing is allocated by a length that the size of the file does not cover. */
static gnp_status take_header_length(struct input *input, size_t *length, struct gnp_error *error)
{
	unsigned char prefix[PREFIX];
	uint64_t claimed = 0;
	if (input->size < PREFIX + 2 || input->size > GNP_SAFETENSORS_FILE_MAX)
		return refuse(input->path, error, GNP_INVALID_ARGUMENT, "got %zu bytes, need %d..%d", input->size, PREFIX + 2,
		              GNP_SAFETENSORS_FILE_MAX);
	gnp_status status = take(input, prefix, sizeof prefix, error);
	if (status != GNP_OK)
		return status;
	for (int i = PREFIX; i-- > 0;)
		claimed = claimed << 8 | prefix[i];
	size_t most = input->size - PREFIX < GNP_SAFETENSORS_HEADER_MAX ? input->size - PREFIX : GNP_SAFETENSORS_HEADER_MAX;
	if (claimed < 2 || claimed > most)
		return refuse(input->path, error, GNP_INVALID_ARGUMENT, "header length: got %" PRIu64 " in a file of %zu bytes, need 2..%zu",
		              claimed, input->size, most);
	*length = (size_t)claimed;
	return GNP_OK;
}

/* ---- The header ---- */

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
		return refuse(weights->path, error, GNP_INVALID_ARGUMENT, "header: got byte 0x%02x first, need {",
		              (unsigned char)text[0]);
	if (nests_too_deep(text, size))
		return refuse(weights->path, error, GNP_INVALID_ARGUMENT, "header: nested deeper than %d, need a table of tensors",
		              NESTING_MAX);
	/* jansson does not bear to run out of memory: it fails an assertion. */
	if (gnp_headroom_need(weights->path, HEADER_COST * size, error) != GNP_OK)
		return GNP_OUT_OF_MEMORY;
	weights->root = json_loadb(text, size, JSON_REJECT_DUPLICATES, &fault);
	if (!weights->root)
		return refuse(weights->path, error, GNP_INVALID_ARGUMENT, "header: not strict JSON at byte %d: %.120s",
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
	return refuse(path, error, GNP_INVALID_ARGUMENT, "%s name \"%.64s\" of %zu bytes: need 1..%d without control characters",
	              what, name, strlen(name), GNP_SAFETENSORS_NAME_MAX);
}

static int by_key(const void *a, const void *b)
{
	const struct gnp_safetensors_metadata *left = a, *right = b;
	return strcmp(left->key, right->key);
}

static gnp_status read_metadata(struct gnp_safetensors *weights, const json_t *object, struct gnp_error *error)
{
	const char *key;
	json_t *value;
	if (!json_is_object(object))
		return refuse(weights->path, error, GNP_INVALID_ARGUMENT, "%s: need an object of strings", metadata_key);
	weights->metadata = gnp_array_new(json_object_size(object), sizeof *weights->metadata);
	if (!weights->metadata)
		return no_memory(weights->path, json_object_size(object) * sizeof *weights->metadata, error);
	json_object_foreach((json_t *)object, key, value)
	{
		if (!name_fits(key))
			return bad_name(weights->path, metadata_key, key, error);
		if (!json_is_string(value))
			return refuse(weights->path, error, GNP_INVALID_ARGUMENT, "%s: \"%.64s\" is no string, need one", metadata_key, key);
		weights->metadata[weights->metadata_count++] = (struct gnp_safetensors_metadata){key, json_string_value(value)};
	}
	qsort(weights->metadata, weights->metadata_count, sizeof *weights->metadata, by_key);
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

static gnp_status read_shape(const struct gnp_safetensors *weights, const json_t *shape, struct gnp_safetensors_tensor *tensor,
                             size_t *bytes, struct gnp_error *error)
{
	char shown[SHOWN + 1];
	size_t rank = json_array_size(shape), count = 1;
	bool fits = json_is_array(shape) && rank <= GNP_SAFETENSORS_RANK_MAX;
	for (size_t d = 0; d < rank && fits; d++)
		fits = read_size(json_array_get(shape, d), &tensor->shape[d]) && tensor->shape[d] > 0;
	if (!fits)
		return bad_tensor(weights, tensor->name, error, "shape: got %s, need at most %d integers of at least 1",
		                  show(shape, shown), GNP_SAFETENSORS_RANK_MAX);
	for (size_t d = 0; d < rank && fits; d++)
		fits = gnp_size_multiply(count, tensor->shape[d], &count);
	if (!fits || !gnp_size_multiply(count, sizeof(float), bytes) || *bytes > weights->data_size)
		return bad_tensor(weights, tensor->name, error, "shape: got %s of 4 bytes each, the file has %zu bytes of data",
		                  show(shape, shown), weights->data_size);
	tensor->rank = rank;
	tensor->count = count;
	return GNP_OK;
}

static gnp_status read_place(const struct gnp_safetensors *weights, const json_t *offsets, size_t bytes,
                             struct gnp_safetensors_tensor *tensor, struct gnp_error *error)
{
	char shown[SHOWN + 1];
	size_t begin, end;
	if (json_array_size(offsets) != 2 || !read_size(json_array_get(offsets, 0), &begin) ||
	    !read_size(json_array_get(offsets, 1), &end) || begin > end || end > weights->data_size)
		return bad_tensor(weights, tensor->name, error, "data_offsets: got %s, need two ascending integers of 0..%zu",
		                  show(offsets, shown), weights->data_size);
	if (end - begin != bytes)
		return bad_tensor(weights, tensor->name, error, "data_offsets: got %zu bytes, need %zu for its shape", end - begin, bytes);
	tensor->data = (const float *)(const void *)(weights->data + begin);
	return GNP_OK;
}

static gnp_status read_tensor(const struct gnp_safetensors *weights, const char *name, const json_t *entry,
                              struct gnp_safetensors_tensor *tensor, struct gnp_error *error)
{
	const json_t *dtype = json_object_get(entry, "dtype");
	char shown[SHOWN + 1];
	const char *key;
	json_t *value;
	size_t bytes;
	*tensor = (struct gnp_safetensors_tensor){.name = name};
	if (!name_fits(name))
		return bad_name(weights->path, "tensor", name, error);
	json_object_foreach((json_t *)entry, key, value)
	{
		if (strcmp(key, "dtype") != 0 && strcmp(key, "shape") != 0 && strcmp(key, "data_offsets") != 0)
			return bad_tensor(weights, name, error, "unknown key \"%.40s\", need dtype, shape, data_offsets", key);
	}
	if (!json_is_string(dtype) || strcmp(json_string_value(dtype), "F32") != 0)
		return bad_tensor(weights, name, error, "dtype: got %s, need \"F32\"", show(dtype, shown));
	gnp_status status = read_shape(weights, json_object_get(entry, "shape"), tensor, &bytes, error);
	return status == GNP_OK ? read_place(weights, json_object_get(entry, "data_offsets"), bytes, tensor, error) : status;
}

static int by_place(const void *a, const void *b)
{
	const struct gnp_safetensors_tensor *left = a, *right = b;
	if (left->data != right->data)
		return left->data < right->data ? -1 : 1;
	return strcmp(left->name, right->name);
}

static size_t offset_of(const struct gnp_safetensors *weights, const struct gnp_safetensors_tensor *tensor)
{
	return (size_t)((const unsigned char *)(const void *)tensor->data - weights->data);
}

/* Each tensor begins where the one before it ends, and the last ends with the file. */
static gnp_status check_cover(const struct gnp_safetensors *weights, struct gnp_error *error)
{
	size_t end = 0;
	for (size_t i = 0; i < weights->tensor_count; i++) {
		const struct gnp_safetensors_tensor *tensor = &weights->tensors[i];
		size_t begin = offset_of(weights, tensor);
		if (begin < end)
			return bad_tensor(weights, tensor->name, error, "begins at byte %zu of the data and overlaps \"%.64s\", need %zu",
			                  begin, weights->tensors[i - 1].name, end);
		if (begin > end)
			return bad_tensor(weights, tensor->name, error, "begins at byte %zu of the data and leaves a hole, need %zu", begin, end);
		end = begin + tensor->count * sizeof(float);
	}
	if (end != weights->data_size)
		return refuse(weights->path, error, GNP_INVALID_ARGUMENT, "got %zu bytes of data, need the %zu of its %zu tensors",
		              weights->data_size, end, weights->tensor_count);
	return GNP_OK;
}

static gnp_status check_finite(const struct gnp_safetensors *weights, struct gnp_error *error)
{
	for (size_t i = 0; i < weights->tensor_count; i++) {
		const struct gnp_safetensors_tensor *tensor = &weights->tensors[i];
		for (size_t j = 0; j < tensor->count; j++)
			if (!isfinite(tensor->data[j]))
				return bad_tensor(weights, tensor->name, error, "value %zu: got %g, need a finite number", j,
				                  (double)tensor->data[j]);
	}
	return GNP_OK;
}

static gnp_status read_tensors(struct gnp_safetensors *weights, struct gnp_error *error)
{
	size_t most = json_object_size(weights->root);
	const char *name;
	json_t *entry;
	gnp_status status = GNP_OK;
	if (most > GNP_SAFETENSORS_TENSORS_MAX)
		return refuse(weights->path, error, GNP_INVALID_ARGUMENT, "got %zu tensors, need at most %d", most,
		              GNP_SAFETENSORS_TENSORS_MAX);
	weights->tensors = gnp_array_new(most, sizeof *weights->tensors);
	if (!weights->tensors)
		return no_memory(weights->path, most * sizeof *weights->tensors, error);
	json_object_foreach(weights->root, name, entry)
	{
		if (strcmp(name, metadata_key) == 0)
			status = read_metadata(weights, entry, error);
		else
			status = read_tensor(weights, name, entry, &weights->tensors[weights->tensor_count++], error);
		if (status != GNP_OK)
			return status;
	}
	qsort(weights->tensors, weights->tensor_count, sizeof *weights->tensors, by_place);
	status = check_cover(weights, error);
	return status == GNP_OK ? check_finite(weights, error) : status;
}

/* Header and data each get memory of their own, so that the data is aligned wherever it begins in the file. */
static gnp_status read_input(struct input *input, struct gnp_safetensors *weights, struct gnp_error *error)
{
	size_t header_size = 0;
	gnp_status status = take_header_length(input, &header_size, error);
	if (status != GNP_OK)
		return status;
	weights->data_size = input->size - PREFIX - header_size;
	char *header = gnp_array_new(PREFIX + header_size, 1);
	weights->data = gnp_array_new(weights->data_size, 1);
	if (!header || !weights->data)
		status = no_memory(input->path, input->size, error);
	for (size_t i = 0; i < PREFIX && header; i++)
		header[i] = (char)((uint64_t)header_size >> 8 * i);
	if (status == GNP_OK)
		status = take(input, header + PREFIX, header_size, error);
	if (status == GNP_OK)
		status = take(input, weights->data, weights->data_size, error);
	if (status == GNP_OK) {
		gnp_sha256_text((const void *const[]){header, weights->data}, (const size_t[]){PREFIX + header_size, weights->data_size},
		                2, weights->sha256);
		status = parse_header(weights, header + PREFIX, header_size, error);
	}
	free(header);
	return status == GNP_OK ? read_tensors(weights, error) : status;
}

static gnp_status weights_create(struct input *input, struct gnp_safetensors **out, struct gnp_error *error)
{
	struct gnp_safetensors *weights = gnp_array_zero(1, sizeof *weights);
	if (!weights || !(weights->path = strdup(input->path))) {
		free(weights);
		return no_memory(input->path, sizeof *weights, error);
	}
	gnp_status status = read_input(input, weights, error);
	if (status != GNP_OK) {
		gnp_safetensors_free(weights);
		return status;
	}
	*out = weights;
	return GNP_OK;
}

gnp_status gnp_safetensors_decode(const char *name, const void *bytes, size_t size, struct gnp_safetensors **out,
                              struct gnp_error *error)
{
	struct input input = {.path = name, .fd = -1, .bytes = bytes, .size = size};
	return weights_create(&input, out, error);
}

gnp_status gnp_safetensors_load(const char *path, struct gnp_safetensors **out, struct gnp_error *error)
{
	struct stat information;
	gnp_status status;
	int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK); /* not to wait for the writer of a named pipe */
	if (fd < 0 || fstat(fd, &information) != 0)
		status = refuse(path, error, GNP_IO, "%s", strerror(errno));
	else if (!S_ISREG(information.st_mode))
		status = refuse(path, error, GNP_IO, "need a regular file");
	else
		status = weights_create(&(struct input){.path = path, .fd = fd, .size = (size_t)information.st_size}, out, error);
	if (fd >= 0)
		close(fd);
	return status;
}

void gnp_safetensors_drop_tensors(struct gnp_safetensors *weights)
{
	free(weights->tensors);
	free(weights->data);
	weights->tensors = NULL;
	weights->data = NULL;
	weights->tensor_count = weights->data_size = 0;
}

void gnp_safetensors_free(struct gnp_safetensors *weights)
{
	if (!weights)
		return;
	gnp_safetensors_drop_tensors(weights);
	json_decref(weights->root);
	free(weights->metadata);
	free(weights->path);
	free(weights);
}

gnp_status gnp_safetensors_refuse(const struct gnp_safetensors *weights, struct gnp_error *error, const char *format, ...)
{
	char text[300];
	va_list arguments;
	va_start(arguments, format);
	vsnprintf(text, sizeof text, format, arguments);
	va_end(arguments);
	return refuse(weights->path, error, GNP_INVALID_ARGUMENT, "%s", text);
}

/* ---- What it holds ---- */

const char *gnp_safetensors_path(const struct gnp_safetensors *weights)
{
	return weights->path;
}

const char *gnp_safetensors_sha256(const struct gnp_safetensors *weights)
{
	return weights->sha256;
}

size_t gnp_safetensors_tensor_count(const struct gnp_safetensors *weights)
{
	return weights->tensor_count;
}

const struct gnp_safetensors_tensor *gnp_safetensors_tensor_at(const struct gnp_safetensors *weights, size_t i)
{
	return i < weights->tensor_count ? &weights->tensors[i] : NULL;
}

const struct gnp_safetensors_tensor *gnp_safetensors_tensor_find(const struct gnp_safetensors *weights, const char *name)
{
	for (size_t i = 0; i < weights->tensor_count; i++)
		if (strcmp(weights->tensors[i].name, name) == 0)
			return &weights->tensors[i];
	return NULL;
}

const struct gnp_safetensors_metadata *gnp_safetensors_metadata_at(const struct gnp_safetensors *weights, size_t i)
{
	return i < weights->metadata_count ? &weights->metadata[i] : NULL;
}

const char *gnp_safetensors_metadata_find(const struct gnp_safetensors *weights, const char *key)
{
	for (size_t i = 0; i < weights->metadata_count; i++)
		if (strcmp(weights->metadata[i].key, key) == 0)
			return weights->metadata[i].value;
	return NULL;
}
