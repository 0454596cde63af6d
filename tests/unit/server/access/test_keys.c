/* Files of keys: what lines hold, what is refused and how it is named, and the key of a request. */
#include "tests/unit/test.h"

#include <sys/stat.h>
#include <unistd.h>

#include "server/access/keys.h"

#define HASH_A "sha256:2bd806c97f0e00af1a1fc3328fa763a9269723c8db8fac4f93af71db186d6e90" /* of "alice" */
#define HASH_B "sha256:81b637d8fcd2c6da6359e6963113a1170de795e4b725b84d1e0b4cfd9ec58ce9" /* of "bob" */

static struct gnp_error error;

static gnp_status parse(const char *text, struct gnpd_keys **keys)
{
	error = (struct gnp_error){0};
	*keys = NULL;
	return gnpd_keys_parse(text, strlen(text), keys, &error);
}

static void lines_hold_names_hashes_scopes_and_limits(void)
{
	struct gnpd_keys *keys;
	CHECK(parse("# who may\n\n  a.b-c_1 \t" HASH_A "," HASH_B "  infer,jobs   concurrency=4 rate=10/s burst=20 # old and new\r\n"
	            "x sha256:0000000000000000000000000000000000000000000000000000000000000000 admin rate=30/m", &keys) == GNP_OK);
	CHECK(keys && keys->count == 2 && keys->hash_count == 3);
	const struct gnpd_key *key = &keys->items[0];
	CHECK_STRING(key->name, "a.b-c_1");
	CHECK(key->scopes == (1u << GNPD_SCOPE_INFER | 1u << GNPD_SCOPE_JOBS));
	CHECK(key->concurrency == 4 && key->rate == 10 && key->burst == 20);
	key = &keys->items[1];
	CHECK(key->scopes == 1u << GNPD_SCOPE_ADMIN && key->concurrency == 0);
	CHECK_NEAR(key->rate, 0.5, 0);
	CHECK_NEAR(key->burst, 1, 0);
	gnpd_keys_free(keys);
}

static void secrets_are_found_by_their_hashes(void)
{
	struct gnpd_keys *keys;
	CHECK(parse("a " HASH_A " infer\nb " HASH_B " infer\n", &keys) == GNP_OK);
	CHECK(gnpd_keys_find(keys, "alice") == 0);
	CHECK(gnpd_keys_find(keys, "bob") == 1);
	CHECK(gnpd_keys_find(keys, "bo") == GNPD_KEY_NONE);
	CHECK(gnpd_keys_find(keys, "") == GNPD_KEY_NONE);
	CHECK(gnpd_keys_find(keys, HASH_A) == GNPD_KEY_NONE);
	gnpd_keys_free(keys);
}

static void bad_lines_are_named(void)
{
	static const struct { const char *text, *want; } cases[] = {
		{"", "got no key, need at least 1"},
		{"# only\n", "got no key"},
		{"a\n", "line 1: need NAME sha256:HASH SCOPES"},
		{"a " HASH_A "\n", "line 1: need NAME sha256:HASH SCOPES"},
		{"\n\na sha256:12 infer", "line 3: hash: need sha256: and 64 digits"},
		{"a " HASH_A "0 infer", "line 1: hash: need"},
		{"a " HASH_A ", infer", "line 1: hash: need"},
		{"a md5:2bd806c97f0e00af1a1fc3328fa763a9269723c8db8fac4f93af71db186d6e90000 infer", "line 1: hash: need"},
		{"a sha256:2BD806c97f0e00af1a1fc3328fa763a9269723c8db8fac4f93af71db186d6e90 infer", "line 1: hash: need"},
		{"a " HASH_A " infer\nb " HASH_A " infer", "line 2: hash: is given twice"},
		{"a " HASH_A "," HASH_A " infer", "line 1: hash: is given twice"},
		{"a " HASH_A " infer\na " HASH_B " infer", "line 2: name: \"a\" is given twice"},
		{"a/b " HASH_A " infer", "line 1: name: got \"a/b\", need 1..64 of"},
		{"a\" " HASH_A " infer", "line 1: name: got"},
		{"a " HASH_A " write", "line 1: scope: got \"write\", known: infer, jobs, admin"},
		{"a " HASH_A " ,", "line 1: scope: got none"},
		{"a " HASH_A " infer fast", "line 1: got \"fast\", need concurrency="},
		{"a " HASH_A " infer concurrency=0", "concurrency: got \"0\", need 1..65536"},
		{"a " HASH_A " infer concurrency=1.5", "concurrency: got \"1.5\""},
		{"a " HASH_A " infer concurrency=1e3", "concurrency: got \"1e3\""},
		{"a " HASH_A " infer concurrency=1 concurrency=2", "got \"concurrency=2\", need"},
		{"a " HASH_A " infer rate=1", "rate: got \"1\", need 0.001..1000000 and /s, /m or /h"},
		{"a " HASH_A " infer rate=-1/s", "rate: got \"-1/s\""},
		{"a " HASH_A " infer rate=nan/s", "rate: got \"nan/s\""},
		{"a " HASH_A " infer rate=0x10/s", "rate: got \"0x10/s\""},
		{"a " HASH_A " infer rate=0/s", "rate: got \"0/s\""},
		{"a " HASH_A " infer burst=0.5 rate=1/s", "burst: got \"0.5\""},
		{"a " HASH_A " infer burst=5", "burst: got one without a rate"},
		/* What stood behind it was left out without a word: here a limit. */
		{"a " HASH_A " infer\r rate=1/s", "line 1: got a carriage return in the middle of the line"},
		{"# who\rb " HASH_A " infer", "line 1: got a carriage return in the middle of the line"},
		{"a " HASH_A " infer\r\r\n", "line 1: got a carriage return in the middle of the line"},
	};
	for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
		struct gnpd_keys *keys;
		CHECK(parse(cases[i].text, &keys) == GNP_INVALID_ARGUMENT && !keys);
		CHECK_CONTAINS(error.text, cases[i].want);
	}
}

