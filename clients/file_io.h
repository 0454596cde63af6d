/* Reads and writes whole files. "-" is standard input or output. */
#ifndef GNP_CLIENTS_FILE_IO_H
#define GNP_CLIENTS_FILE_IO_H

#include <stdbool.h>
#include <stddef.h>

#include "core/base/status.h"
#include "proto/format/format.h"
#include "proto/tensor/message.h"
#include "proto/tensor/tensor.h"

/* Reads all of a file. GNP_IO naming the file; *out is unchanged on failure, else cleared by the caller. */
gnp_status gnp_file_read(const char *path, struct gnp_buffer *out, struct gnp_error *error);

/* Writes a file as a whole or not at all: a temporary file beside it is renamed over it once it is complete.
 * What is there and is no regular file (a device, a pipe) is written to directly. */
gnp_status gnp_file_write(const char *path, const void *data, size_t size, struct gnp_error *error);

/* The format by its name when given (not NULL), else by the path's extension, else by the content's first bytes (in) or
 * PLY on standard output (out). GNP_INVALID_ARGUMENT naming the usable ones when none tells, or when it cannot be read /
 * written. */
gnp_status gnp_file_format_in(const char *name, const char *path, const struct gnp_buffer *content,
                              const struct gnp_format **format, struct gnp_error *error);
gnp_status gnp_file_format_out(const char *name, const char *path, const struct gnp_format **format, struct gnp_error *error);

/* The same of a format that need not be one that can be read. False when none is known. */
bool gnp_file_format_any(const char *name, const char *path, const struct gnp_buffer *content, const struct gnp_format **format);

/* Decodes every field of a file that was read from path. Tensors may borrow from *content. */
gnp_status gnp_file_unpack(const char *path, const char *format_name, const struct gnp_buffer *content, struct gnp_tensors *tensors,
                           struct gnp_error *error);

/* Reads and decodes every field of a file. Tensors may borrow from *content; both are cleared by the caller in any case. */
gnp_status gnp_file_load(const char *path, const char *format_name, struct gnp_buffer *content,
                         struct gnp_tensors *tensors, struct gnp_error *error);

/* Encodes and writes. */
gnp_status gnp_file_save(const char *path, const struct gnp_format *format, const struct gnp_tensors *tensors,
                         const struct gnp_values *comments, struct gnp_error *error);

#endif
