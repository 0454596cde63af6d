#include "proto/tensor/buffer.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

gnp_status gnp_buffer_reserve(struct gnp_buffer *buffer, size_t more, struct gnp_error *error)
{
	if (more <= buffer->capacity - buffer->size)
		return GNP_OK;
	if (more > SIZE_MAX / 2 - buffer->size)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "buffer: %zu more bytes overflow", more);
	size_t capacity = buffer->capacity + buffer->capacity / 2;
	if (capacity < buffer->size + more)
		capacity = buffer->size + more;
	if (capacity < 256)
		capacity = 256;
	unsigned char *data = realloc(buffer->data, capacity);
	if (!data)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "buffer: no memory for %zu bytes", capacity);
	buffer->data = data;
	buffer->capacity = capacity;
	return GNP_OK;
}

gnp_status gnp_buffer_append(struct gnp_buffer *buffer, const void *data, size_t size, struct gnp_error *error)
{
	if (size == 0)
		return GNP_OK;
	gnp_status status = gnp_buffer_reserve(buffer, size, error);
	if (status != GNP_OK)
		return status;
	memcpy(buffer->data + buffer->size, data, size);
	buffer->size += size;
	return GNP_OK;
}

gnp_status gnp_buffer_vprintf(struct gnp_buffer *buffer, struct gnp_error *error, const char *format, va_list arguments)
{
	va_list again;
	va_copy(again, arguments);
	int length = vsnprintf(NULL, 0, format, again);
	va_end(again);
	if (length < 0) /* the C library takes memory for some numbers */
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "buffer: no memory to format \"%s\"", format);
	gnp_status status = gnp_buffer_reserve(buffer, (size_t)length + 1, error);
	if (status != GNP_OK)
		return status;
	int written = vsnprintf((char *)buffer->data + buffer->size, (size_t)length + 1, format, arguments);
	if (written != length)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "buffer: no memory to format \"%s\"", format);
	buffer->size += (size_t)length;
	return GNP_OK;
}

gnp_status gnp_buffer_printf(struct gnp_buffer *buffer, struct gnp_error *error, const char *format, ...)
{
	va_list arguments;
	va_start(arguments, format);
	gnp_status status = gnp_buffer_vprintf(buffer, error, format, arguments);
	va_end(arguments);
	return status;
}

void gnp_buffer_clear(struct gnp_buffer *buffer)
{
	free(buffer->data);
	*buffer = (struct gnp_buffer){0};
}