static void bytes_of_any_kind_are_lines(void)
{
	static const char nul[] = "a " HASH_A " infer\nb\0c";
	struct gnpd_keys *keys = NULL;
	error = (struct gnp_error){0};
	CHECK(gnpd_keys_parse(nul, sizeof nul - 1, &keys, &error) == GNP_INVALID_ARGUMENT && !keys);
	CHECK_STRING(error.text, "line 2: got a NUL byte");
	CHECK(gnpd_keys_parse("", 0, &keys, NULL) == GNP_INVALID_ARGUMENT);
	/* Every cut of a good file and every changed byte of it either parses or is refused. */
	char text[sizeof nul + 64];
	snprintf(text, sizeof text, "a %s infer rate=1/s burst=2", HASH_A);
	size_t length = strlen(text), good = 0;
	for (size_t i = 0; i <= length; i++) {
		keys = NULL;
		good += gnpd_keys_parse(text, i, &keys, NULL) == GNP_OK;
		gnpd_keys_free(keys);
	}
	CHECK(good > 0 && good < 20);
	for (size_t i = 0; i < length; i++)
		for (int c = 0; c < 256; c += 5) {
			char before = text[i];
			text[i] = (char)c;
			keys = NULL;
			gnp_status status = gnpd_keys_parse(text, length, &keys, NULL);
			CHECK((status == GNP_OK) == (keys != NULL));
			gnpd_keys_free(keys);
			text[i] = before;
		}
}

