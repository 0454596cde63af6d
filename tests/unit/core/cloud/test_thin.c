#include "core/cloud/thin.h"

#include "core/base/random.h"
#include "tests/unit/test.h"

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
			room = hypot(hypot(x, y), z) >= distance;
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

/* Squares of such distances are zero, and doubles so small lose digits: doubled points all stayed. */
static void doubled_points_go_however_small_the_distance(void)
{
	static double points[3 * COUNT];
	for (size_t i = 0; i < 3 * COUNT; i++)
		points[i] = i < 3 * COUNT / 2 ? sin((double)i) : points[i - 3 * COUNT / 2];
	check(points, 1e-200, NULL, 0);
	check(points, 5e-324, NULL, 0);
	check(points, 1e-200, NULL, COUNT / 4);
	for (size_t i = 0; i < 3 * COUNT; i++)
		points[i] *= 1e-200;
	check(points, 1e-201, NULL, 0);
}

/* About the numbers of cubes where doubles stop telling neighbouring ones apart. */
static void cubes_far_out_are_neighbours_still(void)
{
	static double points[3 * COUNT];
	for (int power = 51; power <= 55; power++)
		for (size_t d = 0; d < 3; d++) {
			for (size_t i = 0; i < COUNT; i++) {
				double x = ldexp(d == 1 ? -1 : 1, power), step = nextafter(fabs(x), INFINITY) - fabs(x);
				points[3 * i] = x + (d == 2 ? 0.25 : 1) * step * (double)(i % 40) - 20 * step;
				points[3 * i + 1] = (double)(i / 40 % 7) * 0.3;
				points[3 * i + 2] = (double)(i / 280) * 0.4 - 1;
			}
			check(points, 1, NULL, 0);
			check(points, 0.77, NULL, 0);
		}
}

static void points_just_as_far_apart_stay(void)
{
	static double points[3 * COUNT];
	size_t kept;
	unsigned char keep[COUNT];
	for (size_t i = 0; i < COUNT; i++) {
		points[3 * i] = 3 * (double)(i % 10) - 1e6;
		points[3 * i + 1] = 3 * (double)(i / 10 % 15);
		points[3 * i + 2] = 3 * (double)(i / 150);
	}
	CHECK(gnp_thin(points, COUNT, 3, NULL, 0, NULL, keep, &kept, NULL) == GNP_OK && kept == COUNT);
	CHECK(gnp_thin(points, COUNT, nextafter(3, 4), NULL, 0, NULL, keep, &kept, NULL) == GNP_OK && kept == COUNT / 2);
	CHECK(gnp_thin(points, COUNT, 1e9, NULL, 0, NULL, keep, &kept, NULL) == GNP_OK && kept == 1 && keep[0]);
	CHECK(gnp_thin(points, COUNT, 1e9, NULL, 70, NULL, keep, &kept, NULL) == GNP_OK && kept == 70 && keep[69]);
	CHECK(gnp_thin(points, 0, 1, NULL, 0, NULL, keep, &kept, NULL) == GNP_OK && kept == 0);
}

/* All points fell into one cube, each compared with all others, where the distance is tiny or one of them far away. */
static void tiny_distances_and_far_points_take_no_longer(void)
{
	enum { MANY = 100000 };
	double *points = malloc(3 * MANY * sizeof *points), begun = gnp_clock();
	unsigned char *keep = malloc(MANY);
	struct gnp_random random;
	size_t kept;
	gnp_random_seed(&random, 4, 0);
	for (size_t i = 0; i < 3 * MANY; i++)
		points[i] = gnp_random_uniform(&random);
	CHECK(gnp_thin(points, MANY, 1e-20, NULL, 0, NULL, keep, &kept, NULL) == GNP_OK && kept == MANY);
	CHECK(gnp_thin(points, MANY, 1e-300, NULL, 0, NULL, keep, &kept, NULL) == GNP_OK && kept == MANY);
	points[0] = points[1] = points[2] = -1e15;
	CHECK(gnp_thin(points, MANY, 1e-5, NULL, 0, NULL, keep, &kept, NULL) == GNP_OK && kept == MANY);
	for (size_t i = 0; i < 3 * MANY; i++)
		points[i] = floor(40 * points[i]); /* few bits set */
	CHECK(gnp_thin(points, MANY, 1e-20, NULL, 0, NULL, keep, &kept, NULL) == GNP_OK && kept > 40000 && kept <= 64001);
	CHECK_AT_MOST(gnp_clock() - begun, 4);
	free(points);
	free(keep);
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
	                                    TEST(doubled_points_go_however_small_the_distance), TEST(cubes_far_out_are_neighbours_still),
	                                    TEST(points_just_as_far_apart_stay), TEST(tiny_distances_and_far_points_take_no_longer),
	                                    TEST(thinning_is_cancelled)};
	return RUN_TESTS(tests);
}
