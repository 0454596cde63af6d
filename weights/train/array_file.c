#include "weights/train/array_file.h"

#include <assert.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "clients/file_io.h"
#include "core/base/memory.h"
#include "core/base/sha256.h"

static const char MARK[] = " sha256 ";

/* Bytes before the arrays: title, mark, digest and the end of the line. */
static size_t line_size(const char *title)
{
	return strlen(title) + sizeof MARK - 1 + GNP_SHA256_TEXT;
}

size_t gnp_array_file_size(const char *title, const struct gnp_array_piece *pieces, size_t count)
{
	size_t size = line_size(title);
	for (size_t i = 0; i < count; i++)
		size += pieces[i].size;
	return size;
}

static void digest_of(const struct gnp_array_piece *pieces, size_t count, char text[GNP_SHA256_TEXT])
{
	const void *data[GNP_ARRAY_FILE_PIECES];
	size_t size[GNP_ARRAY_FILE_PIECES];
	assert(count <= GNP_ARRAY_FILE_PIECES);
	for (size_t i = 0; i < count; i++) {
		data[i] = pieces[i].data;
		size[i] = pieces[i].size;
	}
	gnp_sha256_text(data, size, count, text);
}

gnp_status gnp_array_file_write(const char *path, const char *title, const struct gnp_array_piece *pieces, size_t count,
                                struct gnp_error *error)
{
	char digest[GNP_SHA256_TEXT];
	size_t size = gnp_array_file_size(title, pieces, count), used = line_size(title);
	char *file = gnp_array_new(size, 1);
	assert(strlen(title) <= GNP_ARRAY_FILE_TITLE);
	if (!file)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "%s: no memory for %zu bytes", path, size);
	digest_of(pieces, count, digest);
	snprintf(file, used, "%s%s%s", title, MARK, digest);
	file[used - 1] = '\n';
	for (size_t i = 0; i < count; i++) {
		memcpy(file + used, pieces[i].data, pieces[i].size);
		used += pieces[i].size;
	}
	gnp_status status = gnp_file_write(path, file, size, error);
	free(file);
	return status;
}

static gnp_status take(const char *path, const struct gnp_buffer *file, const char *title, const struct gnp_array_piece *pieces,
                       size_t count, struct gnp_error *error)
{
	char digest[GNP_SHA256_TEXT];
	size_t size = gnp_array_file_size(title, pieces, count), used = line_size(title), length = strlen(title);
	if (file->size < length + 1 || memcmp(file->data, title, length) != 0 || file->data[length] != MARK[0])
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: it is no file of \"%s\"", path, title);
	if (file->size != size)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: got %zu bytes, need %zu", path, file->size, size);
	const unsigned char *found = file->data + used - GNP_SHA256_TEXT, *from = file->data + used;
	for (size_t i = 0; i < count; from += pieces[i].size, i++)
		memcpy(pieces[i].data, from, pieces[i].size);
	digest_of(pieces, count, digest);
	if (memcmp(found, digest, GNP_SHA256_TEXT - 1) != 0)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: it is damaged, its digest does not hold", path);
	return GNP_OK;
}

gnp_status gnp_array_file_read(const char *path, const char *title, const struct gnp_array_piece *pieces, size_t count,
                               struct gnp_error *error)
{
	struct gnp_buffer file = {0};
	gnp_status status = gnp_file_read(path, &file, error);
	if (status == GNP_OK)
		status = take(path, &file, title, pieces, count, error);
	gnp_buffer_clear(&file);
	return status;
}
