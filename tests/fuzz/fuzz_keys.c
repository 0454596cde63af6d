/* Files of keys, and the headers keys come in. */
#include "server/access/keys.h"
#include "tests/fuzz/fuzz.h"

static void check_keys(const struct gnpd_keys *keys)
{
	for (size_t h = 0; h < keys->hash_count; h++)
		FUZZ_REQUIRE(keys->hashes[h].key < keys->count);
	for (size_t k = 0; k < keys->count; k++) {
		FUZZ_REQUIRE(gnpd_key_check_name(keys->items[k].name, NULL) == GNP_OK);
		FUZZ_REQUIRE(keys->items[k].rate >= 0 && keys->items[k].burst >= 0);
	}
	FUZZ_REQUIRE(gnpd_keys_find(keys, "no key has this hash, as far as anybody knows") == GNPD_KEY_NONE);
}

/* The text up to a line's end in one header, the rest in the other. */
static void try_headers(char *text)
{
	struct gnp_error error = {0};
	const char *secret = NULL;
	char *rest = strchr(text, '\n');
	struct gnpd_credentials credentials = {.authorization = text, .authorizations = 1};
	if (rest) {
		*rest = '\0';
		credentials.api_key = rest + 1;
		credentials.api_keys = 1;
	}
	if (gnpd_credentials_secret(&credentials, &secret, &error) == GNP_OK)
		FUZZ_REQUIRE(secret && *secret && strlen(secret) <= GNPD_KEY_SECRET_MAX);
	else
		FUZZ_REQUIRE(error.text[0]);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
	struct gnpd_keys *keys = NULL;
	struct gnp_error error = {0};
	char *copy = (char *)fuzz_copy(data, size), *text = fuzz_text(data, size);
	if (gnpd_keys_parse(copy, size, &keys, &error) == GNP_OK)
		check_keys(keys);
	else
		FUZZ_REQUIRE(error.text[0] && !keys);
	gnpd_keys_free(keys);
	try_headers(text);
	free(text);
	free(copy);
	return 0;
}
