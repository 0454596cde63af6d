#include "sha256.h"

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
