#include "core/cloud/isolated.h"

#include "core/base/random.h"
#include "core/base/vector.h"
#include "core/linear/pca.h"
#include "tests/unit/test.h"

enum { MOST = 4000, NEAR = 17 };
static struct gnp_pool *pool;
static double points[3 * MOST];
static unsigned char isolated[MOST];
static double away[MOST];

/* A spiral on a sphere; about 3.54 / sqrt(count) radii apart. */
static void sphere(double *out, size_t count, double radius, double x)
{
	for (size_t i = 0; i < count; i++) {
		double z = 1 - (2 * (double)i + 1) / (double)count, r = sqrt(1 - z * z), turn = 2.399963229728653 * (double)i;
		out[3 * i] = x + radius * r * cos(turn);
		out[3 * i + 1] = radius * r * sin(turn);
		out[3 * i + 2] = radius * z;
	}
}

/* A flat disk of points `apart` from each other. */
static void disk(double *out, size_t count, double apart, double x)
{
	for (size_t i = 0; i < count; i++) {
		double r = apart * sqrt(((double)i + 0.5) / acos(-1)), turn = 2.399963229728653 * (double)i;
		out[3 * i] = x + r * cos(turn);
		out[3 * i + 1] = r * sin(turn);
		out[3 * i + 2] = 0;
	}
}

/* Finds isolated points with the results in the cloud's order. */
static size_t found_by(struct gnp_pool *workers, size_t count, double link, size_t cluster)
{
	struct gnp_prepared prepared;
	static unsigned char mark[MOST];
	static double gap[MOST];
	size_t isolated_count = SIZE_MAX, marked = 0;
	CHECK(gnp_prepare_points(&(struct gnp_cloud){count, points, NULL}, NULL, &prepared, NULL) == GNP_OK);
	CHECK(gnp_isolated_find(&prepared, link, cluster, workers, NULL, mark, gap, &isolated_count, NULL) == GNP_OK);
	for (size_t i = 0; i < count; i++) {
		isolated[prepared.order[i]] = mark[i];
		away[prepared.order[i]] = gap[i];
		marked += mark[i];
		CHECK(mark[i] ? gap[i] >= 0 && gap[i] <= 1e100 : gap[i] == 0);
	}
	CHECK(marked == isolated_count);
	gnp_prepared_clear(&prepared);
	return isolated_count;
}

static size_t found(size_t count, double link, size_t cluster)
{
	return found_by(pool, count, link, cluster);
}

/* ---- The definition, every pair ---- */

struct entry {
	double distance;
	uint32_t index;
};

static int compare(const void *a, const void *b)
{
	const struct entry *x = a, *y = b;
	return x->distance != y->distance ? (x->distance > y->distance) - (x->distance < y->distance) : (x->index > y->index) - (x->index < y->index);
}

static int ascending(const void *a, const void *b)
{
	return gnp_double_compare(a, b);
}

static double between(size_t i, size_t j)
{
	const double *p = points + 3 * i, *q = points + 3 * j, d[3] = {p[0] - q[0], p[1] - q[1], p[2] - q[2]};
	return sqrt(gnp_dot(d, d));
}

static void found_plainly(size_t count, double link, size_t cluster, unsigned char *mark, double *gap)
{
	static struct entry all[MOST];
	static uint32_t near[MOST][NEAR], piece[MOST];
	static double own[MOST], spacing[MOST], bulk[MOST];
	for (size_t i = 0; i < count; i++) {
		struct gnp_pca pca;
		for (size_t j = 0; j < count; j++)
			all[j] = (struct entry){between(i, j), (uint32_t)j};
		qsort(all, count, sizeof *all, compare);
		for (size_t j = 0; j < NEAR; j++)
			near[i][j] = all[j].index;
		own[i] = all[6].distance / sqrt(6 / acos(-1));
		piece[i] = (uint32_t)i;
		gnp_pca_fit(points, near[i], NEAR, &pca);
		bulk[i] = pca.values[2] / (pca.values[0] + pca.values[1] + pca.values[2]);
	}
	for (size_t i = 0; i < count; i++) {
		double values[NEAR];
		for (size_t j = 0; j < NEAR; j++)
			values[j] = own[near[i][j]];
		qsort(values, NEAR, sizeof *values, ascending);
		spacing[i] = values[NEAR / 2];
	}
	for (bool changed = true; changed;) {
		changed = false;
		for (size_t i = 0; i < count; i++)
			for (size_t j = 0; j < NEAR; j++) {
				size_t other = near[i][j];
				if (piece[i] == piece[other] || !(between(i, other) <= link * fmin(spacing[i], spacing[other])))
					continue;
				piece[i] = piece[other] = piece[i] < piece[other] ? piece[i] : piece[other];
				changed = true;
			}
	}
	size_t largest = 0;
	static size_t size[MOST];
	static double sum[MOST];
	memset(size, 0, sizeof size);
	memset(sum, 0, sizeof sum);
	for (size_t i = 0; i < count; i++) {
		sum[piece[i]] += bulk[i];
		largest = ++size[piece[i]] > largest ? size[piece[i]] : largest;
	}
	for (size_t i = 0; i < count; i++) {
		size_t members = size[piece[i]];
		mark[i] = members < largest && (members < cluster || sum[piece[i]] > 0.1 * (double)members);
	}
	for (size_t i = 0; i < count; i++) {
		gap[i] = mark[i] ? INFINITY : 0;
		for (size_t j = 0; j < count && mark[i]; j++)
			gap[i] = mark[j] ? gap[i] : fmin(gap[i], between(i, j) / spacing[i]);
	}
}

