#include "proto/file/content_encoding.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <zlib.h>

enum { WINDOW_GZIP = 15 + 16, WINDOW_ZLIB = 15, WINDOW_RAW = -15 };

/* "deflate" means the zlib format; some clients send the bare stream. */
static int deflate_window(const unsigned char *body, size_t size)
{
	bool zlib = size >= 2 && (body[0] & 15) == 8 && (body[0] * 256 + body[1]) % 31 == 0;
	return zlib ? WINDOW_ZLIB : WINDOW_RAW;
}

/* zlib counts in unsigned int. */
static unsigned int bounded(size_t size)
{
	return size < 1u << 30 ? (unsigned int)size : 1u << 30;
}

/* Room for more output: twice as much, never past max_size. *full: max_size is reached. */
static gnp_status make_room(struct gnp_buffer *buffer, size_t max_size, bool *full, struct gnp_error *error)
{
	*full = buffer->size >= max_size;
	if (*full || buffer->size < buffer->capacity)
		return GNP_OK;
	size_t capacity = buffer->capacity ? buffer->capacity : 32768;
	capacity = capacity < max_size / 2 ? 2 * capacity : max_size;
	unsigned char *data = realloc(buffer->data, capacity);
	if (!data)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "body: no memory for %zu bytes", capacity);
	buffer->data = data;
	buffer->capacity = capacity;
	return GNP_OK;
}

/* A gzip body may be several members one after another, as parallel compressors and `cat` make them. */
static bool begin_member(z_stream *stream, int window, size_t left)
{
	return window == WINDOW_GZIP && left >= 2 && stream->next_in[0] == 0x1f && stream->next_in[1] == 0x8b &&
	       inflateReset(stream) == Z_OK;
}

static gnp_status inflate_all(z_stream *stream, int window, const unsigned char *body, size_t size, size_t max_size,
                              struct gnp_buffer *buffer, struct gnp_error *error)
{
	int result = Z_OK;
	stream->next_in = (unsigned char *)(uintptr_t)body;
	while (result != Z_STREAM_END) {
		unsigned char beyond;
		bool full;
		gnp_status status = make_room(buffer, max_size, &full, error);
		if (status != GNP_OK)
			return status;
		size_t room = full ? 1 : buffer->capacity - buffer->size;
		unsigned char *target = full ? &beyond : buffer->data + buffer->size;
		stream->next_out = target;
		stream->avail_out = bounded(room);
		stream->avail_in = bounded((size_t)(body + size - stream->next_in));
		result = inflate(stream, Z_NO_FLUSH);
		size_t made = (size_t)(stream->next_out - target);
		if (full && made)
			return gnp_error_set(error, GNP_TOO_LARGE, "body: decompresses to more than %zu bytes", max_size);
		buffer->size += made;
		if (result == Z_MEM_ERROR)
			return gnp_error_set(error, GNP_OUT_OF_MEMORY, "body: no memory to decompress it");
		if (result == Z_BUF_ERROR && !made)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "body: the compressed data is truncated");
		if (result != Z_OK && result != Z_STREAM_END && result != Z_BUF_ERROR)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "body: corrupt compressed data (%s)",
			                     stream->msg ? stream->msg : "no preset dictionary is known");
		if (result == Z_STREAM_END && begin_member(stream, window, (size_t)(body + size - stream->next_in)))
			result = Z_OK;
	}
	size_t left = (size_t)(body + size - stream->next_in);
	if (left)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "body: %zu bytes after the end of the compressed data", left);
	return GNP_OK;
}

gnp_status gnp_content_decode(const char *encoding, const unsigned char *body, size_t size, size_t max_size,
                              struct gnp_buffer *out, struct gnp_error *error)
{
	int window;
	if (strcasecmp(encoding, "gzip") == 0 || strcasecmp(encoding, "x-gzip") == 0)
		window = WINDOW_GZIP;
	else if (strcasecmp(encoding, "deflate") == 0)
		window = deflate_window(body, size);
	else
		return gnp_error_set(error, GNP_UNSUPPORTED_MEDIA, "Content-Encoding: got \"%.40s\", need gzip or deflate", encoding);
	z_stream stream = {0};
	if (inflateInit2(&stream, window) != Z_OK)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "body: no memory to decompress it");
	struct gnp_buffer made = {0};
	gnp_status status = inflate_all(&stream, window, body, size, max_size, &made, error);
	inflateEnd(&stream);
	if (status == GNP_OK)
		*out = made;
	else
		gnp_buffer_clear(&made);
	return status;
}
