#include "core/cells/boundary.h"

#include "core/base/random.h"
#include "core/cells/disk.h"
#include "tests/unit/test.h"

enum { MOST = 6000 };

static struct gnp_pool *pool;
static struct gnp_random random_;
static double points[3 * MOST], normals[3 * MOST];
static unsigned char rim[MOST]; /* in the caller's order */

static void set(size_t i, double x, double y, double z, double nx, double ny, double nz)
{
	const double p[3] = {x, y, z}, n[3] = {nx, ny, nz};
	memcpy(points + 3 * i, p, sizeof p);
	memcpy(normals + 3 * i, n, sizeof n);
}

static double draw(void)
{
	return gnp_random_uniform(&random_);
}

/* starts: outermost points are looked for first at one of so many. */
static double find(size_t count, size_t starts)
{
	struct gnp_prepared prepared;
	unsigned char own[MOST], candidate[MOST];
	double usual = 0;
	CHECK(gnp_prepare(&(struct gnp_cloud){count, points, normals}, pool, NULL, &prepared, NULL) == GNP_OK);
	CHECK(gnp_disk_usual(&prepared, pool, NULL, &usual, NULL) == GNP_OK);
	for (size_t i = 0; i < count; i++)
		candidate[i] = prepared.order[i] % starts == 0;
	CHECK(gnp_boundary_find(&prepared, usual, starts > 1 ? candidate : NULL, pool, NULL, own, NULL) == GNP_OK);
	for (size_t i = 0; i < count; i++)
		rim[prepared.order[i]] = own[i];
	gnp_prepared_clear(&prepared);
	return usual;
}

static size_t flagged(size_t begin, size_t end)
{
	size_t count = 0;
	for (size_t i = begin; i < end; i++)
		count += rim[i];
	return count;
}

static void set_grid(size_t side)
{
	for (size_t i = 0; i < side * side; i++)
		set(i, (double)(i % side), (double)(i / side), 0, 0, 0, 1);
}

static void the_rim_of_a_grid_is_its_outer_points(void)
{
	enum { SIDE = 30 };
	set_grid(SIDE);
	for (size_t starts = 1; starts <= 13; starts += 6) {
		find(SIDE * SIDE, starts);
		for (size_t i = 0; i < SIDE * SIDE; i++) {
			size_t x = i % SIDE, y = i / SIDE;
			CHECK(rim[i] == (x == 0 || y == 0 || x == SIDE - 1 || y == SIDE - 1));
		}
	}
}

static void set_square(size_t count, double noise)
{
	for (size_t i = 0; i < count; i++)
		set(i, draw(), draw(), noise * gnp_random_normal(&random_), 0, 0, 1);
}

/* Spacings: the root of the area over the points. */
static void points_at_random_are_flagged_within_a_spacing(void)
{
	double within[3] = {0}, seen[3] = {0}; /* half a spacing, a spacing, two and more */
	for (int seed = 0; seed < 4; seed++) {
		const size_t count = 1500 * (size_t)(seed + 1);
		const double h = 1 / sqrt((double)count);
		gnp_random_seed(&random_, 31, (uint64_t)seed);
		set_square(count, seed % 2 ? 0.2 * h : 0);
		find(count, 1);
		for (size_t i = 0; i < count; i++) {
			const double *p = points + 3 * i, depth = fmin(fmin(p[0], 1 - p[0]), fmin(p[1], 1 - p[1])) / h;
			const bool is[3] = {depth < 0.5, depth < 1, depth > 2};
			for (int k = 0; k < 3; k++) {
				within[k] += is[k];
				seen[k] += is[k] && rim[i];
			}
		}
	}
	CHECK(seen[0] >= 0.97 * within[0]);
	CHECK(seen[1] >= 0.93 * within[1]);
	CHECK(seen[2] <= 0.003 * within[2]);
}

