#include "cell.h"

#include "neighbors.h"
#include "random.h"
#include "test.h"
#include "vector.h"

enum { MOST = 4000 };
static double points[3 * MOST], normals[3 * MOST];

/* Rows `pitch` apart of points 1 apart, every other row shifted, in the plane spanned by two unit vectors. */
static size_t lattice(size_t side, double pitch, double shift, const double a[3], const double b[3])
{
	double n[3];
	gnp_cross(a, b, n);
	for (size_t i = 0; i < side * side; i++) {
		double x = (double)(i % side) + shift * (double)(i / side % 2), y = pitch * (double)(i / side);
		for (size_t c = 0; c < 3; c++) {
			points[3 * i + c] = x * a[c] + y * b[c];
			normals[3 * i + c] = n[c];
		}
	}
	return side * side;
}

/* The cell of a point among its nearest of `count`. */
static struct gnp_cell cell_of(size_t centre, size_t count, double tangents[2][3], uint32_t index[GNP_CELL_NEIGHBORS + 1])
{
	struct gnp_neighbors *tree;
	struct gnp_scratch *scratch = gnp_scratch_create();
	struct gnp_cell cell;
	double distance[GNP_CELL_NEIGHBORS + 1];
	CHECK(gnp_neighbors_build(points, count, &tree, NULL) == GNP_OK);
	CHECK(gnp_neighbors_knn(tree, points + 3 * centre, 1, GNP_CELL_NEIGHBORS + 1, index, distance, scratch, NULL) == GNP_OK);
	gnp_cell_make(points, normals, centre, index, GNP_CELL_NEIGHBORS + 1, tangents, &cell);
	gnp_neighbors_free(tree);
	gnp_scratch_free(scratch);
	return cell;
}

static const double x_axis[3] = {1, 0, 0}, y_axis[3] = {0, 1, 0}, tilted_a[3] = {0.6, 0.8, 0}, tilted_b[3] = {0, 0, 1};

static void tangents_are_right_handed_and_unit(void)
{
	const double all[][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, -1}, {0.6, 0, 0.8}, {1 / sqrt(3), 1 / sqrt(3), -1 / sqrt(3)}};
	for (size_t i = 0; i < sizeof all / sizeof *all; i++) {
		double t[2][3], n[3];
		gnp_tangents_of(all[i], t);
		gnp_cross(t[0], t[1], n);
		CHECK_NEAR(gnp_dot(t[0], t[0]), 1, 1e-15);
		CHECK_NEAR(gnp_dot(t[0], t[1]), 0, 1e-15);
		for (int c = 0; c < 3; c++)
			CHECK_NEAR(n[c], all[i][c], 1e-15);
	}
}

static void cells_of_lattices_are_squares_and_hexagons(void)
{
	double tangents[2][3];
	uint32_t index[GNP_CELL_NEIGHBORS + 1];
	size_t count = lattice(21, 1, 0, x_axis, y_axis);
	struct gnp_cell square = cell_of(220, count, tangents, index);
	CHECK(!square.open && !square.hole);
	CHECK_NEAR(square.area, 1, 1e-12);
	CHECK_NEAR(square.gap, sqrt(0.5), 1e-12);
	double weight = 0;
	for (size_t e = 0; e < square.edges; e++)
		weight += square.weight[e];
	CHECK_NEAR(weight, 4, 1e-9); /* the five-point Laplacian */
	count = lattice(21, sqrt(0.75), 0.5, tilted_a, tilted_b);
	struct gnp_cell hexagon = cell_of(220, count, tangents, index);
	CHECK(!hexagon.open && !hexagon.hole && hexagon.edges == 6);
	CHECK_NEAR(hexagon.area, sqrt(0.75), 1e-12);
	CHECK_NEAR(hexagon.gap, 1 / sqrt(3), 1e-12);
	CHECK_NEAR(hypot(hexagon.centroid[0], hexagon.centroid[1]), 0, 1e-12);
	for (size_t e = 0; e < 6; e++)
		CHECK_NEAR(hexagon.weight[e], 1 / sqrt(3), 1e-12);
}

/* Against the definition, by throwing points: which are nearest to the centre, and where on average. */
static void cells_of_random_points_hold_what_is_nearest(void)
{
	enum { THROWN = 40000 };
	struct gnp_random random;
	size_t count = 600;
	gnp_random_seed(&random, 1, 0);
	for (size_t i = 0; i < count; i++)
		for (size_t c = 0; c < 3; c++) {
			points[3 * i + c] = c < 2 ? 25 * gnp_random_uniform(&random) : 0;
			normals[3 * i + c] = c == 2;
		}
	for (size_t t = 0, tried = 0; t < count && tried < 4; t += 37) {
		double tangents[2][3], in = 0, sum[2] = {0}, reach;
		uint32_t index[GNP_CELL_NEIGHBORS + 1];
		const double *centre = points + 3 * t;
		if (centre[0] < 8 || centre[0] > 17 || centre[1] < 8 || centre[1] > 17)
			continue;
		tried++;
		struct gnp_cell cell = cell_of(t, count, tangents, index);
		reach = cell.gap * 1.01;
		CHECK(!cell.open);
		for (int s = 0; s < THROWN; s++) {
			double p[2] = {reach * (2 * gnp_random_uniform(&random) - 1), reach * (2 * gnp_random_uniform(&random) - 1)};
			size_t nearest = t;
			for (size_t i = 0; i < count; i++) {
				const double *q = points + 3 * i, *best = points + 3 * nearest;
				if (hypot(q[0] - centre[0] - p[0], q[1] - centre[1] - p[1]) < hypot(best[0] - centre[0] - p[0], best[1] - centre[1] - p[1]))
					nearest = i;
			}
			in += nearest == t;
			sum[0] += nearest == t ? p[0] : 0;
			sum[1] += nearest == t ? p[1] : 0;
		}
		double area = in / THROWN * 4 * reach * reach;
		CHECK_NEAR(area, cell.area, 0.04 * cell.area);
		for (int c = 0; c < 2; c++) /* the tangents are axes of the plane, in some order and sign */
			CHECK_NEAR(cell.centroid[0] * tangents[0][c] + cell.centroid[1] * tangents[1][c], sum[c] / in, 0.03);
	}
}

