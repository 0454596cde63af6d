#include "core/base/memory.h"

#include <stdint.h>
#include <stdlib.h>

bool gnp_size_multiply(size_t a, size_t b, size_t *product)
{
	size_t value;
	if (__builtin_mul_overflow(a, b, &value))
		return false;
	*product = value;
	return true;
}

void *gnp_array_new(size_t count, size_t size)
{
	size_t bytes;
	if (__builtin_mul_overflow(count, size, &bytes))
		return NULL;
	return malloc(bytes ? bytes : 1);
}

void *gnp_array_zero(size_t count, size_t size)
{
	return calloc(count ? count : 1, size ? size : 1);
}
