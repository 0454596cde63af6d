/* PLY files. Encoding adds the column `quality`, so that only the second pass is lossless. */
#include "tests/fuzz/fuzz_file.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	return fuzz_file(&gnp_format_ply, false, data, size);
}
