/* A growable array of bytes: what encoders append to. */
#ifndef GNP_PROTO_BUFFER_H
#define GNP_PROTO_BUFFER_H

#include <stdarg.h>
#include <stddef.h>

#include "core/base/status.h"

/* Begins as {0}; freed by gnp_buffer_clear, which leaves {0}. */
struct gnp_buffer {
	unsigned char *data;
	size_t size, capacity;
};

/* Where memory is exhausted these answer GNP_OUT_OF_MEMORY, and the buffer is as it was. error may be NULL. */
gnp_status gnp_buffer_append(struct gnp_buffer *buffer, const void *data, size_t size, struct gnp_error *error);
/* Makes room for `more` bytes beyond size. */
gnp_status gnp_buffer_reserve(struct gnp_buffer *buffer, size_t more, struct gnp_error *error);
/* Appends text without its NUL; one stands behind it, beyond size. */
gnp_status gnp_buffer_printf(struct gnp_buffer *buffer, struct gnp_error *error, const char *format, ...)
	__attribute__((format(printf, 3, 4)));
gnp_status gnp_buffer_vprintf(struct gnp_buffer *buffer, struct gnp_error *error, const char *format, va_list arguments)
	__attribute__((format(printf, 3, 0)));
void gnp_buffer_clear(struct gnp_buffer *buffer);

#endif
