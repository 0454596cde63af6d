#include "core/cells/queue.h"
#include "core/base/vector.h"
#include "tests/unit/test.h"

/* Offers that lower keys, in an order as if drawn, and points that are queued again once they were taken. */
static void the_least_comes_first(void)
{
	enum { COUNT = 1000 };
	static double key[COUNT], sorted[COUNT];
	struct gnp_queue queue;
	CHECK(gnp_queue_init(&queue, key, COUNT, "points", NULL) == GNP_OK);
	for (size_t i = 0; i < COUNT; i++)
		CHECK(isinf(key[i]) && gnp_queue_offer(&queue, (uint32_t)i, (double)(i * 7919 % 5003)));
	for (size_t i = 0; i < COUNT; i += 3)
		CHECK(gnp_queue_offer(&queue, (uint32_t)i, key[i] / 2 - 1) &&
		      !gnp_queue_offer(&queue, (uint32_t)i, key[i] + 1));
	CHECK(queue.used == COUNT);
	memcpy(sorted, key, sizeof sorted);
	qsort(sorted, COUNT, sizeof *sorted, gnp_double_compare);
	for (size_t i = 0; i < COUNT; i++) {
		uint32_t point = gnp_queue_take(&queue);
		CHECK(key[point] == sorted[i]);
	}
	CHECK(queue.used == 0);
	CHECK(gnp_queue_offer(&queue, 5, -9) && gnp_queue_offer(&queue, 6, -8));
	CHECK(gnp_queue_take(&queue) == 5 && gnp_queue_take(&queue) == 6 && queue.used == 0);
	gnp_queue_clear(&queue);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(the_least_comes_first)};
	return RUN_TESTS(tests);
}
