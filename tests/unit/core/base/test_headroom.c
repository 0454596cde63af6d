/* The question before a library that crashes without memory: what the program itself answers, and what a guard does. */
#include "core/base/headroom.h"

#include <stdint.h>

#include "tests/unit/test.h"

static unsigned asked;
static bool open_gate;

static bool gate(void)
{
	asked++;
	return open_gate;
}

static void more_than_there_is_is_refused(void)
{
	struct gnp_error error = {0};
	CHECK(gnp_headroom_need("test", 0, &error) == GNP_OK);
	CHECK(gnp_headroom_need("test", 1 << 20, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
#if !defined __SANITIZE_ADDRESS__ && !defined __SANITIZE_THREAD__ /* they end the process for that */
	CHECK(gnp_headroom_need("test", SIZE_MAX / 4, &error) == GNP_OUT_OF_MEMORY);
	CHECK_STRING(error.text, "test: no memory for 4611686018427387903 bytes");
#endif
}

static void a_guard_is_asked_each_time(void)
{
	struct gnp_error error = {0};
	gnp_headroom_install(gate);
	CHECK(gnp_headroom_need("test", 12, &error) == GNP_OUT_OF_MEMORY && asked == 1);
	CHECK_STRING(error.text, "test: no memory for 12 bytes");
	open_gate = true;
	CHECK(gnp_headroom_need("test", 12, NULL) == GNP_OK && asked == 2);
	gnp_headroom_install(NULL);
	open_gate = false;
	CHECK(gnp_headroom_need("test", 12, NULL) == GNP_OK && asked == 2);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(more_than_there_is_is_refused), TEST(a_guard_is_asked_each_time)};
	return RUN_TESTS(tests);
}
