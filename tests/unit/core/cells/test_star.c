#include "core/cells/star.h"

#include "core/base/random.h"
#include "core/base/vector.h"
#include "core/search/neighbors.h"
#include "tests/unit/test.h"

enum { MOST = 2000 };
static double points[3 * MOST], normals[3 * MOST];

static struct gnp_star star_of(size_t centre, size_t count, uint32_t index[GNP_CELL_NEIGHBORS + 1])
{
	struct gnp_neighbors *tree;
	struct gnp_scratch *scratch = gnp_scratch_create();
	struct gnp_star star;
	double distance[GNP_CELL_NEIGHBORS + 1];
	size_t wanted = count < GNP_CELL_NEIGHBORS + 1 ? count : GNP_CELL_NEIGHBORS + 1;
	CHECK(gnp_neighbors_build(points, count, &tree, NULL) == GNP_OK);
	CHECK(gnp_neighbors_knn(tree, points + 3 * centre, 1, wanted, index, distance, scratch, NULL) == GNP_OK);
	gnp_star_make(points, normals, centre, index, wanted, &star);
	gnp_neighbors_free(tree);
	gnp_scratch_free(scratch);
	return star;
}

static void set_point(size_t i, double x, double y, double z)
{
	points[3 * i] = x;
	points[3 * i + 1] = y;
	points[3 * i + 2] = z;
	normals[3 * i] = normals[3 * i + 1] = 0;
	normals[3 * i + 2] = 1;
}

/* Four points of a grid lie on a circle: whichever diagonal is taken, both ends know of it, and it weighs nothing. */
static void grids_have_the_five_point_stencil(void)
{
	enum { SIDE = 15 };
	uint32_t index[SIDE * SIDE][GNP_CELL_NEIGHBORS + 1];
	static struct gnp_star stars[SIDE * SIDE];
	for (size_t i = 0; i < SIDE * SIDE; i++)
		set_point(i, (double)(i % SIDE), (double)(i / SIDE), 0);
	for (size_t i = 0; i < SIDE * SIDE; i++)
		stars[i] = star_of(i, SIDE * SIDE, index[i]);
	for (size_t i = 0; i < SIDE * SIDE; i++) {
		size_t x = i % SIDE, y = i / SIDE;
		if (x < 3 || y < 3 || x >= SIDE - 3 || y >= SIDE - 3)
			continue;
		CHECK(!stars[i].open && stars[i].edges >= 4 && stars[i].edges <= 8);
		CHECK_NEAR(stars[i].area, 1, 1e-9);
		for (size_t e = 0; e < stars[i].edges; e++) {
			size_t j = index[i][stars[i].neighbor[e]], dx = j % SIDE > x ? j % SIDE - x : x - j % SIDE;
			size_t dy = j / SIDE > y ? j / SIDE - y : y - j / SIDE;
			bool known = false;
			CHECK_NEAR(stars[i].weight[e], dx + dy == 1, 1e-6);
			for (size_t f = 0; f < stars[j].edges; f++)
				known |= index[j][stars[j].neighbor[f]] == i;
			CHECK(known);
		}
	}
}

/* Whether no point lies within the circle through three. */
static bool is_delaunay(size_t a, size_t b, size_t c, size_t count)
{
	const double *o = points + 3 * a, *p = points + 3 * b, *q = points + 3 * c;
	double x = p[0] - o[0], y = p[1] - o[1], u = q[0] - o[0], v = q[1] - o[1], cross = 2 * (x * v - y * u);
	double s = x * x + y * y, t = u * u + v * v, cx = (v * s - y * t) / cross, cy = (x * t - u * s) / cross;
	for (size_t i = 0; i < count; i++)
		if (i != a && i != b && i != c &&
		    hypot(points[3 * i] - o[0] - cx, points[3 * i + 1] - o[1] - cy) < hypot(cx, cy) * (1 - 1e-9))
			return false;
	return true;
}

static double far(size_t i, size_t j)
{
	return hypot(points[3 * j] - points[3 * i], points[3 * j + 1] - points[3 * i + 1]);
}

