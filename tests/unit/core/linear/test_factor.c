#include "core/base/memory.h"
#include "core/base/random.h"
#include "core/linear/factor_solve.h"
#include "core/linear/linalg.h"
#include "tests/unit/test.h"

static struct gnp_pool *pool;

/* A convection-diffusion matrix on a grid of side * side points, unsymmetric in value and structure, with some noise. */
static struct gnp_csr grid_matrix(size_t side, double *points)
{
	struct gnp_csr matrix;
	struct gnp_random random;
	size_t n = side * side, at = 0;
	gnp_random_seed(&random, 5, 0);
	CHECK(gnp_csr_allocate(n, n, 9 * n, &matrix, NULL) == GNP_OK);
	for (size_t i = 0; i < n; i++) {
		size_t x = i % side, y = i / side;
		points[3 * i] = (double)x;
		points[3 * i + 1] = (double)y;
		points[3 * i + 2] = sin((double)x);
		for (size_t j = 0; j < n; j++) {
			size_t dx = x > j % side ? x - j % side : j % side - x, dy = y > j / side ? y - j / side : j / side - y;
			if (dx > 1 || dy > 1 || (i != j && gnp_random_uniform(&random) < 0.1))
				continue;
			matrix.column[at] = (uint32_t)j;
			matrix.value[at++] = i == j ? 4 + gnp_random_uniform(&random) : gnp_random_normal(&random) / 2;
		}
		matrix.row_offsets[i + 1] = at;
	}
	return matrix;
}

/* A^T A of it. */
static struct gnp_csr square_matrix(size_t side, double *points)
{
	struct gnp_csr matrix = grid_matrix(side, points), turned, square;
	CHECK(gnp_csr_transpose(&matrix, &turned, NULL) == GNP_OK);
	CHECK(gnp_csr_product(&turned, &matrix, pool, NULL, &square, NULL) == GNP_OK);
	gnp_csr_clear(&matrix);
	gnp_csr_clear(&turned);
	return square;
}

static struct gnp_factor *factor_as(const struct gnp_csr *matrix, bool symmetric, const double *points, struct gnp_pool *workers)
{
	struct gnp_factor_plan plan;
	struct gnp_factor *factor = NULL;
	struct gnp_error error = {0};
	CHECK(gnp_factor_plan_make(matrix, symmetric, points, workers, NULL, &plan, &error) == GNP_OK);
	if (gnp_factor_make_take(matrix, &plan, workers, NULL, &factor, &error) != GNP_OK)
		fprintf(stderr, "%s\n", error.text);
	CHECK(factor);
	return factor;
}

static struct gnp_factor *factor_of(const struct gnp_csr *matrix, const double *points, struct gnp_pool *workers)
{
	return factor_as(matrix, false, points, workers);
}

static void check_solves(const struct gnp_csr *matrix, const struct gnp_factor *factor, size_t count)
{
	size_t n = matrix->rows;
	double *x = malloc(n * count * sizeof *x), *want = malloc(n * count * sizeof *want), *y = malloc(n * sizeof *y);
	for (size_t i = 0; i < n * count; i++)
		want[i] = sin(0.3 * (double)i);
	for (size_t r = 0; r < count; r++)
		CHECK(gnp_csr_multiply(matrix, want + r * n, x + r * n, pool, NULL, NULL) == GNP_OK);
	CHECK(gnp_factor_solve(factor, x, count, pool, NULL, NULL) == GNP_OK);
	double worst = 0;
	for (size_t i = 0; i < n * count; i++)
		worst = fmax(worst, fabs(x[i] - want[i]));
	CHECK_AT_MOST(worst, 1e-9);
	free(x);
	free(want);
	free(y);
}

static void solves_what_the_matrix_multiplies(void)
{
	static const size_t sides[] = {1, 2, 7, 12, 40};
	for (size_t k = 0; k < sizeof sides / sizeof *sides; k++) {
		double *points = malloc(3 * sides[k] * sides[k] * sizeof *points);
		struct gnp_csr matrix = grid_matrix(sides[k], points);
		struct gnp_factor *factor = factor_of(&matrix, points, pool);
		check_solves(&matrix, factor, 1);
		check_solves(&matrix, factor, 3);
		check_solves(&matrix, factor, 19);
		gnp_factor_free(factor);
		gnp_csr_clear(&matrix);
		free(points);
	}
}

/* The pivot a diagonal of zeros hides must be found within its supernode. */
static void exchanges_rows_where_the_diagonal_is_zero(void)
{
	enum { N = 6 };
	double points[3 * N] = {0};
	struct gnp_csr matrix;
	CHECK(gnp_csr_allocate(N, N, N, &matrix, NULL) == GNP_OK);
	for (uint32_t i = 0; i < N; i++) {
		points[3 * i] = i / 2;
		matrix.column[i] = i ^ 1;
		matrix.value[i] = 1 + i;
		matrix.row_offsets[i + 1] = i + 1;
	}
	struct gnp_factor *factor = factor_of(&matrix, points, pool);
	if (factor)
		check_solves(&matrix, factor, 2);
	gnp_factor_free(factor);
	gnp_csr_clear(&matrix);
}

