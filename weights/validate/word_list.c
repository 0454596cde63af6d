#include "weights/validate/word_list.h"

#include <string.h>

#include "core/base/names.h"

static gnp_status unknown_word(const char *option, const char *word, size_t length, gnp_word_name_fn name,
                               struct gnp_error *error)
{
	struct gnp_names known;
	gnp_names_begin(&known, word, length);
	for (unsigned i = 0; name(i); i++)
		gnp_names_add(&known, name(i));
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "--%s: got '%.*s', need some of %s", option,
	                     length < 40 ? (int)length : 40, word, gnp_names_end(&known));
}

gnp_status gnp_word_list_parse(const struct gnp_arguments *arguments, const char *option, gnp_word_name_fn name,
                               unsigned *mask, struct gnp_error *error)
{
	const char *word = gnp_arguments_get(arguments, option, NULL);
	unsigned chosen = 0;
	while (word) {
		size_t length = strcspn(word, ",");
		unsigned i = 0;
		while (name(i) && !(strlen(name(i)) == length && memcmp(name(i), word, length) == 0))
			i++;
		if (!name(i))
			return unknown_word(option, word, length, name, error);
		chosen |= 1u << i;
		word = word[length] ? word + length + 1 : NULL;
	}
	*mask = chosen ? chosen : *mask;
	return GNP_OK;
}

bool gnp_word_list_has(const char *list, const char *word)
{
	size_t length = strlen(word);
	for (const char *at = list; at; at = strchr(at, ',') ? strchr(at, ',') + 1 : NULL)
		if (strncmp(at, word, length) == 0 && (at[length] == ',' || at[length] == '\0'))
			return true;
	return !list;
}
