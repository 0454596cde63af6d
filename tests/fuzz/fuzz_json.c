/* JSON bodies: the envelope of /v2 without binary tensors, and the file format of /v1. */
#include "tests/fuzz/fuzz_oip.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	unsigned char *body = fuzz_copy(data, size);
	fuzz_oip("", body, size);
	free(body);
	return fuzz_file(&gnp_format_json, false, data, size);
}
