#include "thin.h"

#include "random.h"
#include "test.h"

enum { COUNT = 1500 };

/* The definition, every pair. */
static size_t thinned_plainly(const double *points, double distance, const uint32_t *order, size_t certain, unsigned char *keep)
{
	size_t kept = 0;
	uint32_t list[COUNT];
	for (size_t i = 0; i < COUNT; i++) {
		size_t at = order ? order[i] : i;
		bool room = true;
		for (size_t j = 0; j < kept && room && i >= certain; j++) {
			const double *p = points + 3 * at, *q = points + 3 * (size_t)list[j];
			double x = p[0] - q[0], y = p[1] - q[1], z = p[2] - q[2];
			room = x * x + y * y + z * z >= distance * distance;
		}
		keep[at] = room;
		if (room)
			list[kept++] = (uint32_t)at;
	}
	return kept;
}

static void check(const double *points, double distance, const uint32_t *order, size_t certain)
{
	unsigned char keep[COUNT], plain[COUNT];
	size_t kept;
	CHECK(gnp_thin(points, COUNT, distance, order, certain, NULL, keep, &kept, NULL) == GNP_OK);
	CHECK(kept == thinned_plainly(points, distance, order, certain, plain));
	CHECK(memcmp(keep, plain, COUNT) == 0);
}

static void points_that_stay_are_those_of_the_definition(void)
{
	static double points[3 * COUNT];
	static uint32_t backwards[COUNT];
	struct gnp_random random;
	static const double offsets[] = {0, -3, 1e6}, distances[] = {1e-9, 0.05, 0.3, 5};
	for (size_t i = 0; i < COUNT; i++)
		backwards[i] = (uint32_t)(COUNT - 1 - i);
	for (size_t o = 0; o < 3; o++)
		for (size_t d = 0; d < 4; d++) {
			gnp_random_seed(&random, 3, o);
			for (size_t i = 0; i < 3 * COUNT; i++)
				points[i] = offsets[o] + gnp_random_uniform(&random);
			memcpy(points + 30, points, 30 * sizeof *points); /* ten doubled */
			check(points, distances[d], NULL, 0);
			check(points, distances[d], backwards, 200);
		}
}

static void far_and_tiny_does_not_overflow(void)
{
	static double points[3 * COUNT];
	for (size_t i = 0; i < 3 * COUNT; i++)
		points[i] = (i % 6 < 3 ? -1e100 : 1e100) / (double)(1 + i / 6);
	check(points, 1e-300, NULL, 0);
	check(points, 1e90, NULL, 0);
}

static void thinning_is_cancelled(void)
{
	static double points[3 * COUNT];
	unsigned char keep[COUNT];
	size_t kept;
	struct gnp_task task;
	gnp_task_init(&task);
	gnp_task_cancel(&task);
	CHECK(gnp_thin(points, COUNT, 1, NULL, 0, &task, keep, &kept, NULL) == GNP_CANCELLED);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(points_that_stay_are_those_of_the_definition), TEST(far_and_tiny_does_not_overflow),
	                                    TEST(thinning_is_cancelled)};
	return RUN_TESTS(tests);
}
