/* Freed memory goes back once there has been nothing to do for a while, and not before. */
#include <malloc.h>

#include "server/base/heap.h"
#include "tests/unit/test.h"

/* A sanitizer has a heap of its own. */
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
enum { MEASURED = 0 };
#else
enum { MEASURED = 1 };
#endif

/* Free bytes below a piece in use, which no threshold gives back. */
static void *make_holes(void)
{
	enum { PIECES = 4096, SIZE = 16384 };
	static void *pieces[PIECES];
	for (size_t i = 0; i < PIECES; i++)
		memset(pieces[i] = malloc(SIZE), 1, SIZE);
	void *last = malloc(64);
	for (size_t i = 0; i < PIECES; i++)
		free(pieces[i]);
	return last;
}

static double resident_megabytes(void)
{
	long all = 0, resident = 0;
	FILE *file = fopen("/proc/self/statm", "r");
	CHECK(file && fscanf(file, "%ld %ld", &all, &resident) == 2);
	fclose(file);
	return (double)resident * 4096e-6;
}

static void memory_goes_back_after_a_rest(void)
{
	struct gnpd_heap heap = {0};
	double before = resident_megabytes();
	void *last = make_holes();
	gnpd_heap_rest(&heap, 7, false, 100); /* work was done since */
	gnpd_heap_rest(&heap, 7, false, 100 + GNPD_HEAP_REST - 0.1);
	CHECK(!heap.given_back);
	CHECK(!MEASURED || resident_megabytes() > before + 50);
	gnpd_heap_rest(&heap, 7, false, 100 + GNPD_HEAP_REST + 0.1);
	CHECK(heap.given_back);
	CHECK(!MEASURED || resident_megabytes() < before + 20);
	free(last);
}

static void work_begins_the_wait_anew(void)
{
	struct gnpd_heap heap = {.work = 3, .since = 10, .given_back = true};
	gnpd_heap_rest(&heap, 3, true, 11);
	CHECK(!heap.given_back && heap.since == 11);
	gnpd_heap_rest(&heap, 4, false, 11 + 2 * GNPD_HEAP_REST);
	CHECK(!heap.given_back && heap.work == 4);
	gnpd_heap_rest(&heap, 4, true, 11 + 4 * GNPD_HEAP_REST);
	CHECK(!heap.given_back);
}

int main(int argc, char **argv)
{
	gnpd_heap_keep();
	static const struct test tests[] = {TEST(memory_goes_back_after_a_rest), TEST(work_begins_the_wait_anew)};
	return RUN_TESTS(tests);
}
