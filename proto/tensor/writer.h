/* A writer appends text to a buffer and remembers the first error, so that a run of lines needs one check, at its end.
 *
 * After an error nothing more is appended: calls are harmless and change neither the buffer nor the error. What was
 * appended before stays in the buffer; a caller that promises "unchanged on failure" sets its size back. */
#ifndef GNP_PROTO_WRITER_H
#define GNP_PROTO_WRITER_H

#include "core/base/status.h"
#include "proto/tensor/buffer.h"

struct gnp_writer {
	struct gnp_buffer *buffer; /* borrowed */
	struct gnp_error *error;   /* borrowed; may be NULL */
	gnp_status status;         /* GNP_OK, or the first error */
};

struct gnp_writer gnp_writer_to(struct gnp_buffer *buffer, struct gnp_error *error);
void gnp_writer_printf(struct gnp_writer *writer, const char *format, ...) __attribute__((format(printf, 2, 3)));
/* Text as it is: cheaper than "%s". */
void gnp_writer_text(struct gnp_writer *writer, const char *text);

#endif
