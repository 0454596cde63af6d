/* Header checks against request smuggling (CWE-444): the HTTP library takes the first of duplicates and tolerates what
 * a proxy in front may read otherwise, so ambiguous framing is refused here before anything else is looked at. */
#ifndef GNPD_STRICT_H
#define GNPD_STRICT_H

#include "status.h"

struct gnpd_strict {
	unsigned content_length, transfer_encoding, host, inference_length; /* times seen */
	struct gnp_error error;                                             /* the first fault */
};

/* Zero-initialise, feed every header in order, then finish. value may be NULL. */
void gnpd_strict_header(struct gnpd_strict *strict, const char *name, const char *value);

/* GNP_OK, or GNP_INVALID_ARGUMENT with the first fault: duplicate Content-Length, Host, Transfer-Encoding or
 * Inference-Header-Content-Length; Content-Length not a number; Transfer-Encoding beside Content-Length, other than
 * chunked, or in HTTP/1.0; a header name that is not a token. The connection must be closed after the answer. */
gnp_status gnpd_strict_finish(struct gnpd_strict *strict, const char *version, struct gnp_error *error);

#endif
