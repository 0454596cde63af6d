#include "core/cells/cell.h"

#include "core/base/random.h"
#include "core/base/vector.h"
#include "core/search/neighbors.h"
#include "tests/unit/test.h"

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

static double random_plane(size_t count, double side, uint64_t seed)
{
	struct gnp_random random;
	gnp_random_seed(&random, seed, 0);
	for (size_t i = 0; i < count; i++)
		for (size_t c = 0; c < 3; c++) {
			points[3 * i + c] = c < 2 ? side * gnp_random_uniform(&random) : 0;
			normals[3 * i + c] = c == 2;
		}
	return side;
}

struct corner {
	double angle, x, y;
};

static int by_angle(const void *a, const void *b)
{
	const struct corner *p = a, *q = b;
	return (p->angle > q->angle) - (p->angle < q->angle);
}

/* Corners of a cell by the definition, counterclockwise: places equally far from the centre and two others, and nearer to none. */
static size_t corners_of(size_t centre, size_t count, struct corner *corners)
{
	static double x[MOST], y[MOST];
	size_t made = 0, near = 0;
	for (size_t i = 0; i < count; i++) {
		double dx = points[3 * i] - points[3 * centre], dy = points[3 * i + 1] - points[3 * centre + 1];
		if (i == centre || hypot(dx, dy) > 6)
			continue;
		x[near] = dx;
		y[near++] = dy;
	}
	for (size_t i = 0; i < near; i++)
		for (size_t j = 0; j < i; j++) {
			double cross = 2 * (x[i] * y[j] - x[j] * y[i]), a = x[i] * x[i] + y[i] * y[i], b = x[j] * x[j] + y[j] * y[j];
			double u = (a * y[j] - b * y[i]) / cross, v = (b * x[i] - a * x[j]) / cross, far = hypot(u, v);
			bool is = true;
			for (size_t k = 0; k < near && is; k++)
				is = hypot(x[k] - u, y[k] - v) >= far * (1 - 1e-9);
			if (is)
				corners[made++] = (struct corner){atan2(v, u), u, v};
		}
	qsort(corners, made, sizeof *corners, by_angle);
	return made;
}

static void cells_of_random_points_are_those_of_the_definition(void)
{
	size_t count = 600, tried = 0;
	double side = random_plane(count, 25, 1);
	for (size_t t = 0; t < count; t++) {
		struct corner corners[64];
		double tangents[2][3], area = 0, gap = 0, sum[2] = {0}, weight = 0;
		uint32_t index[GNP_CELL_NEIGHBORS + 1];
		const double *p = points + 3 * t;
		if (fabs(p[0] - side / 2) > 5 || fabs(p[1] - side / 2) > 5)
			continue;
		tried++;
		struct gnp_cell cell = cell_of(t, count, tangents, index);
		size_t edges = corners_of(t, count, corners);
		for (size_t e = 0; e < edges; e++) {
			const struct corner *a = corners + e, *b = corners + (e + 1) % edges;
			double part = (a->x * b->y - a->y * b->x) / 2, apart = 2 * fabs(2 * part) / hypot(b->x - a->x, b->y - a->y);
			area += part;
			gap = fmax(gap, hypot(a->x, a->y));
			sum[0] += part * (a->x + b->x) / 3;
			sum[1] += part * (a->y + b->y) / 3;
			weight += hypot(b->x - a->x, b->y - a->y) / apart;
		}
		CHECK(!cell.open && cell.edges == edges);
		CHECK_NEAR(cell.area, area, 1e-9);
		CHECK_NEAR(cell.gap, gap, 1e-9);
		CHECK_NEAR(hypot(cell.corner[0], cell.corner[1]), gap, 1e-9);
		for (size_t c = 0; c < 2; c++)
			CHECK_NEAR(cell.centroid[0] * tangents[0][c] + cell.centroid[1] * tangents[1][c], sum[c] / area, 1e-9);
		for (size_t e = 0; e < cell.edges; e++)
			weight -= cell.weight[e];
		CHECK_NEAR(weight, 0, 1e-7);
	}
	CHECK(tried > 60);
}

