/* The binary frame of /v2. The input's first line is the header Inference-Header-Content-Length, the rest is the body. */
#include "tests/fuzz/fuzz_oip.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	const uint8_t *end = size ? memchr(data, '\n', size) : NULL;
	if (!end)
		return 0;
	size_t line = (size_t)(end - data);
	char *length = fuzz_text(data, line);
	unsigned char *body = fuzz_copy(end + 1, size - line - 1);
	fuzz_oip(length, body, size - line - 1);
	free(body);
	free(length);
	return 0;
}
