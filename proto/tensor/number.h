/* Reads and writes numbers as text, whatever the locale: exactly, and in the shortest form that reads back the same. */
#ifndef GNP_PROTO_NUMBER_H
#define GNP_PROTO_NUMBER_H

#include <stdbool.h>
#include <stddef.h>

/* Reads a decimal number (also "+1", ".5", "5.", "nan", "inf" as text files have them) at text, not past end. Correctly
 * rounded; too large a number reads as infinity. Returns the address after it, or NULL when there is no number. */
const char *gnp_number_read(const char *text, const char *end, double *value);

/* The same for what JSON calls a number and nothing else. */
const char *gnp_number_read_json(const char *text, const char *end, double *value);

#define GNP_NUMBER_LENGTH_MAX 32

/* Writes the shortest decimal text (one in a thousand is a digit longer) that reads back as the same value, at most 9 / 17
 * significant digits ("nan", "inf",
 * "-inf" for what is not finite), not NUL-terminated. text has room for GNP_NUMBER_LENGTH_MAX. Returns the length. */
size_t gnp_number_write_float(char *text, float value);
size_t gnp_number_write_double(char *text, double value);

#endif
