#include "server/access/keys.h"

#include <errno.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/random.h>

#include "server/base/secret.h"
#include "server/parse/hex.h"

static const char *const scopes[GNPD_SCOPES] = {[GNPD_SCOPE_INFER] = "infer", [GNPD_SCOPE_JOBS] = "jobs", [GNPD_SCOPE_ADMIN] = "admin"};

static const char name_characters[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789._-";

const char *gnpd_scope_name(enum gnpd_scope scope)
{
	return scopes[scope];
}

gnp_status gnpd_key_check_name(const char *name, struct gnp_error *error)
{
	size_t length = strlen(name);
	if (length == 0 || length > GNPD_KEY_NAME_MAX || strspn(name, name_characters) != length)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "name: got \"%.80s\", need 1..%d of A-Z, a-z, 0-9, '.', '_', '-'", name,
		                     GNPD_KEY_NAME_MAX);
	return GNP_OK;
}

/* One "sha256:<hex>" of length characters. */
static bool parse_hash(const char *text, size_t length, unsigned char digest[GNP_SHA256_SIZE])
{
	static const char prefix[] = "sha256:";
	const size_t skip = sizeof prefix - 1;
	if (length != skip + 2 * GNP_SHA256_SIZE || strncmp(text, prefix, skip) != 0)
		return false;
	for (size_t i = 0; i < GNP_SHA256_SIZE; i++) {
		int high = gnpd_hex_digit(text[skip + 2 * i]), low = gnpd_hex_digit(text[skip + 2 * i + 1]);
		if (high < 0 || low < 0)
			return false;
		digest[i] = (unsigned char)(high << 4 | low);
	}
	return true;
}

/* A hash that is there already would leave open whose key it is. */
static bool hash_known(const struct gnpd_keys *keys, const unsigned char digest[GNP_SHA256_SIZE])
{
	for (size_t i = 0; i < keys->hash_count; i++)
		if (memcmp(keys->hashes[i].digest, digest, GNP_SHA256_SIZE) == 0)
			return true;
	return false;
}

static gnp_status parse_hashes(struct gnpd_keys *keys, char *word, struct gnp_error *error)
{
	for (char *text = word; text; ) {
		size_t length = strcspn(text, ",");
		struct gnpd_key_hash *hash = &keys->hashes[keys->hash_count];
		if (keys->hash_count == GNPD_KEYS_MAX)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "keys: got more than %d, need at most that", GNPD_KEYS_MAX);
		if (!parse_hash(text, length, hash->digest))
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "hash: need sha256: and 64 digits of 0-9, a-f");
		if (hash_known(keys, hash->digest))
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "hash: is given twice");
		hash->key = keys->count;
		keys->hash_count++;
		text = text[length] ? text + length + 1 : NULL;
	}
	return GNP_OK;
}

static gnp_status parse_scopes(char *word, unsigned *bits, struct gnp_error *error)
{
	char *save = NULL;
	*bits = 0;
	for (char *text = strtok_r(word, ",", &save); text; text = strtok_r(NULL, ",", &save)) {
		unsigned i = GNPD_SCOPE_NONE + 1;
		while (i < GNPD_SCOPES && strcmp(text, scopes[i]) != 0)
			i++;
		if (i == GNPD_SCOPES)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "scope: got \"%.40s\", known: infer, jobs, admin", text);
		*bits |= 1u << i;
	}
	if (!*bits)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "scope: got none, known: infer, jobs, admin");
	return GNP_OK;
}

/* Plain digits with at most one point: no sign, exponent, nan or inf. The unit follows at *end. */
static bool parse_decimal(const char *text, double minimum, double maximum, double *value, char **end)
{
	size_t length = strspn(text, "0123456789.");
	*value = length ? strtod(text, end) : 0;
	return length && (size_t)(*end - text) == length && *value >= minimum && *value <= maximum;
}

static gnp_status parse_rate(struct gnpd_key *key, const char *text, struct gnp_error *error)
{
	static const struct { const char *unit; double seconds; } units[] = {{"/s", 1}, {"/m", 60}, {"/h", 3600}};
	char *end = NULL;
	double value;
	if (parse_decimal(text, 0.001, 1e6, &value, &end))
		for (size_t i = 0; i < sizeof units / sizeof units[0]; i++)
			if (strcmp(end, units[i].unit) == 0) {
				key->rate = value / units[i].seconds;
				return GNP_OK;
			}
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "rate: got \"%.40s\", need 0.001..1000000 and /s, /m or /h", text);
}

