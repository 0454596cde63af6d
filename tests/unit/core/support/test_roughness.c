/* Roughness against brute force, and on clouds that are flat, thin, small or one point. */
#include "core/linear/pca.h"
#include "core/support/roughness.h"
#include "tests/unit/core/support/small_cloud.h"

static const size_t scales[GNP_ROUGHNESS_SCALES] = {12, 64};

struct place {
	double square;
	uint32_t index;
};

static int compare(const void *a, const void *b)
{
	const struct place *x = a, *y = b;
	return (x->square > y->square) - (x->square < y->square);
}

/* By sorting all points by distance and the principal axes of the nearest. */
static double brute(const double *points, size_t count, size_t at, size_t nearest)
{
	struct gnp_pca pca;
	struct place *all = malloc(count * sizeof *all);
	uint32_t *index = malloc(count * sizeof *index);
	for (size_t i = 0; i < count; i++) {
		double d[3] = {points[3 * i] - points[3 * at], points[3 * i + 1] - points[3 * at + 1],
		               points[3 * i + 2] - points[3 * at + 2]};
		all[i] = (struct place){d[0] * d[0] + d[1] * d[1] + d[2] * d[2], (uint32_t)i};
	}
	qsort(all, count, sizeof *all, compare);
	for (size_t i = 0; i < count; i++)
		index[i] = all[i].index;
	gnp_pca_fit(points, index, nearest < count ? nearest : count, &pca);
	free(index);
	free(all);
	return 0.5 * log(pca.values[2] / pca.values[1] + 1e-6);
}

static void every_fourth_point_is_as_by_brute_force(void)
{
	static const size_t counts[] = {501, 64, 63, 30, 12, 9};
	for (size_t k = 0; k < sizeof counts / sizeof *counts; k++) {
		struct small_cloud cloud;
		small_cloud_make(counts[k], 0.01, false, &cloud);
		CHECK(cloud.roughness.count == (counts[k] + 3) / 4);
		for (int s = 0; s < GNP_ROUGHNESS_SCALES; s++)
			for (size_t i = 0; i < cloud.roughness.count; i++)
				CHECK_NEAR(cloud.roughness.value[s][i], brute(cloud.points, counts[k], 4 * i, scales[s]), 2e-6);
		for (uint32_t i = 0; i < counts[k]; i++)
			CHECK(gnp_roughness_at(&cloud.roughness, 1, i) == cloud.roughness.value[1][i / 4]);
		small_cloud_clear(&cloud);
	}
}

/* The cloud of a function of the point's number, with no normals. */
static void measure(size_t count, void (*place)(struct gnp_random *random, size_t i, double *point),
                    struct small_cloud *cloud)
{
	struct gnp_random random;
	double *points = malloc(3 * count * sizeof *points);
	gnp_random_seed(&random, 2, 0);
	for (size_t i = 0; i < count; i++)
		place(&random, i, points + 3 * i);
	small_cloud_take(count, points, NULL, false, cloud);
}

static void check_all(const struct small_cloud *cloud, double least, double most)
{
	for (int s = 0; s < GNP_ROUGHNESS_SCALES; s++)
		for (size_t i = 0; i < cloud->roughness.count; i++)
			CHECK((double)cloud->roughness.value[s][i] >= least && (double)cloud->roughness.value[s][i] <= most);
}

static void on_plane(struct gnp_random *random, size_t i, double *point)
{
	(void)i;
	double x = gnp_random_uniform(random), y = gnp_random_uniform(random);
	point[0] = 0.6 * x;
	point[1] = 0.8 * x;
	point[2] = y;
}

static void on_line(struct gnp_random *random, size_t i, double *point)
{
	(void)i;
	double x = gnp_random_uniform(random);
	point[0] = x;
	point[1] = 0.3 * x;
	point[2] = 0.7 * x;
}

static void at_one_place(struct gnp_random *random, size_t i, double *point)
{
	(void)random;
	(void)i;
	point[0] = 0.1;
	point[1] = -7.3;
	point[2] = 1e5;
}

static void a_plane_is_at_the_floor_and_nothing_is_off_the_scale(void)
{
	const double floor = 0.5 * log(1e-6);
	struct small_cloud cloud;
	measure(300, on_plane, &cloud);
	check_all(&cloud, floor - 1e-5, floor + 1e-5);
	small_cloud_clear(&cloud);
	measure(300, on_line, &cloud); /* as rough as can be, or less */
	check_all(&cloud, floor - 1e-5, 1e-5);
	small_cloud_clear(&cloud);
	measure(100, at_one_place, &cloud);
	check_all(&cloud, floor - 1e-5, floor + 1e-5);
	small_cloud_clear(&cloud);
	measure(1, at_one_place, &cloud);
	check_all(&cloud, floor - 1e-5, floor + 1e-5);
	small_cloud_clear(&cloud);
}

static void scale_does_not_matter(void)
{
	static const double factors[] = {1e-40, 1e-3, 1e40};
	struct small_cloud cloud;
	small_cloud_make(200, 0.02, false, &cloud);
	for (int f = 0; f < 3; f++) {
		struct small_cloud scaled;
		double *points = malloc(600 * sizeof *points);
		for (size_t i = 0; i < 600; i++)
			points[i] = cloud.points[i] * factors[f];
		small_cloud_take(200, points, NULL, false, &scaled);
		for (int s = 0; s < GNP_ROUGHNESS_SCALES; s++)
			for (size_t i = 0; i < 50; i++)
				CHECK_NEAR(scaled.roughness.value[s][i], cloud.roughness.value[s][i], 1e-5);
		small_cloud_clear(&scaled);
	}
	small_cloud_clear(&cloud);
}

static void workers_do_not_matter(void)
{
	struct small_cloud cloud;
	struct gnp_pool *pool = NULL;
	struct gnp_roughness many;
	small_cloud_make(1500, 0.02, false, &cloud);
	CHECK(gnp_pool_create(3, &pool, NULL) == GNP_OK &&
	      gnp_roughness_measure(cloud.neighbors, pool, NULL, &many, NULL) == GNP_OK);
	for (int s = 0; s < GNP_ROUGHNESS_SCALES; s++)
		CHECK(memcmp(many.value[s], cloud.roughness.value[s], many.count * sizeof(float)) == 0);
	gnp_roughness_clear(&many);
	CHECK(!many.value[0] && many.count == 0);
	gnp_pool_free(pool);
	small_cloud_clear(&cloud);
}

static void a_stopped_task_leaves_nothing(void)
{
	struct small_cloud cloud;
	struct gnp_pool *pool = NULL;
	struct gnp_roughness out = {.count = 77};
	struct gnp_task task;
	gnp_task_init(&task);
	gnp_task_cancel(&task);
	small_cloud_make(100, 0.02, false, &cloud);
	CHECK(gnp_pool_create(1, &pool, NULL) == GNP_OK);
	CHECK(gnp_roughness_measure(cloud.neighbors, pool, &task, &out, NULL) == GNP_CANCELLED && out.count == 77 &&
	      !out.value[0]);
	gnp_pool_free(pool);
	small_cloud_clear(&cloud);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(every_fourth_point_is_as_by_brute_force), TEST(a_plane_is_at_the_floor_and_nothing_is_off_the_scale),
		TEST(scale_does_not_matter), TEST(workers_do_not_matter), TEST(a_stopped_task_leaves_nothing)};
	return RUN_TESTS(tests);
}
