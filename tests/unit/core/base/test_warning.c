/* Warnings: one of each kind, the outermost task's, and in an answer's report. */
#include "core/base/warning.h"

#include <string.h>

#include "core/base/task.h"
#include "tests/unit/test.h"

static void first_of_a_kind_stays(void)
{
	struct gnp_warnings warnings = {0};
	CHECK(gnp_warnings_count(&warnings) == 0);
	gnp_warnings_add(&warnings, GNP_WARNING_HEAT, "%d is more than %d", 3, 2);
	gnp_warnings_add(&warnings, GNP_WARNING_HEAT, "another");
	gnp_warnings_add(&warnings, GNP_WARNING_MEAN, "removed; truly");
	CHECK(gnp_warnings_count(&warnings) == 2);
	CHECK(strcmp(warnings.text[GNP_WARNING_HEAT], "heat: 3 is more than 2") == 0);
	CHECK(strcmp(warnings.text[GNP_WARNING_MEAN], "mean: removed, truly") == 0);
	gnp_warnings_add(NULL, GNP_WARNING_MEAN, "to nobody");
}

static void long_texts_end_at_a_word(void)
{
	struct gnp_warnings warnings = {0};
	char text[2 * GNP_WARNING_TEXT_MAX];
	for (size_t i = 0; i < sizeof text - 1; i++)
		text[i] = i % 7 == 6 ? ' ' : 'w';
	text[sizeof text - 1] = '\0';
	gnp_warnings_add(&warnings, GNP_WARNING_MEAN, "%s", text);
	const char *got = warnings.text[GNP_WARNING_MEAN];
	CHECK(strlen(got) > GNP_WARNING_TEXT_MAX - 16 && strlen(got) < GNP_WARNING_TEXT_MAX);
	CHECK(strcmp(got + strlen(got) - 7, " wwwwww") == 0);
}

static void merging_keeps_what_is_there(void)
{
	struct gnp_warnings to = {0}, from = {0};
	gnp_warnings_add(&to, GNP_WARNING_HEAT, "own");
	gnp_warnings_add(&from, GNP_WARNING_HEAT, "other");
	gnp_warnings_add(&from, GNP_WARNING_MEAN, "other");
	gnp_warnings_merge(&to, &from);
	CHECK(strcmp(to.text[GNP_WARNING_HEAT], "heat: own") == 0);
	CHECK(strcmp(to.text[GNP_WARNING_MEAN], "mean: other") == 0);
	gnp_warnings_merge(NULL, &from);
	gnp_warnings_merge(&to, NULL);
	CHECK(gnp_warnings_count(&to) == 2);
}

static void a_part_warns_the_whole(void)
{
	struct gnp_task whole, part;
	gnp_task_init(&whole);
	gnp_task_init_part(&part, &whole);
	gnp_warnings_add(gnp_task_warnings(&part), GNP_WARNING_DROPPED, "half");
	CHECK(gnp_warnings_count(&whole.warnings) == 1 && gnp_warnings_count(&part.warnings) == 0);
	CHECK(gnp_task_warnings(NULL) == NULL);
}

static void names_are_words(void)
{
	for (int kind = 0; kind < GNP_WARNING_KINDS; kind++) {
		const char *name = gnp_warning_name((enum gnp_warning_kind)kind);
		CHECK(name && strspn(name, "abcdefghijklmnopqrstuvwxyz_") == strlen(name));
	}
	CHECK(gnp_warning_name(GNP_WARNING_KINDS) == NULL);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(first_of_a_kind_stays), TEST(long_texts_end_at_a_word), TEST(merging_keeps_what_is_there),
	                                    TEST(a_part_warns_the_whole), TEST(names_are_words)};
	return RUN_TESTS(tests);
}
