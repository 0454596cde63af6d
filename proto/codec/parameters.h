/* What an answer says of itself as a JSON object: written where a format has no lines for comments, and read back. */
#ifndef GNP_PROTO_PARAMETERS_H
#define GNP_PROTO_PARAMETERS_H

#include <stddef.h>

#include "core/base/status.h"
#include "proto/tensor/message.h"

/* The array of NPZ and the field of VTK that hold it: bytes of a JSON object. */
#define GNP_PARAMETERS_NAME "parameters"

/* Most bytes of the object where it goes into a header of HTTP: some proxies take 4 kB of headers in all. */
enum { GNP_PARAMETERS_HEADER_MAX = 3072 };

/* Appends a JSON object of one line, in ASCII alone. */
gnp_status gnp_parameters_write(const struct gnp_values *values, struct gnp_buffer *buffer, struct gnp_error *error);
/* The same of at most GNP_PARAMETERS_HEADER_MAX bytes: of warnings their kinds alone where it would be longer, and
 * nothing at all where it still would. */
gnp_status gnp_parameters_write_short(const struct gnp_values *values, struct gnp_buffer *buffer,
                                      struct gnp_error *error);
/* Adds what such an object says; members that are no plain values are passed over. */
gnp_status gnp_parameters_read(const char *text, size_t size, struct gnp_values *values, struct gnp_error *error);
/* The same of the member `parameters` of a document. */
gnp_status gnp_parameters_read_member(const char *text, size_t size, struct gnp_values *values,
                                      struct gnp_error *error);

#endif