static void check_definition(size_t count, double link, size_t cluster)
{
	static unsigned char mark[MOST];
	static double gap[MOST];
	size_t isolated_count = found(count, link, cluster);
	found_plainly(count, link, cluster, mark, gap);
	CHECK(memcmp(mark, isolated, count) == 0);
	CHECK(isolated_count > 20 && isolated_count < count - 20);
	for (size_t i = 0; i < count; i++)
		CHECK_NEAR(away[i], gap[i], 1e-12 * (1 + gap[i]));
}

static void strays_are_those_of_the_definition(void)
{
	struct gnp_random random;
	gnp_random_seed(&random, 5, 0);
	for (size_t c = 0; c < 3; c++) {
		sphere(points, 500, 1, 0);
		sphere(points + 1500, 60, 0.2, 3);
		for (size_t i = 3 * 560; i < 3 * 800; i++)
			points[i] = 3 * gnp_random_uniform(&random) - 1.5;
		check_definition(800, 1.2 + 0.4 * (double)c, 30);
		check_definition(800, 1.2 + 0.4 * (double)c, 100);
	}
	for (size_t i = 0; i < 3 * 700; i++) /* no surface at all: pieces of all sizes */
		points[i] = gnp_random_uniform(&random);
	check_definition(700, 1, 20);
}

/* ---- What it is for ---- */

static void far_points_are_found_however_far(void)
{
	sphere(points, 2000, 1, 0);
	for (size_t i = 0; i < 7; i++)
		points[3 * (200 * i + 9)] = pow(10, (double)i);
	CHECK(found(2000, 3, 50) == 7);
	for (size_t i = 0; i < 7; i++)
		CHECK(isolated[200 * i + 9]);
	/* sixth neighbours of the spiral are about 1.5 spacings away */
	double h = sqrt(4 * acos(-1) / 2000), x = points[3 * 1209];
	CHECK_NEAR(away[1209] * h / x, 1, 0.2);
}

static void clusters_count_as_surfaces_from_their_least_size(void)
{
	double h = sqrt(4 * acos(-1) / 2000);
	sphere(points, 2000, 1, 0);
	for (size_t size = 49; size <= 50; size++) {
		disk(points + 6000, size, h, 4);
		CHECK(found(2000 + size, 3, 50) == (size < 50 ? size : 0));
		CHECK(isolated[2000] == (size < 50) && !isolated[0]);
	}
	/* as many points in a ball are no surface */
	struct gnp_random random;
	gnp_random_seed(&random, 6, 0);
	for (size_t i = 2000; i < 2200; i++)
		for (size_t c = 0; c < 3; c++)
			points[3 * i + c] = (c == 0 ? 4 : 0) + 2 * h * gnp_random_normal(&random);
	CHECK(found(2200, 3, 50) >= 195);
	CHECK(isolated[2000] && !isolated[1999]);
}

static void large_pieces_stay_though_apart(void)
{
	sphere(points, 3000, 1, 0);
	sphere(points + 9000, 200, 0.25, 1e6);
	CHECK(found(3200, 3, 100) == 0);
	CHECK(found(3200, 3, 201) == 200);
	CHECK(isolated[3000] && isolated[3199] && !isolated[0]);
}

/* The largest piece is the surface whatever its size; of two as large, both are. */
static void equal_sheets_both_stay(void)
{
	disk(points, 300, 0.1, 0);
	memcpy(points + 900, points, 900 * sizeof *points);
	for (size_t i = 300; i < 600; i++)
		points[3 * i + 2] = 5;
	CHECK(found(600, 3, 1000000) == 0);
	CHECK(found(599, 3, 1000000) == 299);
	CHECK(!isolated[0] && isolated[300]);
	memcpy(points + 900, points, 900 * sizeof *points); /* at one place */
	CHECK(found(600, 3, 1000000) == 0);
}

