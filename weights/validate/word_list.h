/* Reads an option that lists words of a known set, as --regimes and --sections do. */
#ifndef GNP_WEIGHTS_WORD_LIST_H
#define GNP_WEIGHTS_WORD_LIST_H

#include "clients/options.h"

/* The i-th word a list may hold; NULL past the last. At most 32. */
typedef const char *(*gnp_word_name_fn)(unsigned i);

/* Sets *mask to the words of an option, separated by commas; leaves it when the option was not given.
 * GNP_INVALID_ARGUMENT with the words there are. */
gnp_status gnp_word_list_parse(const struct gnp_arguments *arguments, const char *option, gnp_word_name_fn name,
                               unsigned *mask, struct gnp_error *error);

/* Whether a word is in a list; any is in none (NULL). */
bool gnp_word_list_has(const char *list, const char *word);

#endif