static gnp_status parse_limit(struct gnpd_key *key, const char *word, struct gnp_error *error)
{
	char *end = NULL;
	double value;
	if (strncmp(word, "rate=", 5) == 0 && !key->rate)
		return parse_rate(key, word + 5, error);
	if (strncmp(word, "concurrency=", 12) == 0 && !key->concurrency) {
		if (!parse_decimal(word + 12, 1, 65536, &value, &end) || *end || value != (double)(size_t)value)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "concurrency: got \"%.40s\", need 1..65536", word + 12);
		key->concurrency = (size_t)value;
		return GNP_OK;
	}
	if (strncmp(word, "burst=", 6) == 0 && !key->burst) {
		if (!parse_decimal(word + 6, 1, 1e6, &key->burst, &end) || *end)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "burst: got \"%.40s\", need 1..1000000", word + 6);
		return GNP_OK;
	}
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "got \"%.40s\", need concurrency=, rate= or burst=, each once", word);
}

static bool name_known(const struct gnpd_keys *keys, const char *name)
{
	for (size_t i = 0; i < keys->count; i++)
		if (strcmp(keys->items[i].name, name) == 0)
			return true;
	return false;
}

static gnp_status parse_words(struct gnpd_keys *keys, char *line, struct gnp_error *error)
{
	static const char blanks[] = " \t";
	char *save = NULL;
	struct gnpd_key *key = &keys->items[keys->count];
	char *name = strtok_r(line, blanks, &save), *hashes = strtok_r(NULL, blanks, &save), *allowed = strtok_r(NULL, blanks, &save);
	*key = (struct gnpd_key){.name = ""};
	if (!allowed)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "need NAME sha256:HASH SCOPES");
	gnp_status status = gnpd_key_check_name(name, error);
	if (status == GNP_OK && name_known(keys, name))
		status = gnp_error_set(error, GNP_INVALID_ARGUMENT, "name: \"%s\" is given twice", name);
	if (status == GNP_OK)
		status = parse_hashes(keys, hashes, error);
	if (status == GNP_OK)
		status = parse_scopes(allowed, &key->scopes, error);
	for (char *word; status == GNP_OK && (word = strtok_r(NULL, blanks, &save)) != NULL;)
		status = parse_limit(key, word, error);
	if (status == GNP_OK && key->burst && !key->rate)
		status = gnp_error_set(error, GNP_INVALID_ARGUMENT, "burst: got one without a rate");
	if (status != GNP_OK)
		return status;
	if (key->rate && !key->burst)
		key->burst = key->rate > 1 ? key->rate : 1;
	strcpy(key->name, name);
	keys->count++;
	return GNP_OK;
}

/* line: of length bytes, not ended. */
static gnp_status parse_line(struct gnpd_keys *keys, const char *text, size_t length, struct gnp_error *error)
{
	if (length && text[length - 1] == '\r') /* of a line that ends as on Windows */
		length--;
	if (memchr(text, '\0', length))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "got a NUL byte");
	if (memchr(text, '\r', length))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "got a carriage return in the middle of the line, need it at the end or nowhere");
	char *line = strndup(text, length);
	if (!line)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "no memory for %zu bytes", length);
	line[strcspn(line, "#")] = '\0';
	gnp_status status = line[strspn(line, " \t")] ? parse_words(keys, line, error) : GNP_OK;
	free(line);
	return status;
}

static gnp_status parse_lines(struct gnpd_keys *keys, const char *data, size_t size, struct gnp_error *error)
{
	for (size_t at = 0, number = 1; at < size; number++) {
		struct gnp_error cause = {0};
		const char *end = memchr(data + at, '\n', size - at);
		size_t length = end ? (size_t)(end - data) - at : size - at;
		gnp_status status = parse_line(keys, data + at, length, &cause);
		if (status != GNP_OK)
			return gnp_error_set(error, status, "line %zu: %s", number, cause.text);
		at += length + 1;
	}
	return GNP_OK;
}

gnp_status gnpd_keys_parse(const char *data, size_t size, struct gnpd_keys **out, struct gnp_error *error)
{
	struct gnpd_keys *keys = calloc(1, sizeof *keys);
	/* One more than may be: the line that is one too many is parsed before it is refused. */
	if (keys && (keys->items = calloc(GNPD_KEYS_MAX + 1, sizeof *keys->items)) != NULL)
		keys->hashes = calloc(GNPD_KEYS_MAX + 1, sizeof *keys->hashes);
	if (!keys || !keys->items || !keys->hashes) {
		gnpd_keys_free(keys);
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "keys: no memory");
	}
	gnp_status status = parse_lines(keys, data, size, error);
	if (status == GNP_OK && !keys->count)
		status = gnp_error_set(error, GNP_INVALID_ARGUMENT, "got no key, need at least 1");
	if (status == GNP_OK)
		*out = keys;
	else
		gnpd_keys_free(keys);
	return status;
}

