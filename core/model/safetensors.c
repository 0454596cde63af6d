#include "core/model/safetensors.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/base/memory.h"
#include "core/model/safetensors_header.h"

_Static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "tensors are used as they lie in the file");

enum { PREFIX = 8 };

gnp_status gnp_safetensors_fail(const char *path, struct gnp_error *error, gnp_status status, const char *format, ...)
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

gnp_status gnp_safetensors_no_memory(const char *path, size_t bytes, struct gnp_error *error)
{
	return gnp_safetensors_fail(path, error, GNP_OUT_OF_MEMORY, "no memory for %zu bytes", bytes);
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
			return gnp_safetensors_fail(input->path, error, GNP_IO, "%s", strerror(errno));
		if (some == 0)
			return gnp_safetensors_fail(input->path, error, GNP_IO,
			                            "ended after %zu bytes while it was read, need %zu", input->at,
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
		return gnp_safetensors_fail(input->path, error, GNP_INVALID_ARGUMENT,
		                            "got %zu bytes, need %d..%d", input->size, PREFIX + 2,
		              GNP_SAFETENSORS_FILE_MAX);
	gnp_status status = take(input, prefix, sizeof prefix, error);
	if (status != GNP_OK)
		return status;
	for (int i = PREFIX; i-- > 0;)
		claimed = claimed << 8 | prefix[i];
	size_t most = input->size - PREFIX < GNP_SAFETENSORS_HEADER_MAX ? input->size - PREFIX : GNP_SAFETENSORS_HEADER_MAX;
	if (claimed < 2 || claimed > most)
		return gnp_safetensors_fail(input->path, error, GNP_INVALID_ARGUMENT,
		                            "header length: got %" PRIu64 " in a file of %zu bytes, need 2..%zu",
		              claimed, input->size, most);
	*length = (size_t)claimed;
	return GNP_OK;
}

/* ---- A file ---- */

/* Header and data each get memory of their own, so that the data is aligned wherever it begins in the file. */
static gnp_status read_input(struct input *input, struct gnp_safetensors *file, struct gnp_error *error)
{
	size_t header_size = 0;
	gnp_status status = take_header_length(input, &header_size, error);
	if (status != GNP_OK)
		return status;
	file->data_size = input->size - PREFIX - header_size;
	char *header = gnp_array_new(PREFIX + header_size, 1);
	file->data = gnp_array_new(file->data_size, 1);
	if (!header || !file->data)
		status = gnp_safetensors_no_memory(input->path, input->size, error);
	for (size_t i = 0; i < PREFIX && header; i++)
		header[i] = (char)((uint64_t)header_size >> 8 * i);
	if (status == GNP_OK)
		status = take(input, header + PREFIX, header_size, error);
	if (status == GNP_OK)
		status = take(input, file->data, file->data_size, error);
	if (status == GNP_OK) {
		gnp_sha256_text((const void *const[]){header, file->data}, (const size_t[]){PREFIX + header_size, file->data_size},
		                2, file->sha256);
		status = gnp_safetensors_header_read(file, header + PREFIX, header_size, error);
	}
	free(header);
	return status;
}

static gnp_status file_create(struct input *input, struct gnp_safetensors **out, struct gnp_error *error)
{
	struct gnp_safetensors *file = gnp_array_zero(1, sizeof *file);
	if (!file || !(file->path = strdup(input->path))) {
		free(file);
		return gnp_safetensors_no_memory(input->path, sizeof *file, error);
	}
	gnp_status status = read_input(input, file, error);
	if (status != GNP_OK) {
		gnp_safetensors_free(file);
		return status;
	}
	*out = file;
	return GNP_OK;
}

gnp_status gnp_safetensors_decode(const char *name, const void *bytes, size_t size, struct gnp_safetensors **out,
                                  struct gnp_error *error)
{
	struct input input = {.path = name, .fd = -1, .bytes = bytes, .size = size};
	return file_create(&input, out, error);
}

gnp_status gnp_safetensors_load(const char *path, struct gnp_safetensors **out, struct gnp_error *error)
{
	struct stat information;
	gnp_status status;
	int fd = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK); /* not to wait for the writer of a named pipe */
	if (fd < 0 || fstat(fd, &information) != 0)
		status = gnp_safetensors_fail(path, error, GNP_IO, "%s", strerror(errno));
	else if (!S_ISREG(information.st_mode))
		status = gnp_safetensors_fail(path, error, GNP_IO, "need a regular file");
	else
		status = file_create(&(struct input){.path = path, .fd = fd, .size = (size_t)information.st_size}, out, error);
	if (fd >= 0)
		close(fd);
	return status;
}

void gnp_safetensors_drop_tensors(struct gnp_safetensors *file)
{
	free(file->tensors);
	free(file->data);
	file->tensors = NULL;
	file->data = NULL;
	file->tensor_count = file->data_size = 0;
}

void gnp_safetensors_free(struct gnp_safetensors *file)
{
	if (!file)
		return;
	gnp_safetensors_drop_tensors(file);
	gnp_safetensors_header_free(file);
	free(file->path);
	free(file);
}

gnp_status gnp_safetensors_refuse(const struct gnp_safetensors *file, struct gnp_error *error, const char *format, ...)
{
	char text[300];
	va_list arguments;
	va_start(arguments, format);
	vsnprintf(text, sizeof text, format, arguments);
	va_end(arguments);
	return gnp_safetensors_fail(file->path, error, GNP_INVALID_ARGUMENT, "%s", text);
}

/* ---- What it holds ---- */

const char *gnp_safetensors_path(const struct gnp_safetensors *file)
{
	return file->path;
}

const char *gnp_safetensors_sha256(const struct gnp_safetensors *file)
{
	return file->sha256;
}

size_t gnp_safetensors_tensor_count(const struct gnp_safetensors *file)
{
	return file->tensor_count;
}

const struct gnp_safetensors_tensor *gnp_safetensors_tensor_at(const struct gnp_safetensors *file, size_t i)
{
	return i < file->tensor_count ? &file->tensors[i] : NULL;
}

const struct gnp_safetensors_tensor *gnp_safetensors_tensor_find(const struct gnp_safetensors *file, const char *name)
{
	for (size_t i = 0; i < file->tensor_count; i++)
		if (strcmp(file->tensors[i].name, name) == 0)
			return &file->tensors[i];
	return NULL;
}

const struct gnp_safetensors_metadata *gnp_safetensors_metadata_at(const struct gnp_safetensors *file, size_t i)
{
	return i < file->metadata_count ? &file->metadata[i] : NULL;
}

const char *gnp_safetensors_metadata_find(const struct gnp_safetensors *file, const char *key)
{
	for (size_t i = 0; i < file->metadata_count; i++)
		if (strcmp(file->metadata[i].key, key) == 0)
			return file->metadata[i].value;
	return NULL;
}