static void set_sphere(size_t count, double noise)
{
	for (size_t i = 0; i < count; i++) {
		double z = 2 * draw() - 1, turn = 2 * acos(-1) * draw(), r = sqrt(1 - z * z);
		double s = 1 + noise * gnp_random_normal(&random_);
		set(i, s * r * cos(turn), s * r * sin(turn), s * z, r * cos(turn), r * sin(turn), z);
	}
}

static void closed_surfaces_have_none(void)
{
	for (int seed = 0; seed < 4; seed++) {
		const size_t count = 1500 * (size_t)(seed + 1);
		gnp_random_seed(&random_, 32, (uint64_t)seed);
		set_sphere(count, seed % 2 ? 0.5 * sqrt(4 * acos(-1) / (double)count) : 0);
		find(count, 1);
		CHECK(flagged(0, count) <= count / 500);
	}
}

/* A hole of five spacings in radius, in a sphere of points at random. */
static void holes_are_seen(void)
{
	const double h = sqrt(4 * acos(-1) / MOST), top = cos(5 * h);
	double near = 0, seen = 0, far = 0;
	size_t kept = 0;
	gnp_random_seed(&random_, 33, 0);
	set_sphere(MOST, 0);
	for (size_t i = 0; i < MOST; i++)
		if (points[3 * i + 2] < top) {
			memmove(points + 3 * kept, points + 3 * i, 3 * sizeof *points);
			memmove(normals + 3 * kept++, normals + 3 * i, 3 * sizeof *normals);
		}
	find(kept, 1);
	for (size_t i = 0; i < kept; i++) {
		double away = (acos(points[3 * i + 2]) - 5 * h) / h;
		near += away < 0.5;
		seen += away < 0.5 && rim[i];
		far += away > 2 && rim[i];
	}
	CHECK(near >= 10 && seen >= 0.95 * near);
	CHECK(far <= 10);
}

/* The six sides of a box of side x side x high squares, points on its edges facing as one of the sides there. */
static size_t set_box(size_t side, size_t high)
{
	size_t count = 0;
	for (size_t x = 0; x <= side; x++)
		for (size_t y = 0; y <= side; y++)
			for (size_t z = 0; z <= high; z++) {
				double n[3] = {0};
				if (z == 0 || z == high)
					n[2] = z ? 1 : -1;
				else if (x == 0 || x == side)
					n[0] = x ? 1 : -1;
				else if (y == 0 || y == side)
					n[1] = y ? 1 : -1;
				else
					continue;
				set(count++, (double)x, (double)y, (double)z, n[0], n[1], n[2]);
			}
	return count;
}

static void creases_and_thin_plates_are_no_ends(void)
{
	for (size_t high = 1; high <= 13; high += 4) {
		size_t count = set_box(20, high);
		find(count, 1);
		CHECK(flagged(0, count) == 0);
	}
}

/* Points at random, and a quarter of their density beside them. */
static void where_points_become_sparse_is_no_end(void)
{
	enum { COUNT = 5000 };
	static const double h = 1.0 / 63; /* of the dense half */
	size_t wrong = 0;
	gnp_random_seed(&random_, 36, 0);
	set_square(COUNT, 0);
	for (size_t i = 0; i < COUNT; i++)
		points[3 * i] *= i < 4 * COUNT / 5 ? 1 : -1;
	find(COUNT, 1);
	for (size_t i = 0; i < COUNT; i++) {
		const double *p = points + 3 * i;
		wrong += p[0] > -0.5 && p[0] < 0.5 && p[1] > 5 * h && p[1] < 1 - 5 * h && rim[i];
	}
	CHECK(wrong <= 10);
	CHECK(flagged(0, COUNT) > 200);
}

