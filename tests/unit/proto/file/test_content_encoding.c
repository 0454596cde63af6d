/* Compressed bodies, made by zlib itself, and bombs. */
#include "tests/unit/test.h"

#include <zlib.h>

#include "proto/file/content_encoding.h"

enum { GZIP = 15 + 16, ZLIB = 15, RAW = -15 };

static size_t compress_with(int window, const void *data, size_t size, unsigned char *out, size_t room)
{
	z_stream stream = {.next_in = (unsigned char *)data, .avail_in = (unsigned)size, .next_out = out, .avail_out = (unsigned)room};
	CHECK(deflateInit2(&stream, 9, Z_DEFLATED, window, 8, Z_DEFAULT_STRATEGY) == Z_OK);
	CHECK(deflate(&stream, Z_FINISH) == Z_STREAM_END);
	deflateEnd(&stream);
	return room - stream.avail_out;
}

static gnp_status decode(const char *encoding, const unsigned char *body, size_t size, size_t most, struct gnp_buffer *out,
                         struct gnp_error *error)
{
	unsigned char *copy = malloc(size ? size : 1);
	memcpy(copy, body, size);
	gnp_status status = gnp_content_decode(encoding, copy, size, most, out, error);
	free(copy);
	return status;
}

static void every_encoding_decodes(void)
{
	static const struct {
		const char *encoding;
		int window;
	} cases[] = {{"gzip", GZIP}, {"x-gzip", GZIP}, {"GZip", GZIP}, {"deflate", ZLIB}, {"deflate", RAW}};
	char text[100000];
	unsigned char body[100000];
	for (size_t i = 0; i < sizeof text; i++)
		text[i] = (char)(i * i % 251);
	for (size_t c = 0; c < 5; c++) {
		struct gnp_buffer out = {0};
		struct gnp_error error = {0};
		size_t size = compress_with(cases[c].window, text, sizeof text, body, sizeof body);
		CHECK(decode(cases[c].encoding, body, size, sizeof text, &out, &error) == GNP_OK);
		CHECK_STRING(error.text, "");
		CHECK(out.size == sizeof text && memcmp(out.data, text, sizeof text) == 0);
		gnp_buffer_clear(&out);
		CHECK(decode(cases[c].encoding, body, size, sizeof text - 1, &out, &error) == GNP_TOO_LARGE);
		CHECK_STRING(error.text, "body: decompresses to more than 99999 bytes");
		CHECK(!out.data);
	}
}

/* One zlib stream after another is no format; gzip members are. */
static void members_of_gzip_are_joined(void)
{
	unsigned char body[256];
	struct gnp_buffer out = {0};
	struct gnp_error error = {0};
	size_t size = compress_with(GZIP, "one,", 4, body, sizeof body), first = size;
	size_t empty = compress_with(GZIP, "", 0, body + size, sizeof body - size);
	size += empty;
	size += compress_with(GZIP, "two", 3, body + size, sizeof body - size);
	CHECK(decode("gzip", body, size, 7, &out, NULL) == GNP_OK && out.size == 7 && memcmp(out.data, "one,two", 7) == 0);
	gnp_buffer_clear(&out);
	CHECK(decode("gzip", body, size, 6, &out, NULL) == GNP_TOO_LARGE);
	for (size_t s = first + 1; s < size; s++) {
		if (s != first + empty)
			CHECK(decode("gzip", body, s, 7, &out, NULL) == GNP_INVALID_ARGUMENT);
	}
	size = compress_with(ZLIB, "one", 3, body, sizeof body);
	size += compress_with(ZLIB, "two", 3, body + size, sizeof body - size);
	CHECK(decode("deflate", body, size, 100, &out, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "after the end of the compressed data");
	CHECK(!out.data);
}

/* Memory is reserved for max_size bytes and no more; the buffer grew by half beyond them. */
static void no_more_is_allocated_than_allowed(void)
{
	enum { PLAIN = 3000000 };
	unsigned char *zeros = calloc(1, PLAIN), *body = malloc(1 << 16);
	size_t size = compress_with(GZIP, zeros, PLAIN, body, 1 << 16);
	for (size_t most = PLAIN; most < PLAIN + 5; most += 4) {
		struct gnp_buffer out = {0};
		CHECK(decode("gzip", body, size, most, &out, NULL) == GNP_OK);
		CHECK(out.size == PLAIN && out.capacity <= most);
		gnp_buffer_clear(&out);
	}
	free(zeros);
	free(body);
}

static void a_bomb_stops_at_the_limit(void)
{
	enum { PLAIN = 64 << 20, LIMIT = 1 << 20 };
	unsigned char *zeros = calloc(1, PLAIN), *body = malloc(1 << 20);
	size_t size = compress_with(GZIP, zeros, PLAIN, body, 1 << 20);
	struct gnp_buffer out = {0};
	CHECK(size < 1 << 17);
	CHECK(decode("gzip", body, size, LIMIT, &out, NULL) == GNP_TOO_LARGE);
	CHECK(decode("gzip", body, size, 0, &out, NULL) == GNP_TOO_LARGE);
	CHECK(decode("gzip", body, size, PLAIN, &out, NULL) == GNP_OK && out.size == PLAIN && out.capacity <= PLAIN + 65536);
	gnp_buffer_clear(&out);
	free(zeros);
	free(body);
}

static void damaged_bodies_are_refused(void)
{
	unsigned char body[256];
	const char *text = "the quick brown fox jumps over the lazy dog, the quick brown fox";
	size_t size = compress_with(GZIP, text, strlen(text), body, sizeof body - 1);
	struct gnp_buffer out = {0};
	struct gnp_error after = {0}, cut = {0}, crc = {0};
	for (size_t s = 0; s < size; s++)
		CHECK(decode("gzip", body, s, 1000, &out, NULL) == GNP_INVALID_ARGUMENT);
	CHECK(decode("gzip", body, size - 1, 1000, &out, &cut) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(cut.text, "body: the compressed data is truncated");
	CHECK(decode("gzip", body, size + 1, 1000, &out, &after) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(after.text, "body: 1 bytes after the end of the compressed data");
	body[size - 6] ^= 1;
	CHECK(decode("gzip", body, size, 1000, &out, &crc) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(crc.text, "corrupt compressed data (incorrect data check)");
	CHECK(!out.data);
}

static void an_empty_body_of_nothing_decodes(void)
{
	unsigned char body[64];
	size_t size = compress_with(GZIP, "", 0, body, sizeof body);
	struct gnp_buffer out = {0};
	CHECK(decode("gzip", body, size, 0, &out, NULL) == GNP_OK && out.size == 0);
	gnp_buffer_clear(&out);
}

static void other_encodings_are_not_supported(void)
{
	static const char *const names[] = {"br", "identity", "", "gzip, gzip", "zstd", "gzipp"};
	for (size_t i = 0; i < sizeof names / sizeof names[0]; i++) {
		struct gnp_buffer out = {0};
		struct gnp_error error = {0};
		CHECK(decode(names[i], (const unsigned char *)"x", 1, 10, &out, &error) == GNP_UNSUPPORTED_MEDIA);
		CHECK_CONTAINS(error.text, names[i]);
		CHECK_CONTAINS(error.text, "need gzip or deflate");
	}
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(every_encoding_decodes), TEST(members_of_gzip_are_joined), TEST(no_more_is_allocated_than_allowed), TEST(a_bomb_stops_at_the_limit),
	                                    TEST(damaged_bodies_are_refused), TEST(an_empty_body_of_nothing_decodes),
	                                    TEST(other_encodings_are_not_supported)};
	return RUN_TESTS(tests);
}
