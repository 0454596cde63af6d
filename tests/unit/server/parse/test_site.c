/* Host, Origin and Sec-Fetch-Site: which pages may use the server through a browser. */
#include "tests/unit/test.h"

#include "server/parse/site.h"

static struct gnp_error error;

static gnp_status host(const char *name, const char *allowed)
{
	error = (struct gnp_error){0};
	return gnpd_site_check_host(&(struct gnpd_site){.host = name}, allowed, &error);
}

static gnp_status origin(const char *from, const char *to, const char *fetch, const char *allowed)
{
	error = (struct gnp_error){0};
	return gnpd_site_check_origin(&(struct gnpd_site){to, from, fetch}, allowed, &error);
}

static void names_nobody_else_can_have_pass(void)
{
	static const char *const good[] = {NULL, "", "localhost", "LocalHost:8080", "localhost.", "localhost:", "a.localhost", "127.0.0.1:1", "10.1.2.3",
	                                   "0.0.0.0:80", "[::1]", "[::1]:8080", "[FE80::1]:65535"};
	for (size_t i = 0; i < sizeof good / sizeof good[0]; i++)
		CHECK(host(good[i], "") == GNP_OK);
}

static void other_names_must_be_allowed(void)
{
	CHECK(host("evil.example:8080", "") == GNP_FORBIDDEN);
	CHECK_STRING(error.text, "host: got \"evil.example:8080\", need localhost, a numeric address or a name that is allowed (allowed-hosts)");
	CHECK(host("evil.example", "gnp.example.org, gnp") == GNP_FORBIDDEN);
	CHECK_STRING(error.text, "host: got \"evil.example\", need localhost, a numeric address or one of gnp.example.org, gnp (allowed-hosts)");
	static const char *const good[] = {"gnp.example.org", "GNP.example.ORG:443", "gnp.example.org.", "gnp", "gnp:8080"};
	for (size_t i = 0; i < sizeof good / sizeof good[0]; i++)
		CHECK(host(good[i], "gnp.example.org,gnp") == GNP_OK);
	static const char *const bad[] = {"localhost.evil.example", "xlocalhost", ".localhost.a", "127.0.0.1.evil.example", "gn", "example.org", "gnpx", "127.1",
	                                  "2130706433", "0x7f.0.0.1", "agnp.example.org"};
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
		CHECK(host(bad[i], "gnp.example.org,gnp") == GNP_FORBIDDEN);
	CHECK(host("a.example", "b, a.example.") == GNP_OK && host("a.example.", "a.example") == GNP_OK);
	CHECK(host("evil.example", "*") == GNP_OK);
}

static void what_is_no_host_is_refused(void)
{
	static const char *const bad[] = {"a b", "user@localhost", "localhost:80a", "localhost:80:80", "[::1", "[::1]a", "[]", "[localhost]", ":80", "::1",
	                                  "a/b", "http://localhost", "\xc3\xa4"};
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
		CHECK(host(bad[i], "*") == GNP_INVALID_ARGUMENT);
		CHECK_CONTAINS(error.text, "need NAME or NAME:PORT");
	}
}

static void lists_hold_names_alone(void)
{
	static const char *const good[] = {"", "a", "a.example.org, b ,c", "*", "10.0.0.1,[::1],::1", " a "};
	for (size_t i = 0; i < sizeof good / sizeof good[0]; i++)
		CHECK(gnpd_site_check_list(good[i], NULL) == GNP_OK);
	static const char *const bad[] = {"http://a", "a:80", "*.a", "a;b", "a, b/", "[::1]:80", "[::1"};
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
		CHECK(gnpd_site_check_list(bad[i], NULL) == GNP_INVALID_ARGUMENT);
	error = (struct gnp_error){0};
	gnpd_site_check_list("a, b:80", &error);
	CHECK_STRING(error.text, "got \"b:80\", need names without scheme and port, separated by commas, or *");
}

static void own_pages_and_no_pages_pass(void)
{
	CHECK(origin(NULL, "localhost:8080", NULL, "") == GNP_OK);
	CHECK(origin(NULL, NULL, NULL, "") == GNP_OK);
	CHECK(origin("http://localhost:8080", "localhost:8080", NULL, "") == GNP_OK);
	CHECK(origin("http://LOCALHOST", "localhost:80", NULL, "") == GNP_OK);
	CHECK(origin("https://a.example", "a.example", NULL, "") == GNP_OK);
	CHECK(origin("https://a.example:443", "a.example", NULL, "") == GNP_OK);
	CHECK(origin("http://[::1]:8080", "[::1]:8080", NULL, "") == GNP_OK);
	CHECK(origin("https://a.example", "127.0.0.1:8080", NULL, "a.example") == GNP_OK);
	CHECK(origin("http://[::1]", "a", NULL, "b,[::1]") == GNP_OK && origin("http://[::1]", "a", NULL, "::1") == GNP_OK);
	CHECK(origin("https://a.example", "127.0.0.1:8080", "same-origin", "") == GNP_OK);
	CHECK(origin(NULL, "localhost", "none", "") == GNP_OK);
}

static void pages_of_other_sites_are_refused(void)
{
	CHECK(origin("http://evil.example", "localhost:8080", NULL, "") == GNP_FORBIDDEN);
	CHECK_STRING(error.text, "Origin: got \"http://evil.example\", need that of this server, \"localhost:8080\", or of a name that is allowed "
	             "(allowed-hosts): pages of other sites may not change anything here");
	static const char *const bad[] = {"null", "", "http://localhost:3000", "http://localhost", "http://127.0.0.1:8080", "https://localhost", "localhost:8080",
	                                  "http://localhost:8080.evil.example", "http://localhost:8080/", "http://a@localhost:8080"};
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++)
		CHECK(origin(bad[i], "localhost:8080", NULL, "*") == GNP_FORBIDDEN);
	CHECK(origin("http://localhost:8080", NULL, NULL, "") == GNP_FORBIDDEN);
	CHECK(origin("http://localhost:8080", "localhost:8080", "cross-site", "localhost") == GNP_FORBIDDEN);
	CHECK_STRING(error.text, "Sec-Fetch-Site: got \"cross-site\", need same-origin or none: pages of other sites may not change anything here");
	CHECK(origin(NULL, "localhost:8080", "same-site", "") == GNP_FORBIDDEN);
	CHECK(origin(NULL, "localhost:8080", "", "") == GNP_FORBIDDEN);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(names_nobody_else_can_have_pass),
		TEST(other_names_must_be_allowed),
		TEST(what_is_no_host_is_refused),
		TEST(lists_hold_names_alone),
		TEST(own_pages_and_no_pages_pass),
		TEST(pages_of_other_sites_are_refused),
	};
	return RUN_TESTS(tests);
}
