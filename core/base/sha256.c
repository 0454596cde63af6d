#include "core/base/sha256.h"

#include <nettle/memops.h>
#include <nettle/sha2.h>
#include <stdint.h>

void gnp_sha256_text(const void *const *data, const size_t *size, size_t pieces, char text[GNP_SHA256_TEXT])
{
	static const char digits[] = "0123456789abcdef";
	struct sha256_ctx context;
	uint8_t digest[SHA256_DIGEST_SIZE];
	sha256_init(&context);
	for (size_t i = 0; i < pieces; i++)
		if (size[i])
			sha256_update(&context, size[i], data[i]);
	sha256_digest(&context, sizeof digest, digest);
	for (size_t i = 0; i < sizeof digest; i++) {
		text[2 * i] = digits[digest[i] >> 4];
		text[2 * i + 1] = digits[digest[i] & 15];
	}
	text[2 * sizeof digest] = '\0';
}

void gnp_sha256(const void *data, size_t size, unsigned char digest[GNP_SHA256_SIZE])
{
	struct sha256_ctx context;
	sha256_init(&context);
	sha256_update(&context, size, data);
	sha256_digest(&context, GNP_SHA256_SIZE, digest);
}

bool gnp_sha256_equal(const unsigned char a[GNP_SHA256_SIZE], const unsigned char b[GNP_SHA256_SIZE])
{
	return memeql_sec(a, b, GNP_SHA256_SIZE);
}