static double cotangent(size_t at, size_t b, size_t c)
{
	const double *o = points + 3 * at, *p = points + 3 * b, *q = points + 3 * c;
	double x = p[0] - o[0], y = p[1] - o[1], u = q[0] - o[0], v = q[1] - o[1];
	return (x * u + y * v) / fabs(x * v - y * u);
}

static void flat_stars_are_those_of_the_delaunay_triangulation(void)
{
	enum { COUNT = 300 };
	struct gnp_random random;
	uint32_t index[GNP_CELL_NEIGHBORS + 1];
	size_t tried = 0;
	gnp_random_seed(&random, 5, 0);
	for (size_t i = 0; i < COUNT; i++)
		set_point(i, 17 * gnp_random_uniform(&random), 17 * gnp_random_uniform(&random), 0);
	for (size_t i = 0; i < COUNT; i++) {
		double weight = 0, want = 0;
		if (fabs(points[3 * i] - 8.5) > 3 || fabs(points[3 * i + 1] - 8.5) > 3)
			continue;
		tried++;
		struct gnp_star star = star_of(i, COUNT, index);
		for (size_t e = 0; e < star.edges; e++)
			weight += star.weight[e];
		for (size_t a = 0; a < COUNT; a++)
			for (size_t b = 0; b < a; b++)
				if (a != i && b != i && far(i, a) < 5 && far(i, b) < 5 && is_delaunay(i, a, b, COUNT))
					want += (cotangent(a, i, b) + cotangent(b, i, a)) / 2;
		CHECK(!star.open && star.area > 0);
		CHECK_NEAR(weight, want, 1e-6 * want);
	}
	CHECK(tried > 20);
}

/* A roof's flank is as large as it is in space, not as its ground. */
static void triangles_are_measured_in_space(void)
{
	enum { SIDE = 15 };
	uint32_t index[GNP_CELL_NEIGHBORS + 1];
	size_t middle = SIDE * SIDE / 2;
	for (size_t i = 0; i < SIDE * SIDE; i++) {
		double along = (double)(i % SIDE) - SIDE / 2, slope = along < 0 ? along : -along;
		set_point(i, along / sqrt(2), (double)(i / SIDE) - SIDE / 2, slope / sqrt(2));
	}
	struct gnp_star star = star_of(middle, SIDE * SIDE, index);
	double weight = 0;
	for (size_t e = 0; e < star.edges; e++)
		weight += star.weight[e];
	CHECK_NEAR(star.area, 1, 1e-6);
	CHECK_NEAR(weight, 4, 1e-5);
}

static void rims_and_loners_are_open(void)
{
	uint32_t index[GNP_CELL_NEIGHBORS + 1];
	for (size_t i = 0; i < 9; i++)
		set_point(i, (double)(i % 3), (double)(i / 3), 0);
	struct gnp_star corner = star_of(0, 9, index);
	CHECK(corner.open && corner.edges >= 2);
	CHECK_NEAR(corner.area, 0.25, 1e-9);
	struct gnp_star alone = star_of(0, 1, index);
	CHECK(alone.open && alone.edges == 0 && alone.area == 0);
	for (size_t i = 0; i < 9; i++)
		set_point(i, (double)i, 0, 0);
	struct gnp_star line = star_of(4, 9, index);
	CHECK(line.open && line.triangles == 0);
	CHECK_NEAR(line.area, sqrt(3) / 2, 1e-12); /* what the nearest neighbour leaves */
	for (size_t i = 0; i < 9; i++)
		set_point(i, 1, 2, 3);
	struct gnp_star heap = star_of(4, 9, index);
	CHECK(heap.open && heap.edges == 0 && heap.area == 0);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(grids_have_the_five_point_stencil),
	                                    TEST(flat_stars_are_those_of_the_delaunay_triangulation),
	                                    TEST(triangles_are_measured_in_space), TEST(rims_and_loners_are_open)};
	return RUN_TESTS(tests);
}
