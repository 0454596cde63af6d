/* OBJ files, which are only read. */
#include "tests/fuzz/fuzz_file.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	return fuzz_file(&gnp_format_obj, false, data, size);
}