gnp_status gnpd_keys_load(const char *path, struct gnpd_keys **out, struct gnp_error *error)
{
	char *data;
	size_t size;
	struct gnp_error cause = {0};
	gnp_status status = gnpd_secret_read("keys-file", path, true, GNPD_KEYS_FILE_MAX, &data, &size, error);
	if (status != GNP_OK)
		return status;
	status = gnpd_keys_parse(data, size, out, &cause);
	if (status != GNP_OK)
		gnp_error_set(error, status, "keys-file: %s: %s", path, cause.text);
	free(data);
	return status;
}

void gnpd_keys_free(struct gnpd_keys *keys)
{
	if (!keys)
		return;
	free(keys->items);
	free(keys->hashes);
	free(keys);
}

long gnpd_keys_find(const struct gnpd_keys *keys, const char *secret)
{
	unsigned char digest[GNP_SHA256_SIZE];
	long found = GNPD_KEY_NONE;
	gnp_sha256(secret, strlen(secret), digest);
	for (size_t i = 0; i < keys->hash_count; i++)
		if (gnp_sha256_equal(keys->hashes[i].digest, digest))
			found = (long)keys->hashes[i].key;
	return found;
}

/* RFC 6750's token68 and no more. */
static bool is_secret(const char *text)
{
	static const char marks[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-._~+/=";
	size_t length = strspn(text, marks);
	return length > 0 && length <= GNPD_KEY_SECRET_MAX && text[length] == '\0';
}

static gnp_status bearer(const char *value, const char **secret, struct gnp_error *error)
{
	if (strncasecmp(value, "Bearer ", 7) != 0)
		return gnp_error_set(error, GNP_UNAUTHORIZED, "Authorization: need \"Bearer KEY\"");
	value += 7 + strspn(value + 7, " ");
	if (!is_secret(value))
		return gnp_error_set(error, GNP_UNAUTHORIZED, "Authorization: the key is malformed");
	*secret = value;
	return GNP_OK;
}

gnp_status gnpd_credentials_secret(const struct gnpd_credentials *credentials, const char **secret, struct gnp_error *error)
{
	const char *one = NULL, *other = NULL;
	if (!credentials->authorization && !credentials->api_key)
		return gnp_error_set(error, GNP_UNAUTHORIZED, "a key is needed: \"Authorization: Bearer KEY\" or \"X-API-Key: KEY\"");
	if (credentials->authorizations > 1 || credentials->api_keys > 1)
		return gnp_error_set(error, GNP_UNAUTHORIZED, "%s: got %u headers, need at most 1",
		                     credentials->authorizations > 1 ? "Authorization" : "X-API-Key",
		                     credentials->authorizations > 1 ? credentials->authorizations : credentials->api_keys);
	if (credentials->authorization && bearer(credentials->authorization, &one, error) != GNP_OK)
		return GNP_UNAUTHORIZED;
	if (credentials->api_key && !is_secret(other = credentials->api_key))
		return gnp_error_set(error, GNP_UNAUTHORIZED, "X-API-Key: the key is malformed");
	if (one && other && strcmp(one, other) != 0)
		return gnp_error_set(error, GNP_UNAUTHORIZED, "Authorization and X-API-Key: got two different keys, need one");
	*secret = one ? one : other;
	return GNP_OK;
}

gnp_status gnpd_key_make(char key[GNPD_KEY_TEXT], char hash[GNP_SHA256_TEXT], struct gnp_error *error)
{
	static const char prefix[] = "gnpd_", digits[] = "0123456789abcdef";
	unsigned char bytes[32];
	if (getrandom(bytes, sizeof bytes, 0) != sizeof bytes)
		return gnp_error_set(error, GNP_IO, "random numbers: %s", strerror(errno));
	strcpy(key, prefix);
	for (size_t i = 0; i < sizeof bytes; i++) {
		key[sizeof prefix - 1 + 2 * i] = digits[bytes[i] >> 4];
		key[sizeof prefix + 2 * i] = digits[bytes[i] & 15];
	}
	key[GNPD_KEY_TEXT - 1] = '\0';
	gnp_sha256_text((const void *[]){key}, (size_t[]){GNPD_KEY_TEXT - 1}, 1, hash);
	return GNP_OK;
}
