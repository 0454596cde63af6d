/* Reads a range of bytes as a client asks for it (RFC 9110, 14): single ranges only. */
#ifndef GNPD_RANGE_H
#define GNPD_RANGE_H

#include <stddef.h>

enum gnpd_range {
	GNPD_RANGE_WHOLE, /* no range, one of another unit, several, or no range at all: the header is to be ignored */
	GNPD_RANGE_PART,
	GNPD_RANGE_OUTSIDE
};

/* text: of a Range header, or NULL; size: bytes of the thing. *first, *count: of GNPD_RANGE_PART, at least one byte. */
enum gnpd_range gnpd_range_parse(const char *text, size_t size, size_t *first, size_t *count);

#endif