static void units_and_places_do_not_matter(void)
{
	static const double scales[] = {1e-3, 1e3, 1e60, 1e-60, 1}, places[] = {0, 0, 0, 0, 1e5};
	size_t count = 400, centre = 0;
	static double original[3 * MOST];
	double tangents[2][3];
	uint32_t index[GNP_CELL_NEIGHBORS + 1];
	random_plane(count, 20, 2);
	memcpy(original, points, sizeof points);
	while (hypot(points[3 * centre] - 10, points[3 * centre + 1] - 10) > 2)
		centre++;
	struct gnp_cell cell = cell_of(centre, count, tangents, index);
	for (size_t s = 0; s < 5; s++) {
		double scale = scales[s], lost = places[s] > 0 ? 1e-9 : 1e-12; /* digits */
		for (size_t i = 0; i < 3 * count; i++)
			points[i] = scale * (original[i] + places[s]);
		struct gnp_cell other = cell_of(centre, count, tangents, index);
		CHECK(other.edges == cell.edges && other.open == cell.open && other.hole == cell.hole);
		CHECK_NEAR(other.area / scale / scale, cell.area, lost);
		CHECK_NEAR(other.gap / scale, cell.gap, lost);
		CHECK_NEAR(other.centroid[0] / scale, cell.centroid[0], lost);
		for (size_t e = 0; e < cell.edges; e++)
			CHECK_NEAR(other.weight[e], cell.weight[e], 100 * lost);
	}
}

static void neighbors_across_edges_see_the_same_edge(void)
{
	size_t count = 400, centre = 0;
	double tangents[2][3];
	uint32_t index[GNP_CELL_NEIGHBORS + 1], back[GNP_CELL_NEIGHBORS + 1];
	random_plane(count, 20, 2);
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

/* One point less: its place is the farthest corner of the cells about it, but no wider gap than to their neighbours. */
static void a_missing_point_is_the_corner_of_those_about_it(void)
{
	double tangents[2][3];
	uint32_t index[GNP_CELL_NEIGHBORS + 1];
	size_t count = lattice(21, sqrt(0.75), 0.5, tilted_a, tilted_b) - 1;
	const double gone[3] = {points[3 * 220], points[3 * 220 + 1], points[3 * 220 + 2]};
	memcpy(points + 3 * 220, points + 3 * count, 3 * sizeof *points);
	const size_t about[] = {219, 221};
	for (size_t i = 0; i < 2; i++) {
		struct gnp_cell cell = cell_of(about[i], count, tangents, index);
		CHECK(!cell.open && !cell.hole);
		CHECK_NEAR(cell.gap, 1, 1e-12);
		CHECK_NEAR(cell.area, sqrt(0.75) * 7 / 6, 1e-12);
		for (size_t c = 0; c < 3; c++)
			CHECK_NEAR(points[3 * about[i] + c] + cell.corner[0] * tangents[0][c] + cell.corner[1] * tangents[1][c], gone[c], 1e-12);
	}
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

/* The edge between two points 1e-20 apart weighed 1e20: implicit steps threw them away. */
static void points_all_but_at_one_place_do_not_cut_each_other(void)
{
	double tangents[2][3];
	uint32_t index[GNP_CELL_NEIGHBORS + 1];
	size_t count = lattice(21, 1, 0, x_axis, y_axis);
	for (size_t i = 0; i < count; i++)
		for (size_t c = 0; c < 2; c++)
			points[3 * i + c] -= 10;
	for (int power = -300; power < -9; power += 10) {
		for (size_t c = 0; c < 3; c++)
			points[3 * 221 + c] = points[3 * 220 + c] + (c == 0 ? pow(10, power) : 0);
		struct gnp_cell cell = cell_of(220, count, tangents, index);
		CHECK_NEAR(cell.area, 1.25, 1e-8);
		for (size_t e = 0; e < cell.edges; e++)
			CHECK_AT_MOST(cell.weight[e], 2);
	}
	points[3 * 221] = points[3 * 220] + 1e-6; /* these do */
	CHECK_NEAR(cell_of(220, count, tangents, index).area, 0.5, 1e-4);
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
	                                    TEST(cells_of_random_points_are_those_of_the_definition),
	                                    TEST(units_and_places_do_not_matter),
	                                    TEST(neighbors_across_edges_see_the_same_edge),
	                                    TEST(missing_points_leave_a_hole_and_a_rim_does_not),
	                                    TEST(a_missing_point_is_the_corner_of_those_about_it),
	                                    TEST(the_other_sheet_is_not_seen),
	                                    TEST(points_all_but_at_one_place_do_not_cut_each_other),
	                                    TEST(lonely_and_doubled_points_are_served)};
	return RUN_TESTS(tests);
}
