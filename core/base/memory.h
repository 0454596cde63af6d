/* Allocates arrays whose sizes are checked for overflow. */
#ifndef GNP_CORE_MEMORY_H
#define GNP_CORE_MEMORY_H

#include <stdbool.h>
#include <stddef.h>

/* *product = a * b; false (and *product unchanged) when that does not fit a size_t. */
bool gnp_size_multiply(size_t a, size_t b, size_t *product);

/* An array of count items of size bytes each, uninitialised / zeroed. NULL when memory is exhausted or the
 * product overflows; a zero product gives a valid pointer. Freed by free(). */
void *gnp_array_new(size_t count, size_t size);
void *gnp_array_zero(size_t count, size_t size);

#endif
