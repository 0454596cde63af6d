/* What fuzzing targets share. A target is a file fuzz_NAME.c with one LLVMFuzzerTestOneInput; clang's libFuzzer drives it
 * (`make fuzz`), or replay.c with the inputs kept in corpus/NAME (`make test`). A fault ends the program: a crash, a sanitizer's
 * word, or a requirement below that does not hold. */
#ifndef GNP_TESTS_FUZZ_H
#define GNP_TESTS_FUZZ_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

#define FUZZ_REQUIRE(condition)                                                       \
	do {                                                                              \
		if (!(condition)) {                                                           \
			fprintf(stderr, "%s:%d: %s does not hold\n", __FILE__, __LINE__, #condition); \
			abort();                                                                  \
		}                                                                             \
	} while (0)

/* A copy in memory of its exact size, so that a sanitizer sees a read past the end. The caller frees it. */
static inline unsigned char *fuzz_copy(const void *data, size_t size)
{
	unsigned char *copy = malloc(size ? size : 1);
	FUZZ_REQUIRE(copy);
	if (size)
		memcpy(copy, data, size);
	return copy;
}

/* The same with a NUL after it. */
static inline char *fuzz_text(const void *data, size_t size)
{
	char *text = malloc(size + 1);
	FUZZ_REQUIRE(text);
	if (size)
		memcpy(text, data, size);
	text[size] = '\0';
	return text;
}

#endif
