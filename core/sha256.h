/* SHA-256 of bytes in pieces, by nettle: its one user. */
#ifndef GNP_CORE_SHA256_H
#define GNP_CORE_SHA256_H

#include <stddef.h>

enum { GNP_SHA256_TEXT = 65 }; /* 64 hexadecimal digits and the NUL */

/* The digest of the concatenated pieces: data[i] has size[i] bytes (and may be NULL when that is 0). */
void gnp_sha256_text(const void *const *data, const size_t *size, size_t pieces, char text[GNP_SHA256_TEXT]);

#endif