static void neighbors_across_edges_see_the_same_edge(void)
{
	struct gnp_random random;
	size_t count = 400;
	double tangents[2][3];
	uint32_t index[GNP_CELL_NEIGHBORS + 1], back[GNP_CELL_NEIGHBORS + 1];
	gnp_random_seed(&random, 2, 0);
	for (size_t i = 0; i < count; i++)
		for (size_t c = 0; c < 3; c++) {
			points[3 * i + c] = c < 2 ? 20 * gnp_random_uniform(&random) : 0;
			normals[3 * i + c] = c == 2;
		}
	size_t centre = 0;
	while (hypot(points[3 * centre] - 10, points[3 * centre + 1] - 10) > 2)
		centre++;
	struct gnp_cell cell = cell_of(centre, count, tangents, index);
	CHECK(cell.edges >= 3);
	for (size_t e = 0; e < cell.edges; e++) {
		size_t other = index[cell.neighbor[e]];
		struct gnp_cell its = cell_of(other, count, tangents, back);
		double weight = -1;
		for (size_t f = 0; f < its.edges; f++)
			weight = back[its.neighbor[f]] == centre ? its.weight[f] : weight;
		CHECK_NEAR(weight, cell.weight[e], 1e-9);
	}
}

static void missing_points_leave_a_hole_and_a_rim_does_not(void)
{
	double tangents[2][3];
	uint32_t index[GNP_CELL_NEIGHBORS + 1];
	size_t side = 21, count = lattice(side, sqrt(0.75), 0.5, x_axis, y_axis), left = 0, beside = 0;
	const double hole[2] = {points[3 * 220], points[3 * 220 + 1]};
	for (size_t i = 0; i < count; i++) { /* seven go */
		double away = hypot(points[3 * i] - hole[0], points[3 * i + 1] - hole[1]);
		if (away < 1.1)
			continue;
		beside = fabs(away - sqrt(3)) < 1e-9 ? left : beside;
		memmove(points + 3 * left++, points + 3 * i, 3 * sizeof *points);
	}
	CHECK(left == count - 7);
	struct gnp_cell cell = cell_of(beside, left, tangents, index);
	CHECK(cell.hole && !cell.open);
	CHECK_NEAR(cell.gap, sqrt(3), 1e-9);
	for (size_t c = 0; c < 2; c++)
		CHECK_NEAR(points[3 * beside + c] + cell.corner[0] * tangents[0][c] + cell.corner[1] * tangents[1][c], hole[c], 1e-9);
	struct gnp_cell corner = cell_of(0, left, tangents, index), rim = cell_of(10, left, tangents, index);
	CHECK(!corner.hole && corner.open);
	CHECK(!rim.hole && rim.open);
	CHECK_NEAR(rim.area, sqrt(0.75), 0.25); /* cut about half a spacing outside */
}

static void the_other_sheet_is_not_seen(void)
{
	double tangents[2][3];
	uint32_t index[GNP_CELL_NEIGHBORS + 1];
	size_t side = 21, count = lattice(side, 1, 0, x_axis, y_axis);
	memcpy(points + 3 * count, points, 3 * count * sizeof(double));
	memcpy(normals + 3 * count, normals, 3 * count * sizeof(double));
	for (size_t i = count; i < 2 * count; i++) {
		points[3 * i + 2] = -0.05;
		points[3 * i] += 0.3;
		normals[3 * i + 2] = -1;
	}
	struct gnp_cell cell = cell_of(220, 2 * count, tangents, index);
	CHECK_NEAR(cell.area, 1, 1e-12);
}

static void lonely_and_doubled_points_are_served(void)
{
	double tangents[2][3];
	uint32_t index[GNP_CELL_NEIGHBORS + 1];
	size_t count = lattice(21, 1, 0, x_axis, y_axis);
	memcpy(points + 3 * 221, points + 3 * 220, 3 * sizeof(double)); /* two at one place: each has the whole cell */
	struct gnp_cell doubled = cell_of(220, count, tangents, index);
	CHECK_NEAR(doubled.area, 1.25, 1e-9);
	for (size_t i = 0; i < count; i++)
		normals[3 * i + 2] = i == 220 ? -1 : 1;
	struct gnp_cell lonely = cell_of(220, count, tangents, index);
	CHECK(lonely.open && !lonely.hole && lonely.edges == 0 && lonely.area == 0 && lonely.gap == 0);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(tangents_are_right_handed_and_unit),
	                                    TEST(cells_of_lattices_are_squares_and_hexagons),
	                                    TEST(cells_of_random_points_hold_what_is_nearest),
	                                    TEST(neighbors_across_edges_see_the_same_edge),
	                                    TEST(missing_points_leave_a_hole_and_a_rim_does_not),
	                                    TEST(the_other_sheet_is_not_seen),
	                                    TEST(lonely_and_doubled_points_are_served)};
	return RUN_TESTS(tests);
}
