/* The command line's parts that need no process: options, progress lines, URLs, a server's error bodies, whole files. */
#include <stdint.h>
#include <sys/stat.h>
#include <unistd.h>

#include "clients/answer.h"
#include "clients/file_io.h"
#include "clients/http_client.h"
#include "clients/options.h"
#include "clients/progress.h"
#include "tests/unit/test.h"

static const struct gnp_option options[] = {
	{"output", 'o', "FILE", ""}, {"points", 'n', "N", ""}, {"json", 'j', NULL, ""}, {"view", 0, "AZ,EL", ""},
	{"project", 0, "[=true|false]", ""},
};

static gnp_status parse(char **argv, struct gnp_arguments *arguments, struct gnp_error *error)
{
	int argc = 0;
	while (argv[argc])
		argc++;
	return gnp_arguments_parse(argc, argv, options, 5, 2, arguments, error);
}

static void every_spelling_of_an_option_is_taken(void)
{
	char *argv[] = {"in", "-oout", "--points=7", "--json", "--", "-x", NULL};
	struct gnp_arguments arguments;
	uint64_t points = 0;
	CHECK(parse(argv, &arguments, NULL) == GNP_OK);
	CHECK(arguments.operand_count == 2);
	CHECK_STRING(arguments.operands[1], "-x");
	CHECK_STRING(gnp_arguments_get(&arguments, "output", NULL), "out");
	CHECK(gnp_arguments_has(&arguments, "json"));
	CHECK(!gnp_arguments_has(&arguments, "view"));
	CHECK(gnp_arguments_integer(&arguments, "points", 1, 10, &points, NULL) == GNP_OK);
	CHECK(points == 7);
}

static void a_flag_stands_alone_or_takes_its_value_after_an_equals_sign(void)
{
	static const struct {
		char *argv[3];
		const char *value;
	} cases[] = {{{"--project", "in", NULL}, "true"}, {{"--project=false", "in", NULL}, "false"},
	             {{"--project=", "in", NULL}, ""}, {{"in", "--project", NULL}, "true"}};
	for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
		struct gnp_arguments arguments;
		CHECK(parse((char **)cases[i].argv, &arguments, NULL) == GNP_OK);
		CHECK_STRING(gnp_arguments_get(&arguments, "project", NULL), cases[i].value);
		CHECK(arguments.operand_count == 1);
	}
}

static void wrong_command_lines_are_named(void)
{
	static const struct {
		char *argv[4];
		const char *text;
	} cases[] = {
		{{"--frob", NULL}, "--frob: unknown option"}, {{"-z", NULL}, "-z: unknown option"},
		{{"--out", "x", NULL}, "--out: unknown option"}, {{"in", "-o", NULL}, "-o: needs FILE"},
		{{"-o", "a", "--output=b", NULL}, "--output: given twice"}, {{"a", "b", "c", NULL}, "c: unexpected, need at most 2"},
		{{"--json=false", NULL}, "--json=false: --json takes no value"}, {{"-jx", NULL}, "-jx: --json takes no value"},
	};
	for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
		struct gnp_arguments arguments;
		struct gnp_error error = {0};
		CHECK(parse((char **)cases[i].argv, &arguments, &error) == GNP_INVALID_ARGUMENT);
		CHECK_CONTAINS(error.text, cases[i].text);
	}
}

static void numbers_keep_their_limits(void)
{
	static char *const wrong[] = {"0", "11", "-1", "+5", " 5", "5x", "", "99999999999999999999999", "1e3"};
	for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
		char *argv[] = {"-n", wrong[i], NULL};
		struct gnp_arguments arguments;
		struct gnp_error error = {0};
		uint64_t points = 3;
		CHECK(parse(argv, &arguments, &error) == GNP_OK);
		CHECK(gnp_arguments_integer(&arguments, "points", 1, 10, &points, &error) == GNP_INVALID_ARGUMENT);
		CHECK(points == 3);
		CHECK_CONTAINS(error.text, "need an integer in 1..10");
	}
}