static void check_workers(bool symmetric)
{
	enum { SIDE = 50, N = SIDE * SIDE };
	double *points = malloc(3 * N * sizeof *points), *x = malloc(N * sizeof *x), *first = malloc(N * sizeof *first);
	struct gnp_csr matrix = symmetric ? square_matrix(SIDE, points) : grid_matrix(SIDE, points);
	for (unsigned workers = 1; workers <= 3; workers++) {
		struct gnp_pool *some;
		CHECK(gnp_pool_create(workers, &some, NULL) == GNP_OK);
		struct gnp_factor *factor = factor_as(&matrix, symmetric, points, some);
		for (int i = 0; i < N; i++)
			x[i] = cos(i);
		CHECK(gnp_factor_solve(factor, x, 1, some, NULL, NULL) == GNP_OK);
		if (workers == 1)
			memcpy(first, x, N * sizeof *x);
		CHECK(memcmp(first, x, N * sizeof *x) == 0);
		gnp_factor_free(factor);
		gnp_pool_free(some);
	}
	gnp_csr_clear(&matrix);
	free(points);
	free(x);
	free(first);
}

static void any_number_of_workers_gives_the_same_bytes(void)
{
	check_workers(false);
	check_workers(true);
}

static void symmetric_matrices_take_half(void)
{
	static const size_t sides[] = {1, 2, 7, 12, 40};
	for (size_t k = 0; k < sizeof sides / sizeof *sides; k++) {
		double *points = malloc(3 * sides[k] * sides[k] * sizeof *points);
		struct gnp_csr matrix = square_matrix(sides[k], points);
		struct gnp_factor *half = factor_as(&matrix, true, points, pool), *whole = factor_of(&matrix, points, pool);
		check_solves(&matrix, half, 1);
		check_solves(&matrix, half, 3);
		check_solves(&matrix, half, 19);
		if (sides[k] == 40)
			CHECK_AT_MOST((double)gnp_factor_bytes(half), 0.65 * (double)gnp_factor_bytes(whole));
		gnp_factor_free(half);
		gnp_factor_free(whole);
		gnp_csr_clear(&matrix);
		free(points);
	}
}

static void refuse(struct gnp_csr *matrix, bool symmetric, const double *points, struct gnp_task *task, gnp_status status, const char *text)
{
	struct gnp_factor_plan plan;
	struct gnp_factor *factor = NULL;
	struct gnp_error error = {0};
	CHECK(gnp_factor_plan_make(matrix, symmetric, points, pool, NULL, &plan, NULL) == GNP_OK);
	CHECK(gnp_factor_make_take(matrix, &plan, pool, task, &factor, &error) == status);
	CHECK_CONTAINS(error.text, text);
	CHECK(!factor);
}

static void singular_and_not_finite_matrices_are_refused(void)
{
	enum { SIDE = 20, N = SIDE * SIDE };
	double points[3 * N];
	struct gnp_csr matrix = grid_matrix(SIDE, points);
	struct gnp_task task;
	gnp_task_init(&task);
	gnp_task_stop(&task, GNP_DEADLINE);
	refuse(&matrix, false, points, &task, GNP_DEADLINE, "");
	matrix.value[700] = NAN;
	refuse(&matrix, false, points, NULL, GNP_SINGULAR, "of 400, the matrix is singular or not finite");
	for (size_t e = matrix.row_offsets[100]; e < matrix.row_offsets[101]; e++)
		matrix.value[e] = 0;
	matrix.value[700] = 0;
	refuse(&matrix, false, points, NULL, GNP_SINGULAR, "system: no pivot above 1e-14 at step ");
	gnp_csr_clear(&matrix);
	matrix = square_matrix(SIDE, points);
	refuse(&matrix, true, points, &task, GNP_DEADLINE, "");
	for (size_t e = 0; e < matrix.row_offsets[N]; e++)
		matrix.value[e] = -matrix.value[e];
	refuse(&matrix, true, points, NULL, GNP_SINGULAR, "system: no pivot above 1e-14 at step 1 of 400");
	matrix.value[0] = NAN;
	refuse(&matrix, true, points, NULL, GNP_SINGULAR, "system: no pivot above 1e-14 at step ");
	gnp_csr_clear(&matrix);
}

/* What is promised before the factor holds: the fill of a grid is far below that of a band. */
static void the_plan_knows_the_size_and_keeps_it_small(void)
{
	enum { SIDE = 60, N = SIDE * SIDE };
	double *points = malloc(3 * N * sizeof *points);
	struct gnp_csr matrix = grid_matrix(SIDE, points);
	struct gnp_factor_plan plan;
	CHECK(gnp_factor_plan_make(&matrix, false, points, pool, NULL, &plan, NULL) == GNP_OK);
	CHECK(plan.bytes < plan.peak_bytes);
	CHECK_AT_MOST((double)plan.value_start[plan.symbolic.supernodes], 0.7 * 2 * SIDE * N);
	size_t bytes = plan.bytes;
	struct gnp_factor *factor = NULL;
	CHECK(gnp_factor_make_take(&matrix, &plan, pool, NULL, &factor, NULL) == GNP_OK);
	CHECK(gnp_factor_bytes(factor) == bytes);
	gnp_factor_free(factor);
	gnp_csr_clear(&matrix);
	free(points);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(solves_what_the_matrix_multiplies), TEST(exchanges_rows_where_the_diagonal_is_zero),
	                                    TEST(symmetric_matrices_take_half), TEST(any_number_of_workers_gives_the_same_bytes),
	                                    TEST(singular_and_not_finite_matrices_are_refused),
	                                    TEST(the_plan_knows_the_size_and_keeps_it_small)};
	gnp_linalg_init();
	if (gnp_pool_create(0, &pool, NULL) != GNP_OK)
		return 1;
	int status = RUN_TESTS(tests);
	gnp_pool_free(pool);
	return status;
}
