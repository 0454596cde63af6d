/* The whole test framework: a program is a table of named functions, quiet on success.
 *
 *   static void sphere_has_mean_curvature_minus_one(void) { CHECK_NEAR(h, -1, 1e-4); }
 *   int main(int argc, char **argv) { static const struct test tests[] = {TEST(sphere_...)}; return RUN_TESTS(tests); }
 *
 * A failed check prints file, line and values, and the test goes on. With an argument only tests whose name
 * contains it run. The last line is "PROGRAM: N passed, M failed"; the exit status is 1 when any failed. */
#ifndef GNP_TESTS_TEST_H
#define GNP_TESTS_TEST_H

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct test {
	const char *name;
	void (*run)(void);
};
#define TEST(function) {#function, function}
#define RUN_TESTS(tests) test_run(argc, argv, tests, sizeof(tests) / sizeof((tests)[0]))

static int test_failures; /* of the test running */

#define CHECK(condition) \
	((condition) ? (void)0 : (void)(test_failures++, fprintf(stderr, "%s:%d: %s\n", __FILE__, __LINE__, #condition)))

#define CHECK_NEAR(got, want, tolerance)                                                                             \
	do {                                                                                                             \
		double got_ = (got), want_ = (want), tolerance_ = (tolerance);                                               \
		if (!(fabs(got_ - want_) <= tolerance_)) {                                                                   \
			test_failures++;                                                                                         \
			fprintf(stderr, "%s:%d: %s: got %.17g, want %.17g within %g\n", __FILE__, __LINE__, #got, got_, want_, tolerance_); \
		}                                                                                                            \
	} while (0)

/* got must be at most limit; NaN fails. */
#define CHECK_AT_MOST(got, limit)                                                                              \
	do {                                                                                                       \
		double got_ = (got), limit_ = (limit);                                                                 \
		if (!(got_ <= limit_)) {                                                                               \
			test_failures++;                                                                                   \
			fprintf(stderr, "%s:%d: %s: got %.9g, want at most %.9g\n", __FILE__, __LINE__, #got, got_, limit_); \
		}                                                                                                      \
	} while (0)

#define CHECK_STRING(got, want)                                                                            \
	do {                                                                                                   \
		const char *got_ = (got), *want_ = (want);                                                         \
		if (!got_ || strcmp(got_, want_) != 0) {                                                           \
			test_failures++;                                                                               \
			fprintf(stderr, "%s:%d: %s: got \"%s\", want \"%s\"\n", __FILE__, __LINE__, #got, got_ ? got_ : "(null)", want_); \
		}                                                                                                  \
	} while (0)

/* got must contain part. */
#define CHECK_CONTAINS(got, part)                                                                          \
	do {                                                                                                   \
		const char *got_ = (got), *part_ = (part);                                                         \
		if (!got_ || !strstr(got_, part_)) {                                                               \
			test_failures++;                                                                               \
			fprintf(stderr, "%s:%d: %s: got \"%s\", want it to contain \"%s\"\n", __FILE__, __LINE__, #got, got_ ? got_ : "(null)", part_); \
		}                                                                                                  \
	} while (0)

static inline int test_run(int argc, char **argv, const struct test *tests, size_t count)
{
	const char *slash = strrchr(argv[0], '/');
	int passed = 0, failed = 0;
	for (size_t i = 0; i < count; i++) {
		if (argc > 1 && !strstr(tests[i].name, argv[1]))
			continue;
		test_failures = 0;
		tests[i].run();
		if (test_failures) {
			failed++;
			fprintf(stderr, "FAILED %s\n", tests[i].name);
		} else {
			passed++;
		}
	}
	printf("%s: %d passed, %d failed\n", slash ? slash + 1 : argv[0], passed, failed);
	return failed ? 1 : 0;
}

#endif
