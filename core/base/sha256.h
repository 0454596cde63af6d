/* Computes and compares SHA-256 digests, by nettle: its one user. */
#ifndef GNP_CORE_SHA256_H
#define GNP_CORE_SHA256_H

#include <stdbool.h>
#include <stddef.h>

enum {
	GNP_SHA256_SIZE = 32,
	GNP_SHA256_TEXT = 65 /* 64 hexadecimal digits and the NUL */
};

/* The digest of the concatenated pieces: data[i] has size[i] bytes (and may be NULL when that is 0). */
void gnp_sha256_text(const void *const *data, const size_t *size, size_t pieces, char text[GNP_SHA256_TEXT]);

void gnp_sha256(const void *data, size_t size, unsigned char digest[GNP_SHA256_SIZE]);

/* In a time that does not tell where they differ. */
bool gnp_sha256_equal(const unsigned char a[GNP_SHA256_SIZE], const unsigned char b[GNP_SHA256_SIZE]);

#endif
