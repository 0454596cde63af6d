/* Request targets: paths and query strings, decoded and refused. */
#include "test.h"

#include "target.h"

static void query_strings_are_decoded_and_checked(void)
{
	struct gnp_values values = {0};
	struct gnp_error error = {0};
	CHECK(gnpd_query_parse("a=1&b=x%20y+z&&c=", &values, &error) == GNP_OK);
	CHECK(values.count == 3);
	CHECK_STRING(gnp_values_find(&values, "b")->string, "x y z");
	CHECK_STRING(gnp_values_find(&values, "c")->string, "");
	CHECK(gnpd_query_parse("a=2", &values, &error) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "query: \"a\" is given twice");
	gnp_values_clear(&values);
	static const char *const bad[] = {"flag", "a=%", "a=%4", "a=%zz", "%00=1", "a=%00"};
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
		struct gnp_values none = {0};
		CHECK(gnpd_query_parse(bad[i], &none, NULL) == GNP_INVALID_ARGUMENT);
		gnp_values_clear(&none);
	}
}

static void paths_are_split_and_decoded(void)
{
	struct gnpd_target target;
	CHECK(gnpd_target_parse("/v2//models/a%2Fb/?x=1", &target) == GNP_OK);
	CHECK(target.valid && target.count == 3);
	CHECK_STRING(target.segments[2], "a/b");
	CHECK_STRING(target.query, "x=1");
	CHECK_STRING(target.path, "/v2//models/a%2Fb/");
	gnpd_target_clear(&target);
	static const char *const bad[] = {"*", "v2", "/a%00b", "/%", "/1/2/3/4/5/6/7/8/9"};
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
		CHECK(gnpd_target_parse(bad[i], &target) == GNP_OK);
		CHECK(!target.valid);
		gnpd_target_clear(&target);
	}
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(query_strings_are_decoded_and_checked),
		TEST(paths_are_split_and_decoded),
	};
	return RUN_TESTS(tests);
}
