/* Checks headers against request smuggling (CWE-444): the HTTP library takes the first of duplicates and tolerates
 * what a proxy in front may read otherwise, so ambiguous framing is refused here before anything else is looked at. */
#ifndef GNPD_FRAMING_H
#define GNPD_FRAMING_H

#include <stddef.h>

#include "core/base/status.h"

/* Headers that may come once; framing.c has the others of them. */
enum { GNPD_FRAMING_LENGTH, GNPD_FRAMING_TRANSFER, GNPD_FRAMING_ONCE = 12 };

struct gnpd_framing {
	unsigned seen[GNPD_FRAMING_ONCE]; /* times */
	size_t bytes;                    /* of the header lines, as far as they are plain */
	struct gnp_error error;          /* the first fault */
};

/* Zero-initialise, feed every header in order, then finish. value may be NULL. */
void gnpd_framing_header(struct gnpd_framing *framing, const char *name, const char *value);

/* To be asked where names and values lie in one piece of memory as they came, ends of lines and colons apart. first_line: bytes of the
 * first line; whole: from it to the empty line, 0: not known. Another sum of the lines says that the library read them in a way of its
 * own (0.9.75 does): a line ended by a bare LF, continued, with a NUL in it, or with no name, which it takes for the end of the headers. */
void gnpd_framing_size(struct gnpd_framing *framing, size_t first_line, size_t whole);

/* GNP_OK, or GNP_INVALID_ARGUMENT with the first fault: a header twice that may come once; Content-Length not a number;
 * Transfer-Encoding beside Content-Length, other than chunked, or in HTTP/1.0; a header name that is not a token; a wrong size. The
 * connection must be closed after the answer. */
gnp_status gnpd_framing_finish(struct gnpd_framing *framing, const char *version, struct gnp_error *error);

#endif
