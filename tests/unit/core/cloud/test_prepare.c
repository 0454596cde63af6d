#include "core/cloud/prepare.h"

#include "core/base/random.h"
#include "tests/unit/test.h"

enum { COUNT = 700 };
static struct gnp_pool *pool;
static double points[3 * COUNT], normals[3 * COUNT];

static void fill(void)
{
	struct gnp_random random;
	gnp_random_seed(&random, 1, 0);
	for (size_t i = 0; i < 3 * COUNT; i++) {
		points[i] = gnp_random_uniform(&random);
		normals[i] = 1e20 * gnp_random_normal(&random);
	}
}

static void rows_are_those_of_the_cloud(void)
{
	struct gnp_prepared prepared;
	unsigned char seen[COUNT] = {0};
	fill();
	CHECK(gnp_prepare(&(struct gnp_cloud){COUNT, points, normals}, pool, NULL, &prepared, NULL) == GNP_OK);
	CHECK(prepared.count == COUNT && prepared.components == 0);
	for (size_t i = 0; i < COUNT; i++) {
		const double *n = normals + 3 * (size_t)prepared.order[i], length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
		CHECK(!seen[prepared.order[i]]++);
		CHECK(memcmp(prepared.points + 3 * i, points + 3 * (size_t)prepared.order[i], 3 * sizeof *points) == 0);
		for (size_t c = 0; c < 3; c++)
			CHECK_NEAR(prepared.normals[3 * i + c], n[c] / length, 1e-15);
	}
	gnp_prepared_clear(&prepared);
	gnp_prepared_clear(&prepared);
}

static void points_alone_have_no_normals(void)
{
	struct gnp_prepared prepared;
	fill();
	CHECK(gnp_prepare_points(&(struct gnp_cloud){COUNT, points, normals}, NULL, &prepared, NULL) == GNP_OK);
	CHECK(prepared.neighbors && !prepared.normals && prepared.count == COUNT);
	gnp_prepared_clear(&prepared);
}

/* Clouds were ordered and indexed to the end whoever had cancelled. */
static void preparing_is_cancelled(void)
{
	struct gnp_prepared prepared = {.count = 3};
	struct gnp_task task;
	struct gnp_error error = {0};
	const struct gnp_cloud cloud = {COUNT, points, normals};
	fill();
	gnp_task_init(&task);
	gnp_task_cancel(&task);
	CHECK(gnp_prepare(&cloud, pool, &task, &prepared, &error) == GNP_CANCELLED);
	CHECK_STRING(error.text, "the work was cancelled");
	CHECK(gnp_prepare_points(&cloud, &task, &prepared, NULL) == GNP_CANCELLED);
	CHECK(prepared.count == 3 && !prepared.order);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(rows_are_those_of_the_cloud), TEST(points_alone_have_no_normals), TEST(preparing_is_cancelled)};
	CHECK(gnp_pool_create(2, &pool, NULL) == GNP_OK);
	int failed = RUN_TESTS(tests);
	gnp_pool_free(pool);
	return failed;
}
