/* Numbers as text. Oracles: the C library's strtod and printf. */
#include "tests/unit/test.h"

#include <stdint.h>

#include "proto/tensor/number.h"

static uint64_t next_random(uint64_t *state)
{
	*state ^= *state << 13;
	*state ^= *state >> 7;
	*state ^= *state << 17;
	return *state;
}

static double any_double(uint64_t bits, int kind)
{
	double value;
	memcpy(&value, &bits, sizeof value);
	if (kind == 1)
		return (double)(int64_t)bits / 1e18;
	return kind == 2 ? round((double)(bits >> 40) * 1e3) / 1e6 : value;
}

static void doubles_survive_writing_and_reading(void)
{
	uint64_t state = 88172645463325252u;
	int wrong = 0;
	for (int i = 0; i < 200000; i++) {
		double value = any_double(next_random(&state), i % 3), back = 0, own = 0;
		char text[GNP_NUMBER_LENGTH_MAX + 1];
		if (!isfinite(value))
			continue;
		size_t length = gnp_number_write_double(text, value);
		text[length] = '\0';
		back = strtod(text, NULL);
		wrong += gnp_number_read(text, text + length, &own) != text + length || back != value || own != value;
	}
	CHECK(wrong == 0);
}

static void floats_survive_writing_and_reading(void)
{
	uint64_t state = 1234567;
	int wrong = 0;
	for (int i = 0; i < 200000; i++) {
		uint32_t bits = (uint32_t)(next_random(&state) >> 32);
		float value;
		double own = 0;
		char text[GNP_NUMBER_LENGTH_MAX + 1];
		memcpy(&value, &bits, sizeof value);
		if (!isfinite(value))
			continue;
		size_t length = gnp_number_write_float(text, value);
		text[length] = '\0';
		wrong += strtof(text, NULL) != value || !gnp_number_read(text, text + length, &own) || (float)own != value;
	}
	CHECK(wrong == 0);
}

static void reading_is_correctly_rounded(void)
{
	uint64_t state = 42;
	int wrong = 0;
	for (int i = 0; i < 200000; i++) {
		double value = any_double(next_random(&state), i % 3), own = 0;
		char text[64];
		if (!isfinite(value))
			continue;
		snprintf(text, sizeof text, "%.*e", i % 25, value);
		wrong += !gnp_number_read(text, text + strlen(text), &own) || own != strtod(text, NULL);
	}
	CHECK(wrong == 0);
}

static void hard_cases_read_as_strtod_does(void)
{
	static const char *const texts[] = {"9007199254740993",     "9007199254740993.0000000000000000000000001", "1e23",
	                                    "8.5e-324",             "2.4703282292062328e-324",                   "1.7976931348623158e308",
	                                    "179769313486231580793e289", "0.000000000000000000000000000000000000001", "1e400",
	                                    "-1e-400", "7.2057594037927933e16", "100000000000000016777215", "0e999999999999"};
	for (size_t i = 0; i < sizeof texts / sizeof texts[0]; i++) {
		double value = -7;
		CHECK(gnp_number_read(texts[i], texts[i] + strlen(texts[i]), &value) != NULL);
		if (value != strtod(texts[i], NULL))
			CHECK_STRING("not as strtod", texts[i]);
	}
}

static void shortest_forms(void)
{
	static const struct {
		double value;
		const char *text;
	} cases[] = {{0.1, "0.1"}, {1, "1"}, {-2.5, "-2.5"}, {1e16, "1e+16"}, {123456, "123456"}, {1e-7, "1e-07"}, {0.00001, "1e-05"},
	             {0, "0"}, {-0.0, "-0"}, {5e-324, "5e-324"}, {1.5e300, "1.5e+300"}, {0.30000000000000004, "0.30000000000000004"}};
	char text[GNP_NUMBER_LENGTH_MAX + 1];
	for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
		text[gnp_number_write_double(text, cases[i].value)] = '\0';
		if (strtod(text, NULL) != cases[i].value || strlen(text) > strlen(cases[i].text) + 2)
			CHECK_STRING(text, cases[i].text);
	}
	text[gnp_number_write_float(text, 0.1f)] = '\0';
	CHECK_STRING(text, "0.1");
	text[gnp_number_write_float(text, 16777216.0f)] = '\0';
	CHECK_STRING(text, "16777216");
	text[gnp_number_write_double(text, NAN)] = '\0';
	CHECK_STRING(text, "nan");
	text[gnp_number_write_float(text, -INFINITY)] = '\0';
	CHECK_STRING(text, "-inf");
}

static void json_takes_only_its_own_numbers(void)
{
	static const char *const bad[] = {"+1", "01", ".5", "5.", "-", "nan", "inf", "1.e3", "1e", "", "-.5", "0x10e"};
	for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
		double value;
		const char *after = gnp_number_read_json(bad[i], bad[i] + strlen(bad[i]), &value);
		if (after && *after == '\0')
			CHECK_STRING("taken", bad[i]);
	}
	double value = 0;
	const char *good = "-0.25e+2,";
	CHECK(gnp_number_read_json(good, good + 9, &value) == good + 8);
	CHECK_NEAR(value, -25, 0);
}

static void a_number_ends_where_the_text_does(void)
{
	double value = 0;
	const char *text = "123456";
	CHECK(gnp_number_read(text, text + 3, &value) == text + 3);
	CHECK_NEAR(value, 123, 0);
	CHECK(gnp_number_read(text, text, &value) == NULL);
	const char *words = "-Infinity";
	CHECK(gnp_number_read(words, words + 9, &value) == words + 9);
	CHECK(value < 0 && isinf(value));
	CHECK(gnp_number_read(words + 1, words + 3, &value) == NULL);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(doubles_survive_writing_and_reading),
	                                    TEST(floats_survive_writing_and_reading),
	                                    TEST(reading_is_correctly_rounded),
	                                    TEST(hard_cases_read_as_strtod_does),
	                                    TEST(shortest_forms),
	                                    TEST(json_takes_only_its_own_numbers),
	                                    TEST(a_number_ends_where_the_text_does)};
	return RUN_TESTS(tests);
}
