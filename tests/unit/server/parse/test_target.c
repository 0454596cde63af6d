/* Request targets: paths and query strings, decoded and refused. */
#include "tests/unit/test.h"

#include "server/parse/target.h"

static void query_strings_are_decoded_and_checked(void)
{
	struct gnp_values values = {0};
	struct gnp_error error = {0};
	CHECK(gnpd_query_parse("a=1&b=x%20y+z%2B%c3%A4&c=", &values, &error) == GNP_OK);
	CHECK(values.count == 3);
	CHECK_STRING(gnp_values_find(&values, "b")->string, "x y z+\xc3\xa4");
	CHECK_STRING(gnp_values_find(&values, "c")->string, "");
	CHECK(gnpd_query_parse("a=2", &values, &error) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "query: \"a\" is given twice");
	gnp_values_clear(&values);
	static const char *const bad[] = {"flag", "a=%", "a=%4", "a=%zz", "a=%\x10\x11", "%00=1", "a=%00", "a=1&&b=2", "&a=1", "a=1&", "&"};
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
		struct gnp_values none = {0};
		CHECK(gnpd_query_parse(bad[i], &none, NULL) == GNP_INVALID_ARGUMENT);
		gnp_values_clear(&none);
	}
}

static void an_empty_query_has_no_parameters(void)
{
	struct gnp_values values = {0};
	CHECK(gnpd_query_parse(NULL, &values, NULL) == GNP_OK && gnpd_query_parse("", &values, NULL) == GNP_OK);
	CHECK(values.count == 0);
}

static void paths_are_split(void)
{
	struct gnpd_target target;
	CHECK(gnpd_target_parse("/v2/models/a?x=1/2", &target) == GNP_OK);
	CHECK(target.valid && !target.whole && target.count == 3 && !target.authority);
	CHECK_STRING(target.segments[2], "a");
	CHECK_STRING(target.query, "x=1/2");
	CHECK_STRING(target.path, "/v2/models/a");
	gnpd_target_clear(&target);
	CHECK(gnpd_target_parse("/1/2/3/4/5/6/7/8", &target) == GNP_OK);
	CHECK(target.valid && target.count == 8);
	CHECK_STRING(target.segments[7], "8");
	gnpd_target_clear(&target);
	CHECK(gnpd_target_parse("/?a=1", &target) == GNP_OK);
	CHECK(target.valid && target.count == 0);
	gnpd_target_clear(&target);
	CHECK(gnpd_target_parse("*", &target) == GNP_OK);
	CHECK(target.whole);
	gnpd_target_clear(&target);
}

/* Of what whoever guards some paths would have to know. */
static void a_path_has_one_spelling(void)
{
	struct gnpd_target target;
	static const char *const bad[] = {"", "v2", "**", "/a%00b", "/%", "/v%32", "//", "//v2", "/v2//models", "/v2/", "/v2//", "/v2/?a=1",
	                                  "/1/2/3/4/5/6/7/8/9", "/1/2/3/4/5/6/7/8/", "ftp://a/v2", "http:/v2"};
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
		CHECK(gnpd_target_parse(bad[i], &target) == GNP_OK);
		CHECK(!target.valid && !target.whole);
		gnpd_target_clear(&target);
	}
}

static void absolute_targets_are_taken_apart(void)
{
	static const struct { const char *uri, *authority, *path, *query; } good[] = {
		{"http://localhost:8080/v2/health", "localhost:8080", "/v2/health", NULL},
		{"HTTPS://[::1]/v2?a=/1", "[::1]", "/v2", "a=/1"},
		{"http://a", "a", "/", NULL},
		{"http://a?b=1", "a", "/", "b=1"},
		{"http:///v2", "", "/v2", NULL}};
	for (size_t i = 0; i < sizeof good / sizeof good[0]; i++) {
		struct gnpd_target target;
		CHECK(gnpd_target_parse(good[i].uri, &target) == GNP_OK);
		CHECK(target.valid && !target.whole);
		CHECK_STRING(target.authority, good[i].authority);
		CHECK_STRING(target.path, good[i].path);
		CHECK((target.query == NULL) == (good[i].query == NULL));
		if (target.query && good[i].query)
			CHECK_STRING(target.query, good[i].query);
		gnpd_target_clear(&target);
	}
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(query_strings_are_decoded_and_checked),
		TEST(an_empty_query_has_no_parameters),
		TEST(paths_are_split),
		TEST(a_path_has_one_spelling),
		TEST(absolute_targets_are_taken_apart),
	};
	return RUN_TESTS(tests);
}
