/* NPY files. */
#include "tests/fuzz/fuzz_file.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	return fuzz_file(GNP_FORMAT_NPY, true, data, size);
}
