#include "core/model/safetensors_write.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/base/memory.h"

enum { PREFIX = 8, ALIGNMENT = 8 };

/* A JSON string; bytes that are no UTF-8 stay, for the reader to refuse. */
static void put_string(FILE *out, const char *text)
{
	fputc('"', out);
	for (; *text; text++) {
		if (*text == '"' || *text == '\\')
			fputc('\\', out);
		if ((unsigned char)*text < ' ')
			fprintf(out, "\\u%04x", (unsigned)*text);
		else
			fputc(*text, out);
	}
	fputc('"', out);
}

static int by_key(const void *a, const void *b)
{
	const struct gnp_safetensors_metadata *left = a, *right = b;
	return strcmp(left->key, right->key);
}

static bool put_metadata(FILE *out, const struct gnp_safetensors_source *source)
{
	size_t count = source->metadata_count;
	struct gnp_safetensors_metadata *sorted = gnp_array_new(count, sizeof *sorted);
	if (!sorted)
		return false;
	for (size_t i = 0; i < count; i++)
		sorted[i] = source->metadata[i];
	qsort(sorted, count, sizeof *sorted, by_key);
	fputs("\"__metadata__\":{", out);
	for (size_t i = 0; i < count; i++) {
		fputs(i ? "," : "", out);
		put_string(out, sorted[i].key);
		fputc(':', out);
		put_string(out, sorted[i].value);
	}
	fputc('}', out);
	free(sorted);
	return true;
}

static void put_tensor(FILE *out, const struct gnp_safetensors_tensor *tensor, size_t begin, size_t end)
{
	fputc(',', out);
	put_string(out, tensor->name);
	fputs(":{\"dtype\":\"F32\",\"shape\":[", out);
	for (size_t d = 0; d < tensor->rank; d++)
		fprintf(out, "%s%zu", d ? "," : "", tensor->shape[d]);
	fprintf(out, "],\"data_offsets\":[%zu,%zu]}", begin, end);
}

/* The bytes a tensor's shape asks for; false when that is not a size a file may have. */
static bool tensor_bytes(const struct gnp_safetensors_tensor *tensor, size_t *bytes)
{
	*bytes = sizeof(float);
	if (tensor->rank > GNP_SAFETENSORS_RANK_MAX)
		return false;
	for (size_t d = 0; d < tensor->rank; d++)
		if (!gnp_size_multiply(*bytes, tensor->shape[d], bytes))
			return false;
	return *bytes <= GNP_SAFETENSORS_FILE_MAX;
}

static gnp_status check_sizes(const char *path, const struct gnp_safetensors_source *source, size_t *data_size,
                              struct gnp_error *error)
{
	size_t total = 0, bytes;
	for (size_t i = 0; i < source->tensor_count; i++) {
		const struct gnp_safetensors_tensor *tensor = &source->tensors[i];
		if (!tensor_bytes(tensor, &bytes) || bytes > GNP_SAFETENSORS_FILE_MAX - total)
			return gnp_error_set(error, GNP_TOO_LARGE,
			                     "%.120s: tensor \"%.64s\": rank %zu or its bytes with those before it: "
			                     "need at most %d and %d", path, tensor->name, tensor->rank, GNP_SAFETENSORS_RANK_MAX,
			                     GNP_SAFETENSORS_FILE_MAX);
		total += bytes;
	}
	*data_size = total;
	return GNP_OK;
}

/* Header and padding; NULL without memory. */
static char *make_header(const struct gnp_safetensors_source *source, size_t *size)
{
	char *text = NULL;
	size_t begin = 0, bytes;
	FILE *out = open_memstream(&text, size);
	if (!out)
		return NULL;
	fputc('{', out);
	bool whole = put_metadata(out, source);
	for (size_t i = 0; i < source->tensor_count; i++, begin += bytes) {
		tensor_bytes(&source->tensors[i], &bytes);
		put_tensor(out, &source->tensors[i], begin, begin + bytes);
	}
	fputc('}', out);
	while (ftell(out) % ALIGNMENT != 0)
		fputc(' ', out);
	whole = !ferror(out) && whole;
	if (fclose(out) == 0 && whole)
		return text;
	free(text);
	return NULL;
}

static unsigned char *assemble(const struct gnp_safetensors_source *source, size_t data_size, size_t *size)
{
	size_t header_size = 0, bytes;
	char *header = make_header(source, &header_size);
	unsigned char *file = header ? gnp_array_new(PREFIX + header_size + data_size, 1) : NULL;
	if (file) {
		unsigned char *at = file + PREFIX + header_size;
		for (int i = 0; i < PREFIX; i++)
			file[i] = (unsigned char)((uint64_t)header_size >> 8 * i);
		memcpy(file + PREFIX, header, header_size);
		for (size_t i = 0; i < source->tensor_count; i++, at += bytes) {
			tensor_bytes(&source->tensors[i], &bytes);
			if (bytes)
				memcpy(at, source->tensors[i].data, bytes);
		}
		*size = PREFIX + header_size + data_size;
	}
	free(header);
	return file;
}

gnp_status gnp_safetensors_encode(const char *name, const struct gnp_safetensors_source *source, void **bytes,
                                  size_t *size, struct gnp_error *error)
{
	struct gnp_safetensors *check = NULL;
	size_t data_size = 0, file_size = 0;
	gnp_status status = check_sizes(name, source, &data_size, error);
	if (status != GNP_OK)
		return status;
	unsigned char *file = assemble(source, data_size, &file_size);
	if (!file)
		return gnp_no_memory(name, data_size, "bytes to write", error);
	status = gnp_safetensors_decode(name, file, file_size, &check, error);
	gnp_safetensors_free(check);
	if (status != GNP_OK) {
		free(file);
		return status;
	}
	*bytes = file;
	*size = file_size;
	return GNP_OK;
}

static bool write_synced(int fd, const char *bytes, size_t size)
{
	for (size_t done = 0; done < size;) {
		ssize_t some = write(fd, bytes + done, size - done);
		if (some < 0 && errno != EINTR)
			return false;
		done += some > 0 ? (size_t)some : 0;
	}
	return fsync(fd) == 0;
}

/* The new name is in the folder. Not every file system can sync one; the file is whole in any case. */
static void sync_folder(const char *path)
{
	const char *slash = strrchr(path, '/');
	char *folder = slash ? strndup(path, (size_t)(slash - path) + 1) : strdup(".");
	int fd = folder ? open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC) : -1;
	if (fd >= 0) {
		fsync(fd);
		close(fd);
	}
	free(folder);
}

static gnp_status replace_file(const char *path, const void *bytes, size_t size, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	char *beside;
	if (asprintf(&beside, "%s.new", path) < 0)
		return gnp_no_memory(path, size, "bytes to write", error);
	int fd = open(beside, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
	bool written = fd >= 0 && write_synced(fd, bytes, size);
	if (fd >= 0)
		written = close(fd) == 0 && written;
	if (!written || rename(beside, path) != 0) {
		status = gnp_error_set(error, GNP_IO, "%.120s: %s", beside, strerror(errno));
		unlink(beside);
	} else {
		sync_folder(path);
	}
	free(beside);
	return status;
}

gnp_status gnp_safetensors_save(const char *path, const struct gnp_safetensors_source *source, struct gnp_error *error)
{
	void *bytes;
	size_t size;
	gnp_status status = gnp_safetensors_encode(path, source, &bytes, &size, error);
	if (status != GNP_OK)
		return status;
	status = replace_file(path, bytes, size, error);
	free(bytes);
	return status;
}