static void pairs_take_a_comma_or_an_x(void)
{
	static const struct {
		char *text;
		bool good;
	} cases[] = {{"30,25", true}, {"30x25", true}, {"-30,2.5e1", true}, {"30", false}, {"30,", false},
	             {",30", false}, {"30,25,1", false}, {"nan,1", false}, {"1,91", false}};
	for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
		char *argv[] = {"--view", cases[i].text, NULL};
		struct gnp_arguments arguments;
		double pair[2] = {0, 0};
		CHECK(parse(argv, &arguments, NULL) == GNP_OK);
		CHECK((gnp_arguments_pair(&arguments, "view", -90, 90, pair, NULL) == GNP_OK) == cases[i].good);
		CHECK(cases[i].good ? fabs(pair[0]) == 30 && pair[1] == 25 : pair[0] == 0 && pair[1] == 0);
	}
}

static void progress_tells_share_and_time_left(void)
{
	char line[128];
	gnp_progress_format("estimate", 0.25, 3, line, sizeof line);
	CHECK_CONTAINS(line, "estimate    25% [########");
	CHECK_CONTAINS(line, "] 9 s left");
	gnp_progress_format("order", 0.01, 3, line, sizeof line);
	CHECK(!strstr(line, "left"));
	gnp_progress_format("sample", -1, 12, line, sizeof line);
	CHECK_STRING(line, "sample     12 s");
	gnp_progress_format("done", 1, 3, line, sizeof line);
	CHECK(!strstr(line, "left") && !strchr(line, '.'));
}

static void query_values_are_escaped(void)
{
	struct gnp_buffer buffer = {0};
	CHECK(gnp_http_escape("normals,a&b=c d%/\xc3\xa4", &buffer, NULL) == GNP_OK);
	CHECK(gnp_buffer_append(&buffer, "", 1, NULL) == GNP_OK);
	CHECK_STRING((const char *)buffer.data, "normals,a%26b%3Dc%20d%25%2F%C3%A4");
	gnp_buffer_clear(&buffer);
}

static void error_bodies_become_errors(void)
{
	static const struct {
		const char *body;
		long http;
		gnp_status status;
		const char *text;
	} cases[] = {
		{"{\"error\":\"k: got \\\"x\\\"\",\"code\":\"invalid_argument\",\"request_id\":\"r1\"}", 400, GNP_INVALID_ARGUMENT,
		 "k: got \"x\" (HTTP 400, request r1)"},
		{"{ \"error\" : \"busy\" , \"code\" : \"overloaded\" }", 503, GNP_OVERLOADED, "busy (HTTP 503)"},
		{"{\"error\":\"odd\",\"code\":\"no_such_code\"}", 500, GNP_INTERNAL, "odd (HTTP 500)"},
		{"<html>\n404</html>", 404, GNP_INTERNAL, "http://h/: answered HTTP 404: <html> 404</html>"},
		{"", 502, GNP_INTERNAL, "answered HTTP 502"},
		/* A key was looked for anywhere, and a backslash taken off whatever it stood before. */
		{"{\"note\":\"say \\\"error\\\": \\\"no\\\"\",\"inner\":{\"error\":\"inner\"},\"error\":\"outer\"}", 500, GNP_INTERNAL, "outer (HTTP 500)"},
		{"{\"error\":\"a\\nb \\u00e4\\u001b[2J \\\\ \\/\"}", 500, GNP_INTERNAL, "a b \xc3\xa4 [2J \\ / (HTTP 500)"},
		{"{\"error\":{\"code\":\"unavailable\"}}", 503, GNP_INTERNAL, "http://h/: answered HTTP 503: {\"error\":{\"code\""},
		{"{\"error\":\"cut", 500, GNP_INTERNAL, "answered HTTP 500: {\"error\":\"cut"},
		{"{\"error\":\"\\", 500, GNP_INTERNAL, "HTTP 500"},
		{"\"error\"", 500, GNP_INTERNAL, "HTTP 500"},
	};
	for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
		/* Without a closing NUL, so that a read past the end shows under a sanitizer. */
		size_t size = strlen(cases[i].body);
		struct gnp_buffer body = {.data = malloc(size ? size : 1), .size = size};
		struct gnp_error error = {0};
		memcpy(body.data, cases[i].body, size);
		CHECK(gnp_http_failure("http://h/", cases[i].http, &body, &error) == cases[i].status);
		CHECK_CONTAINS(error.text, cases[i].text);
		free(body.data);
	}
}

