#include "core/search/order.h"

#include "tests/unit/test.h"

static uint64_t random_state = 1;

static double uniform(void)
{
	random_state = random_state * 6364136223846793005u + 1442695040888963407u;
	return (double)(random_state >> 11) * 0x1p-53;
}

static bool is_permutation(const uint32_t *order, size_t count)
{
	unsigned char *seen = calloc(count + 1, 1);
	bool good = true;
	for (size_t i = 0; i < count && good; i++) {
		good = order[i] < count && !seen[order[i]];
		if (good)
			seen[order[i]] = 1;
	}
	free(seen);
	return good;
}

/* The curve's defining property: it visits every cell of a grid and always steps to a cell that shares a face. */
static void curve_steps_from_cell_to_adjacent_cell(void)
{
	enum { EDGE = 16, COUNT = EDGE * EDGE * EDGE };
	double *points = malloc(3 * COUNT * sizeof *points);
	uint32_t *order = malloc(COUNT * sizeof *order);
	/* Cell corners, so that the bounding cube falls into EDGE cells an axis: the last lies within its cell's far corner. */
	for (int i = 0; i < COUNT; i++) {
		int cell[3] = {i % EDGE, i / EDGE % EDGE, i / EDGE / EDGE};
		for (int c = 0; c < 3; c++)
			points[3 * i + c] = cell[c] + (cell[c] == EDGE - 1 ? 1.0 : 0.5) * (cell[c] > 0);
	}
	CHECK(gnp_order_compute(points, COUNT, order, NULL) == GNP_OK);
	CHECK(is_permutation(order, COUNT));
	int jumps = 0;
	for (int i = 1; i < COUNT; i++) {
		int distance = 0, a = (int)order[i - 1], b = (int)order[i];
		for (int c = 0, size = 1; c < 3; c++, size *= EDGE)
			distance += abs(a / size % EDGE - b / size % EDGE);
		jumps += distance != 1;
	}
	CHECK(jumps == 0);
	free(points);
	free(order);
}

/* On random points: consecutive ones are near each other, and scale and place make no difference. */
static void order_is_local_at_any_scale_and_place(void)
{
	enum { COUNT = 20000 };
	double *points = malloc(3 * COUNT * sizeof *points), *moved = malloc(3 * COUNT * sizeof *moved), sum = 0;
	uint32_t *order = malloc(COUNT * sizeof *order), *again = malloc(COUNT * sizeof *again);
	static const double scales[] = {0x1p-300, 0x1p-10, 0x1p20, 0x1p300};
	for (int i = 0; i < 3 * COUNT; i++)
		points[i] = uniform();
	CHECK(gnp_order_compute(points, COUNT, order, NULL) == GNP_OK);
	CHECK(is_permutation(order, COUNT));
	for (int i = 1; i < COUNT; i++) {
		const double *a = points + 3 * (size_t)order[i - 1], *b = points + 3 * (size_t)order[i];
		sum += sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]));
	}
	CHECK_AT_MOST(sum / COUNT, 1.5 * cbrt(1.0 / COUNT));
	for (size_t s = 0; s < sizeof scales / sizeof *scales; s++) {
		for (int i = 0; i < 3 * COUNT; i++)
			moved[i] = points[i] * scales[s];
		CHECK(gnp_order_compute(moved, COUNT, again, NULL) == GNP_OK);
		CHECK(memcmp(order, again, COUNT * sizeof *order) == 0);
	}
	free(points);
	free(moved);
	free(order);
	free(again);
}

/* Regression: one far point pressed all the others into a few cells, in whatever order they came. */
static void far_outliers_leave_the_others_in_curve_order(void)
{
	enum { COUNT = 20000, FAR = 20, ALL = COUNT + FAR };
	double *points = malloc(3 * ALL * sizeof *points);
	uint32_t *with_far = malloc(ALL * sizeof *with_far);
	static const double distances[] = {1e6, -1e300};
	for (int i = 0; i < 3 * COUNT; i++)
		points[i] = uniform();
	for (size_t d = 0; d < 2; d++) {
		double sum = 0;
		for (int i = 3 * COUNT; i < 3 * ALL; i++)
			points[i] = distances[d] * (1 + uniform());
		CHECK(gnp_order_compute(points, ALL, with_far, NULL) == GNP_OK);
		CHECK(is_permutation(with_far, ALL));
		for (int i = 1; i < ALL; i++) {
			const double *a = points + 3 * (size_t)with_far[i - 1], *b = points + 3 * (size_t)with_far[i];
			if (with_far[i - 1] < COUNT && with_far[i] < COUNT)
				sum += sqrt((a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]));
		}
		CHECK_AT_MOST(sum / COUNT, 1.5 * cbrt(1.0 / COUNT));
	}
	free(points);
	free(with_far);
}

static void ties_keep_the_callers_order(void)
{
	enum { COUNT = 5000 };
	double *points = malloc(3 * COUNT * sizeof *points);
	uint32_t *order = malloc(COUNT * sizeof *order);
	for (int i = 0; i < COUNT; i++)
		for (int c = 0; c < 3; c++)
			points[3 * i + c] = i % 7 * (c + 1) % 5;
	CHECK(gnp_order_compute(points, COUNT, order, NULL) == GNP_OK);
	CHECK(is_permutation(order, COUNT));
	int changes = 0;
	for (int i = 1; i < COUNT; i++) {
		bool same = memcmp(points + 3 * (size_t)order[i], points + 3 * (size_t)order[i - 1], 3 * sizeof *points) == 0;
		changes += !same;
		CHECK(!same || order[i] > order[i - 1]);
	}
	CHECK(changes <= 6); /* each place is visited once */
	for (int i = 0; i < 3 * COUNT; i++)
		points[i] = 4;
	CHECK(gnp_order_compute(points, COUNT, order, NULL) == GNP_OK);
	for (uint32_t i = 0; i < COUNT; i++)
		CHECK(order[i] == i);
	free(points);
	free(order);
}

static void extreme_and_empty_clouds_are_ordered(void)
{
	static const double points[] = {-1e100, 1e100, 0, 1e100, -1e100, 0, 0, 0, 1e100, 1, 2, 3, -1e-300, 0, 5e-324};
	uint32_t order[5];
	CHECK(gnp_order_compute(points, 5, order, NULL) == GNP_OK);
	CHECK(is_permutation(order, 5));
	CHECK(gnp_order_compute(points + 12, 1, order, NULL) == GNP_OK);
	CHECK(order[0] == 0);
	static const double smallest[] = {0, 0, 0, 5e-324, 0, 0};
	CHECK(gnp_order_compute(smallest, 2, order, NULL) == GNP_OK);
	CHECK(is_permutation(order, 2));
	CHECK(gnp_order_compute(NULL, 0, order, NULL) == GNP_OK);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(curve_steps_from_cell_to_adjacent_cell),
		TEST(order_is_local_at_any_scale_and_place),
		TEST(far_outliers_leave_the_others_in_curve_order),
		TEST(ties_keep_the_callers_order),
		TEST(extreme_and_empty_clouds_are_ordered),
	};
	return RUN_TESTS(tests);
}
