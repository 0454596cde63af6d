#include "core/cells/area.h"

#include "core/base/random.h"
#include "core/shapes/shapes.h"
#include "tests/unit/test.h"

static struct gnp_pool *pool;

static double measured(const char *name, size_t count, double scale, size_t *open)
{
	struct gnp_shape *shape;
	struct gnp_sample sample;
	struct gnp_prepared prepared;
	double sum = 0, *area = malloc(count * sizeof *area);
	CHECK(gnp_shape_create(name, 1, 0, &shape, NULL) == GNP_OK);
	CHECK(gnp_sample_create(shape, &(struct gnp_sample_options){.count = count, .seed = 2}, pool, NULL, &sample, NULL) == GNP_OK);
	for (size_t i = 0; i < 3 * count; i++)
		sample.points[i] = scale * (sample.points[i] + 100);
	CHECK(gnp_prepare(&(struct gnp_cloud){count, sample.points, sample.normals}, pool, NULL, &prepared, NULL) == GNP_OK);
	CHECK(gnp_area_measure(&prepared, pool, NULL, area, open, NULL) == GNP_OK);
	for (size_t i = 0; i < count; i++) {
		CHECK(area[i] > 0);
		sum += area[i];
	}
	gnp_prepared_clear(&prepared);
	gnp_sample_clear(&sample);
	gnp_shape_free(shape);
	free(area);
	return sum;
}

/* What the surface bulges over its triangles is in the areas, so that curvature is felt to fourth order in the spacing;
 * what is left is that stars of neighbours differ here and there. */
static void areas_of_closed_surfaces_add_up(void)
{
	static const double pi = 3.14159265358979324;
	const struct {
		const char *name;
		double area;
	} rows[] = {{"sphere", 4 * pi}, {"torus", 4 * pi * pi * 2 / 9}};
	for (size_t r = 0; r < 2; r++) {
		size_t open;
		double coarse = measured(rows[r].name, 2000, 1, &open) / rows[r].area - 1;
		CHECK(open == 0);
		double fine = measured(rows[r].name, 8000, 1, &open) / rows[r].area - 1;
		CHECK(open == 0);
		CHECK_AT_MOST(fabs(coarse), 1e-3);
		CHECK_AT_MOST(fabs(fine), 2e-4);
		CHECK_NEAR(measured(rows[r].name, 2000, 1e-3, NULL) / (1e-6 * rows[r].area) - 1, coarse, 1e-6);
	}
}

static void open_surfaces_are_cut_near_their_rim(void)
{
	size_t open;
	double sum = measured("plane", 4000, 1, &open); /* [-1, 1]^2 */
	CHECK(open > 150 && open < 600);
	CHECK_NEAR(sum, 4, 0.2);
}

/* Of points on its edges and of points at random a square is as large. */
static void rims_are_where_the_points_say(void)
{
	enum { SIDE = 40 };
	static double points[3 * SIDE * SIDE], normals[3 * SIDE * SIDE], area[SIDE * SIDE];
	struct gnp_random random;
	gnp_random_seed(&random, 2, 0);
	for (int ragged = 0; ragged < 2; ragged++) {
		double sum = 0;
		for (size_t i = 0; i < SIDE * SIDE; i++) {
			const double n[3] = {0, 0, 1};
			double x = (double)(i % SIDE) / (SIDE - 1), y = (double)(i / SIDE) / (SIDE - 1);
			const double p[3] = {ragged ? gnp_random_uniform(&random) : x, ragged ? gnp_random_uniform(&random) : y, 0};
			memcpy(points + 3 * i, p, sizeof p);
			memcpy(normals + 3 * i, n, sizeof n);
		}
		struct gnp_prepared prepared;
		const struct gnp_cloud cloud = {SIDE * SIDE, points, normals};
		CHECK(gnp_prepare(&cloud, pool, NULL, &prepared, NULL) == GNP_OK);
		CHECK(gnp_area_measure(&prepared, pool, NULL, area, NULL, NULL) == GNP_OK);
		for (size_t i = 0; i < SIDE * SIDE; i++)
			sum += area[i];
		CHECK_NEAR(sum, 1, ragged ? 0.01 : 1e-9);
		gnp_prepared_clear(&prepared);
	}
}

