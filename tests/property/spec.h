/* A request of the property tests as one line of words, "op=poisson cloud=torus n=300 seed=7 in:source=random:2 system=least_squares": what is
 * drawn, what is run, what is made smaller and what is printed are this line, so that a finding is repeated by pasting it. */
#ifndef GNP_TESTS_PROPERTY_SPEC_H
#define GNP_TESTS_PROPERTY_SPEC_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { SPEC_WORDS = 64, SPEC_NAME = 48, SPEC_VALUE = 400, SPEC_TEXT = 4096 };

struct spec {
	size_t count;
	struct {
		char name[SPEC_NAME], value[SPEC_VALUE];
	} word[SPEC_WORDS];
};

/* Words that are the test's own; every other word is a parameter of the operation: op, cloud, n, seed, scale, moved, shake, type, normals, out (outputs by name),
 * format (of a file), via (v1, v2: how HTTP is asked), in:NAME (an input: what is in it, and how many columns). */
bool spec_is_own(const char *name);

/* False for text that is no such line. */
bool spec_parse(const char *text, struct spec *spec);
void spec_write(const struct spec *spec, char text[SPEC_TEXT]);
/* The value of a word, or `otherwise`. */
const char *spec_get(const struct spec *spec, const char *name, const char *otherwise);
double spec_number(const struct spec *spec, const char *name, double otherwise);
/* Sets or adds; NULL takes it away. */
void spec_set(struct spec *spec, const char *name, const char *value);

/* The request that (seed, index) stands for. models: names of those loaded, NULL-terminated. */
void spec_draw(uint64_t seed, uint64_t index, const char *const *models, struct spec *spec);

#endif
