/* Parses command-line options by a table: lookup, numbers within ranges, and the lines of help. */
#ifndef GNP_CLIENTS_OPTIONS_H
#define GNP_CLIENTS_OPTIONS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "core/base/status.h"

struct gnp_option {
	const char *name;  /* without the dashes: --name */
	char letter;       /* -x, or 0 */
	const char *value; /* what follows, as help shows it ("FILE"); in brackets ("[=true|false]") for what --name alone sets to
	                      true; NULL for a switch, which takes none */
	const char *help;  /* NULL: taken, but listed by someone else */
};

#define GNP_OPERANDS_MAX 4
#define GNP_OPTIONS_GIVEN_MAX 64

/* What was given. Borrows argv. */
struct gnp_arguments {
	size_t operand_count;
	const char *operands[GNP_OPERANDS_MAX];
	size_t option_count;
	struct gnp_option_given {
		const struct gnp_option *option;
		const char *value; /* "true" where --name alone was given */
	} options[GNP_OPTIONS_GIVEN_MAX];
};

/* Parses argv[0..argc): --name VALUE, --name=VALUE, -x VALUE, -xVALUE, switches, operands ("-" is one), and "--" which ends the options.
 * An unknown option, a missing value, a value for a switch, an option given twice, or more operands than operands_most:
 * GNP_INVALID_ARGUMENT naming it. */
gnp_status gnp_arguments_parse(int argc, char **argv, const struct gnp_option *options, size_t option_count,
                               size_t operands_most, struct gnp_arguments *arguments, struct gnp_error *error);

/* The value given for an option, or otherwise. */
const char *gnp_arguments_get(const struct gnp_arguments *arguments, const char *name, const char *otherwise);
bool gnp_arguments_has(const struct gnp_arguments *arguments, const char *name);

/* Sets *value from the option when it was given, within [minimum, maximum]; else leaves it. */
gnp_status gnp_arguments_integer(const struct gnp_arguments *arguments, const char *name, uint64_t minimum,
                                 uint64_t maximum, uint64_t *value, struct gnp_error *error);
gnp_status gnp_arguments_number(const struct gnp_arguments *arguments, const char *name, double minimum, double maximum,
                                double *value, struct gnp_error *error);

/* The same for exactly two numbers with a comma or an x between them ("30,25", "1200x900"). */
gnp_status gnp_arguments_pair(const struct gnp_arguments *arguments, const char *name, double minimum, double maximum,
                              double pair[2], struct gnp_error *error);

/* One help line an option. */
void gnp_options_print(const struct gnp_option *options, size_t count, FILE *out);

#endif
