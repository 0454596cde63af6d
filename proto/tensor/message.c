#include "proto/tensor/message.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"

static gnp_status add(struct gnp_values *values, struct gnp_value value, const char *name, const char *string,
                      struct gnp_error *error)
{
	if (values->count == values->capacity) {
		size_t capacity = values->capacity ? 2 * values->capacity : 8, bytes;
		struct gnp_value *items = NULL;
		if (gnp_size_multiply(capacity, sizeof *items, &bytes))
			items = realloc(values->items, bytes);
		if (!items)
			return gnp_error_set(error, GNP_OUT_OF_MEMORY, "parameters: no memory for %zu", capacity);
		values->items = items;
		values->capacity = capacity;
	}
	value.name = strdup(name);
	value.string = string ? strdup(string) : NULL;
	if (!value.name || (string && !value.string)) {
		free(value.name);
		free(value.string);
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "parameters: no memory for \"%.40s\"", name);
	}
	values->items[values->count++] = value;
	return GNP_OK;
}

gnp_status gnp_values_add_string(struct gnp_values *values, const char *name, const char *string, struct gnp_error *error)
{
	return add(values, (struct gnp_value){.type = GNP_VALUE_STRING}, name, string, error);
}

gnp_status gnp_values_add_integer(struct gnp_values *values, const char *name, int64_t integer, struct gnp_error *error)
{
	return add(values, (struct gnp_value){.type = GNP_VALUE_INTEGER, .integer = integer}, name, NULL, error);
}

gnp_status gnp_values_add_number(struct gnp_values *values, const char *name, double number, struct gnp_error *error)
{
	return add(values, (struct gnp_value){.type = GNP_VALUE_NUMBER, .number = number}, name, NULL, error);
}

gnp_status gnp_values_add_bool(struct gnp_values *values, const char *name, bool boolean, struct gnp_error *error)
{
	return add(values, (struct gnp_value){.type = GNP_VALUE_BOOL, .boolean = boolean}, name, NULL, error);
}

const struct gnp_value *gnp_values_find(const struct gnp_values *values, const char *name)
{
	for (size_t i = 0; i < values->count; i++) {
		if (strcmp(values->items[i].name, name) == 0)
			return &values->items[i];
	}
	return NULL;
}

void gnp_values_clear(struct gnp_values *values)
{
	for (size_t i = 0; i < values->count; i++) {
		free(values->items[i].name);
		free(values->items[i].string);
	}
	free(values->items);
	*values = (struct gnp_values){0};
}

void gnp_request_clear(struct gnp_request *request)
{
	free(request->id);
	gnp_values_clear(&request->parameters);
	gnp_tensors_clear(&request->inputs);
	free(request->outputs);
	*request = (struct gnp_request){0};
}

void gnp_response_clear(struct gnp_response *response)
{
	gnp_tensors_clear(&response->outputs);
	gnp_values_clear(&response->parameters);
}

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

gnp_status gnp_buffer_printf(struct gnp_buffer *buffer, struct gnp_error *error, const char *format, ...)
{
	va_list arguments;
	va_start(arguments, format);
	int length = vsnprintf(NULL, 0, format, arguments);
	va_end(arguments);
	if (length < 0) /* the C library takes memory for some numbers */
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "buffer: no memory to format \"%s\"", format);
	gnp_status status = gnp_buffer_reserve(buffer, (size_t)length + 1, error);
	if (status != GNP_OK)
		return status;
	va_start(arguments, format);
	int written = vsnprintf((char *)buffer->data + buffer->size, (size_t)length + 1, format, arguments);
	va_end(arguments);
	if (written != length)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "buffer: no memory to format \"%s\"", format);
	buffer->size += (size_t)length;
	return GNP_OK;
}

void gnp_buffer_clear(struct gnp_buffer *buffer)
{
	free(buffer->data);
	*buffer = (struct gnp_buffer){0};
}
