/* The step for matrices: what comes out of the orthogonalisation is nearly orthonormal and keeps singular directions;
 * an update moves matrices by it and all else by Adam, for any number of workers. */
#include "core/base/random.h"
#include "core/linear/linalg.h"
#include "tests/unit/test.h"
#include "weights/train/muon.h"

static struct gnp_scratch *scratch;

static void draw(size_t count, uint64_t seed, float *matrix)
{
	struct gnp_random random;
	gnp_random_seed(&random, seed, 0);
	for (size_t i = 0; i < count; i++)
		matrix[i] = (float)(7 * gnp_random_normal(&random));
}

/* For unit vectors x on the smaller side, |X^T x|^2 lies between the squares of X's singular values. */
static void check_singular_values(size_t rows, size_t columns)
{
	enum { MOST = 96 * 256, TRIALS = 50 };
	static float matrix[MOST];
	struct gnp_random random;
	size_t n = rows < columns ? rows : columns, m = rows * columns / n;
	double trace = 0;
	draw(rows * columns, 3, matrix);
	CHECK(gnp_muon_orthogonalize(rows, columns, matrix, scratch, NULL) == GNP_OK);
	gnp_random_seed(&random, 5, 0);
	for (int trial = 0; trial < TRIALS; trial++) {
		double x[256], length = 0, square = 0;
		for (size_t i = 0; i < n; i++) {
			x[i] = gnp_random_normal(&random);
			length += x[i] * x[i];
		}
		for (size_t j = 0; j < m; j++) {
			double sum = 0;
			for (size_t i = 0; i < n; i++)
				sum += x[i] * (double)matrix[rows <= columns ? i * columns + j : j * columns + i];
			square += sum * sum;
		}
		CHECK(square / length > 0.36 && square / length < 1.7);
	}
	for (size_t i = 0; i < rows * columns; i++)
		trace += (double)matrix[i] * (double)matrix[i];
	CHECK_NEAR(trace / (double)n, 1, 0.35);
}

static void singular_values_come_near_one(void)
{
	check_singular_values(16, 128);
	check_singular_values(128, 16);
	check_singular_values(96, 256);
	check_singular_values(256, 96);
}

/* A diagonal matrix stays one, its entries' signs too, and those that differ a hundredfold come close. */
static void singular_directions_stay(void)
{
	enum { SIDE = 16 };
	float matrix[SIDE * SIDE] = {0};
	for (int i = 0; i < SIDE; i++)
		matrix[i * SIDE + i] = (i % 2 ? -1.0f : 1.0f) * powf(0.75f, (float)i);
	CHECK(gnp_muon_orthogonalize(SIDE, SIDE, matrix, scratch, NULL) == GNP_OK);
	for (int i = 0; i < SIDE; i++)
		for (int j = 0; j < SIDE; j++) {
			double entry = (double)matrix[i * SIDE + j] * (i % 2 ? -1 : 1);
			CHECK(i == j ? entry > 0.6 && entry < 1.3 : fabs(entry) < 1e-5);
		}
}

static void zeros_stay_zeros(void)
{
	float matrix[16 * 20] = {0};
	CHECK(gnp_muon_orthogonalize(16, 20, matrix, scratch, NULL) == GNP_OK);
	for (int i = 0; i < 16 * 20; i++)
		CHECK(matrix[i] == 0);
}

/* Of a network: parameters (layout->total) after three steps of known gradients. */
static void take_steps(const struct gnp_layout *layout, unsigned workers, float *parameters)
{
	struct gnp_pool *pool;
	struct gnp_adam adam;
	float *gradient = malloc(layout->total * sizeof *gradient);
	CHECK(gnp_pool_create(workers, &pool, NULL) == GNP_OK && gnp_adam_create(layout->total, &adam, NULL) == GNP_OK);
	draw(layout->total, 1, parameters);
	for (uint64_t step = 0; step < 3; step++) {
		draw(layout->total, 10 + step, gradient);
		CHECK(gnp_muon_update(layout, &adam, 0.01, gradient, parameters, pool, NULL) == GNP_OK);
	}
	gnp_adam_clear(&adam);
	gnp_pool_free(pool);
	free(gradient);
}

static void take_steps_of_adam(const struct gnp_layout *layout, float *parameters)
{
	struct gnp_adam adam;
	float *gradient = malloc(layout->total * sizeof *gradient);
	CHECK(gnp_adam_create(layout->total, &adam, NULL) == GNP_OK);
	draw(layout->total, 1, parameters);
	for (uint64_t step = 0; step < 3; step++) {
		draw(layout->total, 10 + step, gradient);
		gnp_adam_update(&adam, 0.01, gradient, parameters);
	}
	gnp_adam_clear(&adam);
	free(gradient);
}

static void matrices_move_by_it_and_vectors_by_adam(void)
{
	static const struct gnp_architecture a = {.trunk = GNP_TRUNK_SEPARABLE,
	                                          .head = GNP_HEAD_POOLED,
	                                          .features = 3,
	                                          .width = 16,
	                                          .channels = 4,
	                                          .neurons = 24,
	                                          .layers = 2,
	                                          .quadrature = 8,
	                                          .head_width = 32,
	                                          .outputs = 16};
	struct gnp_layout layout;
	CHECK(gnp_architecture_layout(&a, &layout, NULL) == GNP_OK);
	float *one = malloc(layout.total * sizeof *one), *three = malloc(layout.total * sizeof *three);
	float *adam = malloc(layout.total * sizeof *adam), *begun = malloc(layout.total * sizeof *begun);
	take_steps(&layout, 1, one);
	take_steps(&layout, 3, three);
	take_steps_of_adam(&layout, adam);
	draw(layout.total, 1, begun);
	CHECK(memcmp(one, three, layout.total * sizeof *one) == 0);
	for (size_t r = 0; r < layout.rows; r++) {
		const struct gnp_parameter_row *row = &layout.row[r];
		double square = 0;
		CHECK((memcmp(one + row->offset, adam + row->offset, row->count * sizeof *one) != 0) == gnp_muon_takes(row));
		CHECK(gnp_muon_takes(row) == (row->rank == 2 && row->shape[1] != 3));
		for (size_t i = row->offset; i < row->offset + row->count; i++)
			square += ((double)one[i] - (double)begun[i]) * ((double)one[i] - (double)begun[i]) / (double)row->count;
		CHECK(sqrt(square) > 0.001 && sqrt(square) < 0.03); /* three steps of 0.01 at most */
	}
	free(one);
	free(three);
	free(adam);
	free(begun);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(singular_values_come_near_one), TEST(singular_directions_stay),
	                                    TEST(zeros_stay_zeros), TEST(matrices_move_by_it_and_vectors_by_adam)};
	gnp_linalg_init();
	scratch = gnp_scratch_create();
	int failed = RUN_TESTS(tests);
	gnp_scratch_free(scratch);
	return failed;
}