/* Distances were kept as floats, infinite at 1e39: nothing hung together, and nothing was isolated. */
static void units_and_places_do_not_matter(void)
{
	static const double scales[] = {1, 1e-3, 1e3, 1e50, 1e-50, 1e90}, places[] = {0, 0, 1e5, 0, 0, 0};
	for (size_t s = 0; s < 6; s++) {
		sphere(points, 1500, 1, 0);
		for (size_t i = 0; i < 30; i++)
			points[3 * (50 * i)] += 2 + 0.3 * (double)i;
		for (size_t i = 0; i < 3 * 1500; i++)
			points[i] = scales[s] * points[i] + places[s];
		CHECK(found(1500, 3, 50) == 30);
		for (size_t i = 0; i < 30; i++)
			CHECK(isolated[50 * i]);
	}
}

/* The spacing of nine or more points at one place was 0: they were linked with nothing else, and infinitely far from it. */
static void points_at_one_place_are_of_the_surface_there(void)
{
	for (size_t copies = 2; copies <= 29; copies++) {
		sphere(points, 1500, 1, 0);
		for (size_t i = 1; i < copies; i++)
			memcpy(points + 3 * (700 + i), points + 3 * 700, 3 * sizeof *points);
		CHECK(found(1500, 3, 50) == 0);
		for (size_t i = 0; i < copies; i++)
			points[3 * (700 + i)] = 1e20;
		CHECK(found(1500, 3, 50) == copies);
		CHECK(isolated[700] && away[700] > 0.5);
	}
	sphere(points, 187, 1, 0);
	for (size_t i = 1500; i-- > 0;) /* every point eight times, one twelve times */
		memcpy(points + 3 * i, points + 3 * (i / 8 < 187 ? i / 8 : 186), 3 * sizeof *points);
	CHECK(found(1500, 3, 50) == 0);
}

static void the_smallest_clouds_have_none(void)
{
	sphere(points, 20, 1, 0);
	for (size_t count = 1; count <= 20; count++)
		CHECK(found(count, 3, 1) == 0);
	memset(points, 0, sizeof points);
	CHECK(found(20, 3, 50) == 0);
	points[0] = 1;
	CHECK(found(2, 1, 50) <= 1);
}

static void bytes_do_not_depend_on_workers(void)
{
	static double gap[MOST];
	sphere(points, 4000, 1, 0);
	for (size_t i = 0; i < 600; i++)
		points[3 * (6 * i)] += 0.2 + 0.01 * (double)(i % 97);
	size_t isolated_count = found(4000, 1.5, 50);
	CHECK(isolated_count > 100 && isolated_count < 2000);
	memcpy(gap, away, sizeof gap);
	struct gnp_pool *one;
	CHECK(gnp_pool_create(1, &one, NULL) == GNP_OK);
	CHECK(found_by(one, 4000, 1.5, 50) == isolated_count);
	CHECK(memcmp(gap, away, sizeof gap) == 0);
	gnp_pool_free(one);
}

static void finding_is_cancelled(void)
{
	struct gnp_prepared prepared;
	struct gnp_task task;
	size_t isolated_count;
	sphere(points, 1000, 1, 0);
	CHECK(gnp_prepare_points(&(struct gnp_cloud){1000, points, NULL}, NULL, &prepared, NULL) == GNP_OK);
	gnp_task_init(&task);
	gnp_task_cancel(&task);
	CHECK(gnp_isolated_find(&prepared, 3, 50, pool, &task, isolated, away, &isolated_count, NULL) == GNP_CANCELLED);
	gnp_prepared_clear(&prepared);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(strays_are_those_of_the_definition),
	                                    TEST(far_points_are_found_however_far),
	                                    TEST(clusters_count_as_surfaces_from_their_least_size),
	                                    TEST(large_pieces_stay_though_apart),
	                                    TEST(equal_sheets_both_stay),
	                                    TEST(units_and_places_do_not_matter),
	                                    TEST(points_at_one_place_are_of_the_surface_there),
	                                    TEST(the_smallest_clouds_have_none),
	                                    TEST(bytes_do_not_depend_on_workers),
	                                    TEST(finding_is_cancelled)};
	CHECK(gnp_pool_create(2, &pool, NULL) == GNP_OK);
	int failed = RUN_TESTS(tests);
	gnp_pool_free(pool);
	return failed;
}