static void strings_are_cut_after_a_whole_character(void)
{
	static const char text[] = "{\"a\":\"x\xc3\xa4\xe2\x82\xac\",\"n\":0.25,\"list\":[{\"a\":\"b\"}]}";
	const struct gnp_buffer body = {.data = (unsigned char *)(uintptr_t)text, .size = sizeof text - 1}, nothing = {0};
	static const char *const cut[] = {NULL, "", "x", "x", "x\xc3\xa4", "x\xc3\xa4", "x\xc3\xa4", "x\xc3\xa4\xe2\x82\xac"};
	struct json_t *answer = gnp_answer_parse(&body);
	char value[8];
	for (size_t size = 1; size < sizeof cut / sizeof cut[0]; size++) {
		gnp_answer_string(answer, "a", value, size);
		CHECK_STRING(value, cut[size]);
	}
	CHECK(gnp_answer_number(answer, "n") == 0.25 && gnp_answer_number(answer, "a") == 0);
	gnp_answer_string(gnp_answer_at(gnp_answer_member(answer, "list"), 0), "a", value, sizeof value);
	CHECK_STRING(value, "b");
	CHECK(!gnp_answer_at(answer, 0) && !gnp_answer_member(gnp_answer_member(answer, "list"), "a"));
	gnp_answer_free(answer);
	CHECK(!gnp_answer_parse(&nothing) && !gnp_answer_member(NULL, "a") && !gnp_answer_at(NULL, 0));
	gnp_answer_string(NULL, "a", value, sizeof value);
	CHECK_STRING(value, "");
}

static void files_are_replaced_as_a_whole_and_links_stay(void)
{
	char folder[] = "/tmp/gnp-test-XXXXXX", file[64], link[64];
	CHECK(mkdtemp(folder) != NULL);
	snprintf(file, sizeof file, "%s/file", folder);
	snprintf(link, sizeof link, "%s/link", folder);
	CHECK(gnp_file_write(file, "one", 3, NULL) == GNP_OK);
	CHECK(symlink(file, link) == 0);
	CHECK(gnp_file_write(link, "three", 5, NULL) == GNP_OK);
	struct stat info;
	CHECK(lstat(link, &info) == 0 && S_ISLNK(info.st_mode));
	struct gnp_buffer content = {0};
	CHECK(gnp_file_read(file, &content, NULL) == GNP_OK);
	CHECK(content.size == 5 && memcmp(content.data, "three", 5) == 0);
	gnp_buffer_clear(&content);
	struct gnp_error error = {0};
	CHECK(gnp_file_write(folder, "x", 1, &error) == GNP_IO);
	CHECK_CONTAINS(error.text, "Is a directory");
	unlink(link);
	unlink(file);
	CHECK(rmdir(folder) == 0); /* nothing temporary is left */
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(every_spelling_of_an_option_is_taken), TEST(wrong_command_lines_are_named),
		TEST(a_flag_stands_alone_or_takes_its_value_after_an_equals_sign),
		TEST(numbers_keep_their_limits),            TEST(pairs_take_a_comma_or_an_x),
		TEST(progress_tells_share_and_time_left),   TEST(query_values_are_escaped),
		TEST(error_bodies_become_errors),           TEST(strings_are_cut_after_a_whole_character),
		TEST(files_are_replaced_as_a_whole_and_links_stay),
	};
	return RUN_TESTS(tests);
}
