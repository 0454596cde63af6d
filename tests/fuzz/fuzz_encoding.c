/* Compressed bodies. The first byte chooses the encoding and the limit, the rest is the body; what comes out is compressed and
 * decoded again. */
#include <zlib.h>

#include "proto/file/content_encoding.h"
#include "tests/fuzz/fuzz.h"

static void again(const struct gnp_buffer *plain)
{
	uLongf size = compressBound(plain->size);
	unsigned char *packed = malloc(size);
	struct gnp_buffer back = {0};
	FUZZ_REQUIRE(packed && compress2(packed, &size, plain->data, plain->size, 1) == Z_OK);
	FUZZ_REQUIRE(gnp_content_decode("deflate", packed, size, plain->size + 1, &back, NULL) == GNP_OK);
	FUZZ_REQUIRE(back.size == plain->size && memcmp(back.data, plain->data, back.size) == 0);
	gnp_buffer_clear(&back);
	free(packed);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	static const char *const names[] = {"gzip", "deflate", "x-gzip", "br"};
	if (size == 0)
		return 0;
	size_t limit = data[0] & 4 ? 100 : 100000;
	unsigned char *body = fuzz_copy(data + 1, size - 1);
	struct gnp_buffer out = {0};
	struct gnp_error error = {0};
	gnp_status status = gnp_content_decode(names[data[0] & 3], body, size - 1, limit, &out, &error);
	FUZZ_REQUIRE(status == GNP_OK ? out.size <= limit : error.text[0] != '\0');
	if (status == GNP_OK && out.size)
		again(&out);
	gnp_buffer_clear(&out);
	free(body);
	return 0;
}
