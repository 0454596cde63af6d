/* Lists of known names in errors: whole names alone, what is left out is counted, and the nearest one is suggested. */
#include "tests/unit/test.h"

#include "core/base/names.h"
#include "proto/operation/operations.h"
#include "proto/operation/parameter.h"

static const char *text_of(struct gnp_names *names, const char *given, const char *const *known, size_t count)
{
	gnp_names_begin(names, given, strlen(given));
	for (size_t i = 0; i < count; i++)
		gnp_names_add(names, known[i]);
	return gnp_names_end(names);
}

static void the_nearest_name_is_suggested(void)
{
	static const char *const known[] = {"points", "degree", "mean_curvature", "k"};
	static const struct {
		const char *given, *hint;
	} rows[] = {{"degre", "degree"}, {"dergee", "degree"}, {"Degree", "degree"}, {"mean-curvature", "mean_curvature"}, {"mean_curvatures", "mean_curvature"},
	            {"meancurv", ""}, {"point", "points"}, {"j", ""}, {"q", ""}, {"K", "k"}, {"nosuch", ""}, {"", ""}};
	for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
		struct gnp_names names;
		char want[120] = "points, degree, mean_curvature, k";
		if (*rows[i].hint)
			snprintf(want + strlen(want), sizeof want - strlen(want), "; did you mean \"%s\"?", rows[i].hint);
		CHECK_STRING(text_of(&names, rows[i].given, known, 4), want);
	}
	struct gnp_names names;
	CHECK_STRING(text_of(&names, "x", NULL, 0), "none");
}

/* The list ended in the middle of a name. */
static void names_that_do_not_fit_are_counted(void)
{
	enum { COUNT = 1000 };
	struct gnp_names names;
	char name[GNP_NAME_TEXT];
	gnp_names_begin(&names, "name_00000000000000999", 22);
	for (int i = 0; i < COUNT; i++) {
		snprintf(name, sizeof name, "name_%017d", i);
		gnp_names_add(&names, name);
	}
	const char *text = gnp_names_end(&names), *and = strstr(text, " and "), *last = strrchr(text, ',');
	size_t listed = 1;
	for (const char *at = text; (at = strchr(at, ',')); at++)
		listed++;
	char want[120];
	snprintf(want, sizeof want, " and %zu more; did you mean \"name_00000000000000999\"?", COUNT - listed);
	CHECK(and && strcmp(and, want) == 0);
	CHECK(last && and && and - last == 2 + 22);
	CHECK(listed > 15);
}

static void names_of_any_length_do_no_harm(void)
{
	char longest[2000];
	struct gnp_names names;
	memset(longest, 'n', sizeof longest);
	longest[sizeof longest - 1] = 0;
	gnp_names_begin(&names, longest, strlen(longest));
	gnp_names_add(&names, longest);
	gnp_names_add(&names, "points");
	CHECK_STRING(gnp_names_end(&names), "2 more");
	longest[GNP_NAME_TEXT - 1] = 0;
	gnp_names_begin(&names, longest, strlen(longest));
	gnp_names_add(&names, longest);
	longest[0] = 'm';
	gnp_names_begin(&names, longest, strlen(longest));
	longest[0] = 'n';
	gnp_names_add(&names, longest);
	CHECK_CONTAINS(gnp_names_end(&names), "; did you mean \"nnn");
}

/* What a list is for: those of every operation are whole, with an unknown name as long as is shown before them. */
static void every_list_of_an_operation_is_whole(void)
{
	const struct gnp_operation *operation;
	char unknown[61];
	memset(unknown, 'x', 60);
	unknown[60] = 0;
	for (size_t i = 0; (operation = gnp_operation_at(i)); i++) {
		long options[GNP_OPTIONS_SIZE_MAX / sizeof(long)];
		struct gnp_error error = {0};
		operation->defaults(options);
		CHECK(gnp_parameter_parse(operation, options, unknown, "1", &error) == GNP_INVALID_ARGUMENT);
		for (size_t p = 0; p < operation->parameter_count; p++) {
			const struct gnp_parameter *parameter = &operation->parameters[p];
			CHECK_CONTAINS(error.text, parameter->name);
			struct gnp_error within = {0};
			if (parameter->type != GNP_PARAMETER_CHOICE && parameter->type != GNP_PARAMETER_SET)
				continue;
			CHECK(gnp_parameter_parse(operation, options, parameter->name, unknown, &within) == GNP_INVALID_ARGUMENT);
			for (int c = 0; parameter->choices && parameter->choices[c]; c++)
				CHECK_CONTAINS(within.text, parameter->choices[c]);
			for (size_t o = 0; parameter->type == GNP_PARAMETER_SET && o < operation->output_count; o++)
				CHECK_CONTAINS(within.text, operation->outputs[o].name);
			CHECK(!strstr(within.text, " more"));
		}
		CHECK(!strstr(error.text, " more"));
	}
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(the_nearest_name_is_suggested), TEST(names_that_do_not_fit_are_counted),
	                                    TEST(names_of_any_length_do_no_harm), TEST(every_list_of_an_operation_is_whole)};
	return RUN_TESTS(tests);
}
