/* Ranges of bytes and lengths of time, as clients write them. */
#include "tests/unit/test.h"

#include "server/parse/duration.h"
#include "server/parse/range.h"

static void check(const char *text, enum gnpd_range kind, size_t first, size_t count)
{
	size_t got_first = 77, got_count = 77;
	enum gnpd_range got = gnpd_range_parse(text, 100, &got_first, &got_count);
	CHECK(got == kind);
	if (kind == GNPD_RANGE_PART)
		CHECK(got_first == first && got_count == count);
	else
		CHECK(got_first == 77 && got_count == 77);
}

static void ranges(void)
{
	check("bytes=0-9", GNPD_RANGE_PART, 0, 10);
	check("bytes=99-99", GNPD_RANGE_PART, 99, 1);
	check("BYTES=90-1000", GNPD_RANGE_PART, 90, 10);
	check("bytes=90-", GNPD_RANGE_PART, 90, 10);
	check("bytes=-5", GNPD_RANGE_PART, 95, 5);
	check("bytes=-500", GNPD_RANGE_PART, 0, 100);
	check("bytes=5-99999999999999999999999", GNPD_RANGE_PART, 5, 95);
	check("bytes=100-", GNPD_RANGE_OUTSIDE, 0, 0);
	check("bytes=99999999999999999999999-", GNPD_RANGE_OUTSIDE, 0, 0);
	check("bytes=-0", GNPD_RANGE_OUTSIDE, 0, 0);
	static const char *const ignored[] = {NULL, "", "bytes", "bytes=", "bytes=-", "bytes=9-3", "bytes=0-1,4-5", "rows=0-1", "bytes=a-b",
	                                      "bytes= 0-1", "bytes=0-1 "};
	for (size_t i = 0; i < sizeof ignored / sizeof ignored[0]; i++)
		check(ignored[i], GNPD_RANGE_WHOLE, 0, 0);
	size_t first, count;
	CHECK(gnpd_range_parse("bytes=0-", 0, &first, &count) == GNPD_RANGE_OUTSIDE);
}

static void durations(void)
{
	static const struct {
		const char *text;
		double seconds;
	} good[] = {{"30", 30}, {"30s", 30}, {"0.5s", 0.5}, {"500ms", 0.5}, {"250us", 250e-6}, {"2m", 120}, {"1h", 3600}, {"0", 0}, {"1e3", 1000}};
	static const char *const bad[] = {"", "s", "-1", "-1s", "nan", "inf", "30 s", "30d", "30ss", "1e300", "1e9h", "0x10"};
	for (size_t i = 0; i < sizeof good / sizeof good[0]; i++) {
		double seconds = -1;
		CHECK(gnpd_duration_parse("wait", good[i].text, &seconds, NULL) == GNP_OK);
		CHECK_NEAR(seconds, good[i].seconds, 1e-12);
	}
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
		double seconds = -1;
		struct gnp_error error = {0};
		CHECK(gnpd_duration_parse("wait", bad[i], &seconds, &error) == GNP_INVALID_ARGUMENT && seconds == -1);
		CHECK_CONTAINS(error.text, "wait: got \"");
	}
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(ranges), TEST(durations)};
	return RUN_TESTS(tests);
}