static void too_many_hashes_are_refused(void)
{
	enum { LINE = 96 };
	char *text = malloc((size_t)LINE * (GNPD_KEYS_MAX + 1));
	struct gnpd_keys *keys = NULL;
	size_t size = 0, most = 0;
	for (int i = 0; i <= GNPD_KEYS_MAX; i++) {
		if (i == GNPD_KEYS_MAX)
			most = size;
		size += (size_t)sprintf(text + size, "k%d sha256:%064x infer\n", i, (unsigned)i);
	}
	error = (struct gnp_error){0};
	CHECK(gnpd_keys_parse(text, size, &keys, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "line 4097: keys: got more than 4096");
	CHECK(gnpd_keys_parse(text, most, &keys, NULL) == GNP_OK && keys->count == GNPD_KEYS_MAX);
	gnpd_keys_free(keys);
	free(text);
}

static void made_keys_are_fresh_and_match_their_hash(void)
{
	char first[GNPD_KEY_TEXT], second[GNPD_KEY_TEXT], hash[GNP_SHA256_TEXT], line[160];
	struct gnpd_keys *keys;
	CHECK(gnpd_key_make(second, hash, NULL) == GNP_OK && gnpd_key_make(first, hash, NULL) == GNP_OK);
	CHECK(strcmp(first, second) != 0 && strlen(first) == GNPD_KEY_TEXT - 1 && strncmp(first, "gnpd_", 5) == 0);
	snprintf(line, sizeof line, "me sha256:%s infer", hash);
	CHECK(parse(line, &keys) == GNP_OK);
	CHECK(gnpd_keys_find(keys, first) == 0 && gnpd_keys_find(keys, second) == GNPD_KEY_NONE);
	gnpd_keys_free(keys);
}

static void check_credentials(const struct gnpd_credentials *credentials, const char *want, const char *text)
{
	const char *secret = NULL;
	error = (struct gnp_error){0};
	gnp_status status = gnpd_credentials_secret(credentials, &secret, &error);
	CHECK(status == (want ? GNP_OK : GNP_UNAUTHORIZED));
	if (want)
		CHECK_STRING(secret, want);
	else
		CHECK_CONTAINS(error.text, text);
}

static void headers_name_one_key(void)
{
	check_credentials(&(struct gnpd_credentials){"Bearer abc", NULL, 1, 0}, "abc", "");
	check_credentials(&(struct gnpd_credentials){"bEARER  a/b+c==", NULL, 1, 0}, "a/b+c==", "");
	check_credentials(&(struct gnpd_credentials){NULL, "abc", 0, 1}, "abc", "");
	check_credentials(&(struct gnpd_credentials){"Bearer abc", "abc", 1, 1}, "abc", "");
	check_credentials(&(struct gnpd_credentials){"Bearer abc", "abd", 1, 1}, NULL, "two different keys");
	check_credentials(&(struct gnpd_credentials){NULL, NULL, 0, 0}, NULL, "a key is needed");
	check_credentials(&(struct gnpd_credentials){"Bearer", NULL, 1, 0}, NULL, "need \"Bearer KEY\"");
	check_credentials(&(struct gnpd_credentials){"Bearer ", NULL, 1, 0}, NULL, "malformed");
	check_credentials(&(struct gnpd_credentials){"Basic abc", NULL, 1, 0}, NULL, "need \"Bearer KEY\"");
	check_credentials(&(struct gnpd_credentials){"Bearer a,b", NULL, 1, 0}, NULL, "malformed");
	check_credentials(&(struct gnpd_credentials){"Bearer abc", NULL, 2, 0}, NULL, "Authorization: got 2 headers");
	check_credentials(&(struct gnpd_credentials){NULL, "abc", 0, 3}, NULL, "X-API-Key: got 3 headers");
	check_credentials(&(struct gnpd_credentials){NULL, "a b", 0, 1}, NULL, "X-API-Key: the key is malformed");
}

static void files_others_can_read_are_refused(void)
{
	char path[] = "/tmp/test_keys.XXXXXX";
	static const char text[] = "a " HASH_A " infer\n";
	struct gnpd_keys *keys;
	int fd = mkstemp(path);
	CHECK(fd >= 0 && write(fd, text, sizeof text - 1) == (ssize_t)sizeof text - 1);
	close(fd);
	static const mode_t good[] = {0600, 0400, 0640}, bad[] = {0604, 0644, 0620, 0602, 0601};
	for (size_t i = 0; i < sizeof good / sizeof good[0]; i++) {
		chmod(path, good[i]);
		CHECK(gnpd_keys_load(path, &keys, NULL) == GNP_OK);
		gnpd_keys_free(keys);
	}
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
		chmod(path, bad[i]);
		error = (struct gnp_error){0};
		CHECK(gnpd_keys_load(path, &keys, &error) == GNP_IO);
		CHECK_CONTAINS(error.text, "which lets others read or write it, need 0600 or 0640");
	}
	chmod(path, 0600);
	CHECK(truncate(path, GNPD_KEYS_FILE_MAX + 1) == 0);
	error = (struct gnp_error){0};
	CHECK(gnpd_keys_load(path, &keys, &error) == GNP_IO);
	CHECK_CONTAINS(error.text, "got 1048577 bytes, need at most 1048576");
	unlink(path);
	error = (struct gnp_error){0};
	CHECK(gnpd_keys_load(path, &keys, &error) == GNP_IO);
	CHECK_CONTAINS(error.text, "No such file");
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(lines_hold_names_hashes_scopes_and_limits),
		TEST(secrets_are_found_by_their_hashes),
		TEST(bad_lines_are_named),
		TEST(bytes_of_any_kind_are_lines),
		TEST(too_many_hashes_are_refused),
		TEST(made_keys_are_fresh_and_match_their_hash),
		TEST(headers_name_one_key),
		TEST(files_others_can_read_are_refused),
	};
	return RUN_TESTS(tests);
}
