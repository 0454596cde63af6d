/* Writes an answer as it goes over the wire where the HTTP library takes none: in the middle of headers or of a body,
 * before the connection ends. */
#ifndef GNPD_LATE_REPLY_H
#define GNPD_LATE_REPLY_H

#include "core/base/status.h"
#include "proto/tensor/message.h"

/* Appends the error's answer, head and body. id: the request's, or "" while there is none. retry_after: seconds, told with 429 and 503.
 * GNP_OUT_OF_MEMORY only. */
gnp_status gnpd_late_reply(const struct gnp_error *error, const char *id, double retry_after, struct gnp_buffer *answer);

#endif