static void check_areas(size_t count, const double *points, const double *normals, double *area, size_t *open)
{
	struct gnp_prepared prepared;
	double own[600];
	CHECK(gnp_prepare(&(struct gnp_cloud){count, points, normals}, pool, NULL, &prepared, NULL) == GNP_OK);
	CHECK(gnp_area_measure(&prepared, pool, NULL, own, open, NULL) == GNP_OK);
	for (size_t i = 0; i < count; i++)
		area[prepared.order[i]] = own[i];
	gnp_prepared_clear(&prepared);
}

/* Two sheets back to back are measured each by itself; a point that faces as nothing near it does has some area all the same. */
static void sheets_and_lonely_points_have_their_own(void)
{
	enum { SIDE = 15, EACH = SIDE * SIDE };
	double points[3 * 2 * EACH], normals[3 * 2 * EACH], area[2 * EACH];
	size_t open, middle = EACH / 2;
	for (size_t i = 0; i < 2 * EACH; i++) {
		const double p[3] = {(double)(i % SIDE), (double)(i % EACH / SIDE), 0}, n[3] = {0, 0, i < EACH ? 1 : -1};
		memcpy(points + 3 * i, p, sizeof p);
		memcpy(normals + 3 * i, n, sizeof n);
	}
	check_areas(2 * EACH, points, normals, area, &open);
	CHECK_NEAR(area[middle], 1, 1e-9);
	CHECK_NEAR(area[EACH + middle], 1, 1e-9);
	normals[3 * middle + 2] = -1;
	check_areas(EACH, points, normals, area, &open);
	CHECK(area[middle] > 0 && isfinite(area[middle]));
	CHECK_NEAR(area[middle + 1], 1.25, 1e-9); /* takes a quarter of the lonely one's place */
}

static void the_smallest_clouds_have_areas(void)
{
	double points[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}, normals[12] = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}, area[4];
	for (size_t count = 1; count <= 4; count++) {
		size_t open;
		check_areas(count, points, normals, area, &open);
		CHECK(open == count);
		for (size_t i = 0; i < count; i++)
			CHECK(area[i] > 0 && area[i] < 4);
	}
}

static void measuring_is_cancelled(void)
{
	double points[3] = {0}, normals[3] = {0, 0, 1}, area;
	struct gnp_prepared prepared;
	struct gnp_task task;
	gnp_task_init(&task);
	gnp_task_cancel(&task);
	CHECK(gnp_prepare(&(struct gnp_cloud){1, points, normals}, pool, NULL, &prepared, NULL) == GNP_OK);
	CHECK(gnp_area_measure(&prepared, pool, &task, &area, NULL, NULL) == GNP_CANCELLED);
	gnp_prepared_clear(&prepared);
}

static void bytes_do_not_depend_on_workers(void)
{
	struct gnp_pool *two = pool;
	size_t open;
	double sum = measured("torus", 3000, 1, &open);
	CHECK(gnp_pool_create(1, &pool, NULL) == GNP_OK);
	CHECK(measured("torus", 3000, 1, &open) == sum);
	gnp_pool_free(pool);
	pool = two;
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(areas_of_closed_surfaces_add_up), TEST(open_surfaces_are_cut_near_their_rim),
	                                    TEST(rims_are_where_the_points_say),
	                                    TEST(sheets_and_lonely_points_have_their_own), TEST(the_smallest_clouds_have_areas),
	                                    TEST(measuring_is_cancelled), TEST(bytes_do_not_depend_on_workers)};
	CHECK(gnp_pool_create(2, &pool, NULL) == GNP_OK);
	int failed = RUN_TESTS(tests);
	gnp_pool_free(pool);
	return failed;
}
