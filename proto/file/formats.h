/* The table of all file formats, and the search in it by name and by media type. */
#ifndef GNP_PROTO_FORMATS_H
#define GNP_PROTO_FORMATS_H

#include <stdbool.h>
#include <stddef.h>

#include "proto/format/format.h"

/* The i-th format, or NULL past the last. */
const struct gnp_format *gnp_format_at(size_t i);

/* By name or extension ("ply"); by media type, parameters and synonyms allowed (model/ply, text/x-xyz, ...; generic
 * ones such as application/octet-stream or application/x-www-form-urlencoded are not a format). False, and *format
 * unchanged, when there is none. */
bool gnp_format_by_name(const char *name, const struct gnp_format **format);
bool gnp_format_by_media_type(const char *media_type, const struct gnp_format **format);

/* By the first `length` bytes of type; *spelled: the type as the table spells it, which is static. */
bool gnp_format_find_media_type(const char *type, size_t length, const struct gnp_format **format,
                                const char **spelled);
/* The media type of an answer, synonyms and application/octet-stream among them, as the table spells it: static.
 * NULL: it is none. */
const char *gnp_format_media_type_spelled(const char *media_type);

#endif
