#include "core/base/random.h"
#include "core/linear/csr.h"
#include "tests/unit/test.h"

static struct gnp_pool *pool;

/* A random matrix and the same densely, (rows, columns). */
static struct gnp_csr random_matrix(size_t rows, size_t columns, uint64_t seed, double *dense)
{
	struct gnp_random random;
	struct gnp_csr matrix;
	gnp_random_seed(&random, seed, 0);
	CHECK(gnp_csr_allocate(rows, columns, rows * columns, &matrix, NULL) == GNP_OK);
	size_t at = 0;
	for (size_t i = 0; i < rows; i++) {
		for (size_t j = 0; j < columns; j++) {
			dense[i * columns + j] = gnp_random_uniform(&random) < 0.3 ? gnp_random_normal(&random) : 0;
			if (dense[i * columns + j] == 0)
				continue;
			matrix.column[at] = (uint32_t)j;
			matrix.value[at++] = dense[i * columns + j];
		}
		matrix.row_offsets[i + 1] = at;
	}
	return matrix;
}

static void check_dense(const struct gnp_csr *matrix, const double *want)
{
	for (size_t i = 0; i < matrix->rows; i++) {
		size_t e = matrix->row_offsets[i];
		for (size_t j = 0; j < matrix->columns; j++) {
			bool present = e < matrix->row_offsets[i + 1] && matrix->column[e] == j;
			CHECK_NEAR(present ? matrix->value[e] : 0, want[i * matrix->columns + j], 1e-12);
			e += present;
		}
		CHECK(e == matrix->row_offsets[i + 1]);
	}
}

enum { M = 17, N = 11, K = 7 };

static void multiplies_as_the_dense_matrix_does(void)
{
	double dense[M * N], x[N], y[M];
	struct gnp_csr matrix = random_matrix(M, N, 1, dense);
	for (int j = 0; j < N; j++)
		x[j] = j - 3;
	CHECK(gnp_csr_multiply(&matrix, x, y, pool, NULL, NULL) == GNP_OK);
	for (int i = 0; i < M; i++) {
		double sum = 0;
		for (int j = 0; j < N; j++)
			sum += dense[i * N + j] * x[j];
		CHECK_NEAR(y[i], sum, 1e-12);
	}
	gnp_csr_clear(&matrix);
}

static void transposes_and_products_are_the_dense_ones(void)
{
	double a[M * N], b[N * K], turned[N * M], product[M * K];
	struct gnp_csr left = random_matrix(M, N, 2, a), right = random_matrix(N, K, 3, b), out;
	for (int i = 0; i < M; i++)
		for (int j = 0; j < N; j++)
			turned[j * M + i] = a[i * N + j];
	CHECK(gnp_csr_transpose(&left, &out, NULL) == GNP_OK);
	check_dense(&out, turned);
	gnp_csr_clear(&out);
	for (int i = 0; i < M; i++)
		for (int k = 0; k < K; k++) {
			product[i * K + k] = 0;
			for (int j = 0; j < N; j++)
				product[i * K + k] += a[i * N + j] * b[j * K + k];
		}
	CHECK(gnp_csr_product(&left, &right, pool, NULL, &out, NULL) == GNP_OK);
	check_dense(&out, product);
	gnp_csr_clear(&out);
	gnp_csr_clear(&left);
	gnp_csr_clear(&right);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(multiplies_as_the_dense_matrix_does), TEST(transposes_and_products_are_the_dense_ones)};
	if (gnp_pool_create(0, &pool, NULL) != GNP_OK)
		return 1;
	int status = RUN_TESTS(tests);
	gnp_pool_free(pool);
	return status;
}