/* Rows six times as far apart as points in a row. */
static void rows_of_a_scanner_are_no_rims(void)
{
	enum { ROWS = 20, COLUMNS = 200 };
	for (size_t i = 0; i < ROWS * COLUMNS; i++)
		set(i, (double)(i % COLUMNS) + 0.3 * sin(7.0 * (double)(i / COLUMNS)), 6 * (double)(i / COLUMNS), 0, 0, 0, 1);
	find(ROWS * COLUMNS, 1);
	size_t wrong = 0;
	for (size_t i = 0; i < ROWS * COLUMNS; i++) {
		size_t row = i / COLUMNS, column = i % COLUMNS;
		wrong += row > 1 && row < ROWS - 2 && column > 12 && column < COLUMNS - 12 && rim[i];
	}
	CHECK(wrong == 0);
	CHECK(rim[COLUMNS / 2] && rim[(ROWS - 1) * COLUMNS + COLUMNS / 2]);
}

static void the_smallest_clouds_and_heaps_have_an_answer(void)
{
	gnp_random_seed(&random_, 34, 0);
	for (size_t count = 1; count <= 70; count += count < 10 ? 1 : 20) {
		set_square(count, 0);
		CHECK(isfinite(find(count, 1)));
		for (size_t i = 0; i < count; i++)
			set(i, 1, 2, 3, 0, 0, 1);
		CHECK(isfinite(find(count, 1)));
		CHECK(flagged(0, count) == 0);
	}
}

static void bytes_do_not_depend_on_workers(void)
{
	enum { COUNT = 5000 };
	static unsigned char before[COUNT];
	struct gnp_pool *two = pool;
	gnp_random_seed(&random_, 35, 0);
	set_square(COUNT, 0.003);
	double usual = find(COUNT, 3);
	memcpy(before, rim, COUNT);
	CHECK(gnp_pool_create(1, &pool, NULL) == GNP_OK);
	CHECK(find(COUNT, 3) == usual);
	CHECK(memcmp(before, rim, COUNT) == 0);
	gnp_pool_free(pool);
	pool = two;
}

static void quick_looks_find_wide_disks(void)
{
	enum { SIDE = 9 };
	double x[SIDE * SIDE], y[SIDE * SIDE];
	for (size_t i = 0; i < SIDE * SIDE; i++) {
		x[i] = (double)(i % SIDE);
		y[i] = (double)(i / SIDE);
	}
	CHECK(!gnp_disk_may_exceed(x, y, SIDE * SIDE, 4, 4, 0.3));
	CHECK(gnp_disk_may_exceed(x, y, SIDE * SIDE, 0, 4, 0.3));
	CHECK(gnp_disk_may_exceed(x, y, SIDE * SIDE, 0, 0, 0.3));
	CHECK(gnp_disk_may_exceed(x, y, 1, 0, 0, 0.3));
	CHECK(gnp_disk_may_exceed(x, y, 0, 0, 0, 0.3));
}

static void finding_is_cancelled(void)
{
	struct gnp_prepared prepared;
	struct gnp_task task;
	double usual;
	set_grid(5);
	gnp_task_init(&task);
	gnp_task_cancel(&task);
	CHECK(gnp_prepare(&(struct gnp_cloud){25, points, normals}, pool, NULL, &prepared, NULL) == GNP_OK);
	CHECK(gnp_disk_usual(&prepared, pool, &task, &usual, NULL) == GNP_CANCELLED);
	CHECK(gnp_boundary_find(&prepared, 0.3, NULL, pool, &task, rim, NULL) == GNP_CANCELLED);
	gnp_prepared_clear(&prepared);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(the_rim_of_a_grid_is_its_outer_points), TEST(points_at_random_are_flagged_within_a_spacing),
		TEST(closed_surfaces_have_none), TEST(holes_are_seen), TEST(creases_and_thin_plates_are_no_ends),
		TEST(where_points_become_sparse_is_no_end), TEST(rows_of_a_scanner_are_no_rims),
		TEST(the_smallest_clouds_and_heaps_have_an_answer), TEST(bytes_do_not_depend_on_workers),
		TEST(quick_looks_find_wide_disks), TEST(finding_is_cancelled)};
	if (gnp_pool_create(2, &pool, NULL) != GNP_OK)
		return 1;
	int status = RUN_TESTS(tests);
	gnp_pool_free(pool);
	return status;
}
