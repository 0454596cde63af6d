/* Lines of the log: whole in both formats, and no text forges one. */
#include "tests/unit/test.h"

#include <unistd.h>

#include "server/base/log.h"

/* The one line that an event of this text leaves, without its time, which is as long in every line. */
static const char *event(enum gnpd_log_format format, const char *text)
{
	static char line[8192];
	struct gnpd_log log;
	int ends[2];
	CHECK(pipe(ends) == 0);
	gnpd_log_init(&log, format, GNPD_LOG_INFO, ends[1]);
	gnpd_log_event(&log, GNPD_LOG_WARNING, "%s", text);
	gnpd_log_fini(&log);
	close(ends[1]);
	ssize_t size = read(ends[0], line, sizeof line - 1);
	line[size > 0 ? size : 0] = '\0';
	close(ends[0]);
	return line + (size > 24 ? strcspn(line + 10, " \"") + 10 : 0);
}

/* Messages ended after 200 bytes in JSON alone, before the cause that stands last. */
static void messages_are_whole_in_both_formats(void)
{
	char text[400], want[500];
	memset(text, 'x', sizeof text);
	strcpy(text + 300, ": No such file or directory");
	snprintf(want, sizeof want, " warning: %s\n", text);
	CHECK_STRING(event(GNPD_LOG_TEXT, text), want);
	snprintf(want, sizeof want, "\",\"level\":\"warning\",\"event\":\"message\",\"message\":\"%s\"}\n", text);
	CHECK_STRING(event(GNPD_LOG_JSON, text), want);
}

/* Where every byte takes six the line still ends as it must. */
static void the_longest_message_is_a_line_of_json(void)
{
	char text[1000];
	memset(text, '\1', sizeof text - 1);
	text[sizeof text - 1] = '\0';
	const char *line = event(GNPD_LOG_JSON, text);
	size_t length = strlen(line);
	CHECK(length > 6 * 511 && strcmp(line + length - 9, "\\u0001\"}\n") == 0);
}

/* A name of a file or a client may hold anything; as text it was written as it is. */
static void no_text_forges_a_line(void)
{
	static const char text[] = "a\"b\\c\n2026-01-01 info: forged\r\033[2J\302\205\177";
	CHECK_STRING(event(GNPD_LOG_TEXT, text), " warning: a\"b\\c\\u000a2026-01-01 info: forged\\u000d\\u001b[2J\\u00c2\\u0085\\u007f\n");
	CHECK_CONTAINS(event(GNPD_LOG_JSON, text), "a\\\"b\\\\c\\u000a2026-01-01 info: forged\\u000d\\u001b[2J\\u00c2\\u0085\\u007f\"}\n");
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(messages_are_whole_in_both_formats),
		TEST(the_longest_message_is_a_line_of_json),
		TEST(no_text_forges_a_line),
	};
	return RUN_TESTS(tests);
}
