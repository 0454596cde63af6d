#include "area.h"

#include "shapes.h"
#include "test.h"

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

/* Curvature is felt to second order in the spacing: four times the points, a quarter of the error. */
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
		CHECK_AT_MOST(fabs(coarse), 0.012);
		CHECK_NEAR(fine / coarse, 0.25, 0.05);
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

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(areas_of_closed_surfaces_add_up), TEST(open_surfaces_are_cut_near_their_rim)};
	CHECK(gnp_pool_create(2, &pool, NULL) == GNP_OK);
	int failed = RUN_TESTS(tests);
	gnp_pool_free(pool);
	return failed;
}
