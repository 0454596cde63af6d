#include "core/base/random.h"
#include "core/cloud/farthest.h"
#include "tests/unit/test.h"

static void random_points(double *points, size_t count)
{
	struct gnp_random random;
	gnp_random_seed(&random, 3, 0);
	for (size_t i = 0; i < 3 * count; i++)
		points[i] = gnp_random_normal(&random);
}

static double square_between(const double *a, const double *b)
{
	return (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]);
}

/* The definition, with a loop over all points for each choice. */
static void choose_plainly(const double *points, size_t count, const unsigned char *excluded, size_t wanted, unsigned char *chosen)
{
	double mean[3] = {0}, *square = malloc(count * sizeof *square);
	for (size_t i = 0; i < 3 * count; i++)
		mean[i % 3] += points[i] / (double)count;
	memset(chosen, 0, count);
	for (size_t k = 0; k < wanted; k++) {
		size_t best = count;
		for (size_t i = 0; i < count; i++) {
			square[i] = k == 0 ? square_between(points + 3 * i, mean) : square[i];
			if (!(excluded && excluded[i]) && (best == count || square[i] > square[best]))
				best = i;
		}
		chosen[best] = 1;
		for (size_t i = 0; i < count; i++)
			square[i] = fmin(k == 0 ? INFINITY : square[i], square_between(points + 3 * i, points + 3 * best));
	}
	free(square);
}

static void chooses_what_the_definition_does(void)
{
	enum { COUNT = 1003 };
	double points[3 * COUNT];
	unsigned char got[COUNT], want[COUNT], excluded[COUNT];
	random_points(points, COUNT);
	for (int i = 0; i < COUNT; i++)
		excluded[i] = i % 3 == 0;
	for (size_t wanted = 1; wanted < 200; wanted += 49) {
		CHECK(gnp_farthest_choose(points, COUNT, NULL, wanted, NULL, got, NULL) == GNP_OK);
		choose_plainly(points, COUNT, NULL, wanted, want);
		CHECK(memcmp(got, want, COUNT) == 0);
		CHECK(gnp_farthest_choose(points, COUNT, excluded, wanted, NULL, got, NULL) == GNP_OK);
		choose_plainly(points, COUNT, excluded, wanted, want);
		CHECK(memcmp(got, want, COUNT) == 0);
	}
}

static void places_run_out_before_points_do(void)
{
	double points[3 * 20];
	unsigned char chosen[20];
	size_t count = 0;
	for (int i = 0; i < 60; i++)
		points[i] = i / 3 % 4;
	CHECK(gnp_farthest_choose(points, 20, NULL, 9, NULL, chosen, NULL) == GNP_OK);
	for (int i = 0; i < 20; i++)
		count += chosen[i];
	CHECK(count == 4);
	CHECK(gnp_farthest_choose(points, 20, NULL, 0, NULL, chosen, NULL) == GNP_OK);
	CHECK(chosen[0] == 0);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(chooses_what_the_definition_does), TEST(places_run_out_before_points_do)};
	return RUN_TESTS(tests);
}
