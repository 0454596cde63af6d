/* Tells the format of a body by its first bytes. */
#ifndef GNP_PROTO_SNIFF_H
#define GNP_PROTO_SNIFF_H

#include <stdbool.h>
#include <stddef.h>

#include "proto/format/format.h"

/* A magic first, else how its text begins past comments. False, and *format unchanged, when the body looks like
 * none. */
bool gnp_format_by_magic(const unsigned char *data, size_t size, const struct gnp_format **format);

#endif
