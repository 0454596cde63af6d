/* Header checks against request smuggling. */
#include "tests/unit/test.h"

#include "server/parse/framing.h"

struct header {
	const char *name, *value;
};

static struct gnp_error error;

/* headers: up to a NULL name. */
static gnp_status check(const struct header *headers, const char *version)
{
	struct gnpd_framing framing = {0};
	error = (struct gnp_error){0};
	for (; headers->name; headers++)
		gnpd_framing_header(&framing, headers->name, headers->value);
	return gnpd_framing_finish(&framing, version, &error);
}

#define HEADERS(...) ((const struct header[]){__VA_ARGS__, {NULL, NULL}})

static void ordinary_headers_pass(void)
{
	CHECK(check(HEADERS({"Host", "a"}, {"Content-Length", "12"}, {"Accept", "*/*"}, {"Accept", "text/plain"}), "HTTP/1.1") == GNP_OK);
	CHECK(check(HEADERS({"host", "a"}, {"transfer-encoding", "Chunked"}), "HTTP/1.1") == GNP_OK);
	CHECK(check(HEADERS({"X-Empty", NULL}), "HTTP/1.0") == GNP_OK);
	CHECK_STRING(error.text, "");
}

static void duplicates_of_framing_headers_are_refused(void)
{
	CHECK(check(HEADERS({"Content-Length", "5"}, {"content-length", "5"}), "HTTP/1.1") == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "Content-Length: got 2 headers, need at most 1");
	CHECK(check(HEADERS({"Host", "a"}, {"HOST", "b"}), "HTTP/1.1") == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "Host: got 2 headers, need at most 1");
	CHECK(check(HEADERS({"Inference-Header-Content-Length", "1"}, {"inference-header-content-length", "2"}), "HTTP/1.1") ==
	      GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "Inference-Header-Content-Length: got 2 headers, need at most 1");
	CHECK(check(HEADERS({"Transfer-Encoding", "chunked"}, {"Transfer-Encoding", "chunked"}), "HTTP/1.1") ==
	      GNP_INVALID_ARGUMENT);
}

static void ambiguous_framing_is_refused(void)
{
	CHECK(check(HEADERS({"Content-Length", "5"}, {"Transfer-Encoding", "chunked"}), "HTTP/1.1") == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "got both Content-Length and Transfer-Encoding, need one");
	CHECK(check(HEADERS({"Transfer-Encoding", "gzip, chunked"}), "HTTP/1.1") == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "Transfer-Encoding other than chunked: got \"gzip, chunked\"");
	CHECK(check(HEADERS({"Transfer-Encoding", "xchunked"}), "HTTP/1.1") == GNP_INVALID_ARGUMENT);
	CHECK(check(HEADERS({"Transfer-Encoding", NULL}), "HTTP/1.1") == GNP_INVALID_ARGUMENT);
	CHECK(check(HEADERS({"Transfer-Encoding", "chunked"}), "HTTP/1.0") == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "Transfer-Encoding needs HTTP/1.1: got \"HTTP/1.0\"");
}

static void content_length_is_digits_only(void)
{
	static const char *const bad[] = {"", "-1", "+5", "5,5", "0x10", "5 ", "five", NULL};
	for (size_t i = 0; bad[i]; i++) {
		CHECK(check(HEADERS({"Content-Length", bad[i]}), "HTTP/1.1") == GNP_INVALID_ARGUMENT);
		CHECK_CONTAINS(error.text, "Content-Length is not a number: got \"");
	}
}

static void header_names_are_tokens(void)
{
	CHECK(check(HEADERS({"Content-Length ", "5"}), "HTTP/1.1") == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "header name is not a token: got \"Content-Length \"");
	CHECK(check(HEADERS({"", "5"}), "HTTP/1.1") == GNP_INVALID_ARGUMENT);
	CHECK(check(HEADERS({"Transfer-Encoding\x0b", "chunked"}), "HTTP/1.1") == GNP_INVALID_ARGUMENT);
}

/* As the library hands a head over: one piece of memory, its colons and ends of lines overwritten. */
static gnp_status check_size(size_t whole)
{
	static const char head[] = "Host\0 a\0\0X-Blank\0   b \0\0X-Empty\0\0\0";
	struct gnpd_framing framing = {0};
	error = (struct gnp_error){0};
	gnpd_framing_header(&framing, head, head + 6);
	gnpd_framing_header(&framing, head + 9, head + 20);
	gnpd_framing_header(&framing, head + 24, head + 32);
	gnpd_framing_size(&framing, strlen("GET / HTTP/1.1\r\n"), whole);
	return gnpd_framing_finish(&framing, "HTTP/1.1", &error);
}

static void lines_add_up_to_the_head(void)
{
	const size_t whole = strlen("GET / HTTP/1.1\r\nHost: a\r\nX-Blank:   b \r\nX-Empty:\r\n\r\n");
	CHECK(check_size(whole) == GNP_OK);
	CHECK(check_size(0) == GNP_OK);
	CHECK(check_size(whole + 1) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "headers: 53 bytes are not lines of \"name: value\" that end in CRLF");
	CHECK(check_size(whole - 1) == GNP_INVALID_ARGUMENT);
}

static void first_fault_is_reported(void)
{
	CHECK(check(HEADERS({"Host", "a"}, {"Host", "b"}, {"Content-Length", "x"}), "HTTP/1.1") == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "Host: got 2 headers");
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(ordinary_headers_pass),
		TEST(duplicates_of_framing_headers_are_refused),
		TEST(ambiguous_framing_is_refused),
		TEST(content_length_is_digits_only),
		TEST(header_names_are_tokens),
		TEST(lines_add_up_to_the_head),
		TEST(first_fault_is_reported),
	};
	return RUN_TESTS(tests);
}
