#include "core/cells/diffusion.h"

#include <pthread.h>
#include <time.h>

#include "core/base/random.h"
#include "core/base/vector.h"
#include "core/cells/cell.h"
#include "core/search/neighbors.h"
#include "tests/unit/test.h"

enum { COUNT = 60, EDGES = 4 };
static struct gnp_pool *pool;

/* A ring of points with chords, weights that differ with the direction, and some edges one way only. */
static void ring(uint32_t *neighbor, float *weight)
{
	for (size_t i = 0; i < COUNT; i++) {
		const size_t to[EDGES] = {i + 1, i + COUNT - 1, i + 7, i};
		for (size_t e = 0; e < EDGES; e++) {
			neighbor[EDGES * i + e] = (uint32_t)(to[e] % COUNT);
			weight[EDGES * i + e] = e == 3 ? 0 : (float)(1 + 0.1 * (double)((3 * i + e) % 5));
		}
	}
}

/* The same by the definition: dense. */
static void dense(const uint32_t *neighbor, const float *weight, double *matrix)
{
	memset(matrix, 0, COUNT * COUNT * sizeof *matrix);
	for (size_t i = 0; i < COUNT; i++)
		for (size_t e = 0; e < EDGES; e++) {
			size_t j = neighbor[EDGES * i + e];
			double half = (double)weight[EDGES * i + e] / 2;
			matrix[i * COUNT + j] -= half;
			matrix[j * COUNT + i] -= half;
			matrix[i * COUNT + i] += half;
			matrix[j * COUNT + j] += half;
		}
}

static struct gnp_stiffness made(const uint32_t *neighbor, const float *weight)
{
	struct gnp_stiffness s;
	CHECK(gnp_stiffness_make(COUNT, EDGES, neighbor, weight, NULL, &s, NULL) == GNP_OK);
	return s;
}

static void fill(double *values, size_t count, uint64_t seed)
{
	struct gnp_random random;
	gnp_random_seed(&random, seed, 0);
	for (size_t i = 0; i < count; i++)
		values[i] = gnp_random_normal(&random);
}

static void stiffness_is_the_dense_one(void)
{
	uint32_t neighbor[COUNT * EDGES];
	float weight[COUNT * EDGES];
	static double matrix[COUNT * COUNT];
	double in[3 * COUNT], out[3 * COUNT];
	ring(neighbor, weight);
	dense(neighbor, weight, matrix);
	struct gnp_stiffness s = made(neighbor, weight);
	fill(in, 3 * COUNT, 1);
	CHECK(gnp_stiffness_apply(&s, in, out, pool, NULL, NULL) == GNP_OK);
	for (size_t i = 0; i < COUNT; i++) {
		double row = s.diagonal[i];
		for (size_t at = s.start[i]; at < s.start[i + 1]; at++) {
			row -= s.value[at];
			CHECK(s.value[at] > 0 && (at == s.start[i] || s.column[at - 1] < s.column[at]));
		}
		CHECK_NEAR(row, 0, 1e-14);
		for (size_t c = 0; c < 3; c++) {
			double sum = 0;
			for (size_t j = 0; j < COUNT; j++)
				sum += matrix[i * COUNT + j] * in[3 * j + c];
			CHECK_NEAR(out[3 * i + c], sum, 1e-12);
		}
	}
	gnp_stiffness_clear(&s);
}

static void solution_solves_and_holds_what_is_fixed(void)
{
	uint32_t neighbor[COUNT * EDGES];
	float weight[COUNT * EDGES];
	double mass[COUNT], rhs[3 * COUNT], x[3 * COUNT], back[3 * COUNT];
	unsigned char fixed[COUNT] = {0};
	size_t iterations;
	ring(neighbor, weight);
	struct gnp_stiffness s = made(neighbor, weight);
	for (size_t i = 0; i < COUNT; i++)
		mass[i] = 0.01 * (double)(1 + i % 3);
	fill(rhs, 3 * COUNT, 2);
	fixed[5] = fixed[40] = 1;
	for (int hold = 0; hold < 2; hold++) {
		const struct gnp_diffusion d = {&s, mass, 3, hold ? fixed : NULL};
		fill(x, 3 * COUNT, 3); /* any guess */
		CHECK(gnp_diffusion_solve(&d, rhs, x, pool, NULL, &iterations, NULL) == GNP_OK);
		CHECK(iterations > 3 && iterations < 3 * COUNT);
		CHECK(gnp_stiffness_apply(&s, x, back, pool, NULL, NULL) == GNP_OK);
		for (size_t i = 0; i < COUNT; i++)
			for (size_t c = 0; c < 3; c++) {
				if (hold && fixed[i])
					CHECK(x[3 * i + c] == 0);
				else
					CHECK_NEAR(mass[i] * x[3 * i + c] + 3 * back[3 * i + c], rhs[3 * i + c], 1e-8);
			}
	}
	memset(fixed, 1, COUNT);
	CHECK(gnp_diffusion_solve(&(struct gnp_diffusion){&s, mass, 3, fixed}, rhs, x, pool, NULL, &iterations, NULL) == GNP_OK);
	CHECK(iterations == 0 && x[0] == 0 && x[3 * COUNT - 1] == 0);
	gnp_stiffness_clear(&s);
}

/* Gauss's elimination, with the largest pivot: x (COUNT, 3) in, the solution out. */
static void eliminate(double *matrix, double *x)
{
	for (size_t k = 0; k < COUNT; k++) {
		size_t pivot = k;
		for (size_t i = k; i < COUNT; i++)
			pivot = fabs(matrix[i * COUNT + k]) > fabs(matrix[pivot * COUNT + k]) ? i : pivot;
		for (size_t j = 0; j < COUNT + 3; j++) {
			double *a = j < COUNT ? matrix + k * COUNT + j : x + 3 * k + j - COUNT, *b = j < COUNT ? matrix + pivot * COUNT + j : x + 3 * pivot + j - COUNT;
			double swap = *a;
			*a = *b;
			*b = swap;
		}
		for (size_t i = 0; i < COUNT; i++) {
			double times = matrix[i * COUNT + k] / matrix[k * COUNT + k];
			for (size_t j = k; j < COUNT && i != k; j++)
				matrix[i * COUNT + j] -= times * matrix[k * COUNT + j];
			for (size_t c = 0; c < 3 && i != k; c++)
				x[3 * i + c] -= times * x[3 * k + c];
		}
	}
	for (size_t i = 0; i < 3 * COUNT; i++)
		x[i] /= matrix[i / 3 * COUNT + i / 3];
}

static void solution_is_that_of_elimination(void)
{
	uint32_t neighbor[COUNT * EDGES];
	float weight[COUNT * EDGES];
	static double matrix[COUNT * COUNT];
	double mass[COUNT], rhs[3 * COUNT], x[3 * COUNT], want[3 * COUNT];
	unsigned char fixed[COUNT] = {0};
	size_t iterations;
	static const double factors[] = {0, 1e-3, 1, 1e4};
	ring(neighbor, weight);
	struct gnp_stiffness s = made(neighbor, weight);
	fill(rhs, 3 * COUNT, 5);
	fixed[0] = fixed[33] = 1;
	for (size_t f = 0; f < 4; f++) {
		dense(neighbor, weight, matrix);
		for (size_t i = 0; i < COUNT * COUNT; i++)
			matrix[i] *= factors[f];
		for (size_t i = 0; i < COUNT; i++) {
			mass[i] = 0.1 * (double)(1 + i % 7);
			matrix[i * COUNT + i] += mass[i];
			for (size_t j = 0; j < COUNT && fixed[i]; j++)
				matrix[i * COUNT + j] = i == j;
		}
		for (size_t i = 0; i < 3 * COUNT; i++)
			want[i] = fixed[i / 3] ? 0 : rhs[i];
		eliminate(matrix, want);
		memset(x, 0, sizeof x);
		CHECK(gnp_diffusion_solve(&(struct gnp_diffusion){&s, mass, factors[f], fixed}, rhs, x, pool, NULL, &iterations, NULL) == GNP_OK);
		for (size_t i = 0; i < 3 * COUNT; i++)
			CHECK_NEAR(x[i], want[i], 1e-8);
	}
	gnp_stiffness_clear(&s);
}

/* Squares of residuals overflowed from lengths of 1e51 on and vanished below 1e-45: the guess was the answer. */
static void units_do_not_matter(void)
{
	uint32_t neighbor[COUNT * EDGES];
	float weight[COUNT * EDGES];
	double mass[COUNT], rhs[3 * COUNT], x[3 * COUNT], first[3 * COUNT], scaled[3 * COUNT];
	size_t iterations, same = 0;
	ring(neighbor, weight);
	struct gnp_stiffness s = made(neighbor, weight);
	fill(rhs, 3 * COUNT, 6);
	for (int power = 0; power <= 300; power = power > 0 ? -power : 100 - power) {
		double unit = ldexp(1, power); /* of length: masses go with its square, right-hand sides with its cube */
		for (size_t i = 0; i < COUNT; i++)
			mass[i] = 0.1 * (double)(1 + i % 7) * unit * unit;
		for (size_t i = 0; i < 3 * COUNT; i++)
			scaled[i] = rhs[i] * unit * unit * unit;
		memset(x, 0, sizeof x);
		CHECK(gnp_diffusion_solve(&(struct gnp_diffusion){&s, mass, 2 * unit * unit, NULL}, scaled, x, pool, NULL, &iterations, NULL) == GNP_OK);
		if (power == 0)
			memcpy(first, x, sizeof x);
		for (size_t i = 0; i < 3 * COUNT; i++)
			same += x[i] == first[i] * unit;
	}
	CHECK(same == 7 * 3 * COUNT);
	gnp_stiffness_clear(&s);
}

static void nothing_diffuses_to_nothing(void)
{
	uint32_t neighbor[COUNT * EDGES];
	float weight[COUNT * EDGES];
	double mass[COUNT], rhs[3 * COUNT] = {0}, x[3 * COUNT];
	size_t iterations;
	ring(neighbor, weight);
	struct gnp_stiffness s = made(neighbor, weight);
	for (size_t i = 0; i < COUNT; i++)
		mass[i] = 1;
	fill(x, 3 * COUNT, 7);
	CHECK(gnp_diffusion_solve(&(struct gnp_diffusion){&s, mass, 2, NULL}, rhs, x, pool, NULL, &iterations, NULL) == GNP_OK);
	CHECK(iterations == 0 && x[0] == 0 && x[3 * COUNT - 1] == 0);
	for (size_t i = 0; i < COUNT; i++)
		rhs[3 * i + 1] = 1;
	fill(x, 3 * COUNT, 7);
	CHECK(gnp_diffusion_solve(&(struct gnp_diffusion){&s, mass, 2, NULL}, rhs, x, pool, NULL, &iterations, NULL) == GNP_OK);
	for (size_t i = 0; i < COUNT; i++) {
		CHECK(x[3 * i] == 0 && x[3 * i + 2] == 0);
		CHECK_NEAR(x[3 * i + 1], 1, 1e-9);
	}
	gnp_stiffness_clear(&s);
}

/* NaN is not above a limit: the answer was taken for good. */
static void numbers_that_are_none_do_not_converge(void)
{
	uint32_t neighbor[COUNT * EDGES];
	float weight[COUNT * EDGES];
	double mass[COUNT], rhs[3 * COUNT], x[3 * COUNT] = {0};
	size_t iterations;
	struct gnp_error error = {0};
	ring(neighbor, weight);
	weight[5] = INFINITY;
	struct gnp_stiffness s = made(neighbor, weight);
	fill(rhs, 3 * COUNT, 8);
	for (size_t i = 0; i < COUNT; i++)
		mass[i] = 1;
	CHECK(gnp_diffusion_solve(&(struct gnp_diffusion){&s, mass, 2, NULL}, rhs, x, pool, NULL, &iterations, &error) == GNP_NO_CONVERGENCE);
	CHECK_CONTAINS(error.text, "diffusion: the residual after ");
	gnp_stiffness_clear(&s);
}

static void points_without_edges_keep_to_themselves(void)
{
	uint32_t neighbor[COUNT * EDGES] = {0};
	float weight[COUNT * EDGES] = {0};
	double mass[COUNT], rhs[3 * COUNT], x[3 * COUNT] = {0};
	size_t iterations;
	struct gnp_stiffness s = made(neighbor, weight);
	fill(rhs, 3 * COUNT, 9);
	for (size_t i = 0; i < COUNT; i++)
		mass[i] = 4;
	CHECK(s.start[COUNT] == 0);
	CHECK(gnp_diffusion_solve(&(struct gnp_diffusion){&s, mass, 2, NULL}, rhs, x, pool, NULL, &iterations, NULL) == GNP_OK);
	for (size_t i = 0; i < 3 * COUNT; i++)
		CHECK_NEAR(x[i], rhs[i] / 4, 1e-9);
	gnp_stiffness_clear(&s);
}

static void bytes_do_not_depend_on_workers(void)
{
	enum { MANY = 20000 };
	uint32_t *neighbor = malloc(MANY * EDGES * sizeof *neighbor);
	float *weight = malloc(MANY * EDGES * sizeof *weight);
	double *mass = malloc(MANY * sizeof *mass), *rhs = malloc(3 * MANY * sizeof *rhs), *x[2] = {calloc(3 * MANY, 8), calloc(3 * MANY, 8)};
	struct gnp_stiffness s;
	for (size_t i = 0; i < MANY * EDGES; i++) {
		const size_t step[EDGES] = {1, MANY - 1, 141, MANY - 141};
		neighbor[i] = (uint32_t)((i / EDGES + step[i % EDGES]) % MANY);
		weight[i] = 1;
		mass[i / EDGES] = 1;
	}
	fill(rhs, 3 * MANY, 4);
	CHECK(gnp_stiffness_make(MANY, EDGES, neighbor, weight, NULL, &s, NULL) == GNP_OK);
	for (unsigned run = 0; run < 2; run++) {
		struct gnp_pool *own;
		size_t iterations;
		CHECK(gnp_pool_create(1 + 2 * run, &own, NULL) == GNP_OK);
		CHECK(gnp_diffusion_solve(&(struct gnp_diffusion){&s, mass, 5, NULL}, rhs, x[run], own, NULL, &iterations, NULL) == GNP_OK);
		gnp_pool_free(own);
	}
	CHECK(memcmp(x[0], x[1], 3 * MANY * sizeof *x[0]) == 0);
	gnp_stiffness_clear(&s);
	free(neighbor);
	free(weight);
	free(mass);
	free(rhs);
	free(x[0]);
	free(x[1]);
}

/* Cells of a sphere: S u is l (l + 1) M u for harmonics of degree l, here z and z^2 - 1/3. */
static void cells_of_a_sphere_have_its_laplacian(void)
{
	enum { POINTS = 6000, ROW = 16 };
	double *points = malloc(3 * POINTS * sizeof *points), *u = calloc(3 * POINTS, sizeof *u), *su = malloc(3 * POINTS * sizeof *su);
	double *area = malloc(POINTS * sizeof *area), *x = malloc(3 * POINTS * sizeof *x);
	uint32_t *neighbor = calloc(POINTS * ROW, sizeof *neighbor);
	float *weight = calloc(POINTS * ROW, sizeof *weight);
	struct gnp_neighbors *tree;
	struct gnp_scratch *scratch = gnp_scratch_create();
	struct gnp_stiffness s;
	for (size_t i = 0; i < POINTS; i++) { /* a Fibonacci spiral */
		double z = 1 - (2 * (double)i + 1) / POINTS, r = sqrt(1 - z * z), turn = 2.399963229728653 * (double)i;
		points[3 * i] = r * cos(turn);
		points[3 * i + 1] = r * sin(turn);
		points[3 * i + 2] = u[3 * i] = z;
		u[3 * i + 1] = z * z - 1.0 / 3;
	}
	CHECK(gnp_neighbors_build(points, POINTS, &tree, NULL) == GNP_OK);
	for (size_t i = 0; i < POINTS; i++) {
		uint32_t index[GNP_CELL_NEIGHBORS];
		double distance[GNP_CELL_NEIGHBORS], tangents[2][3];
		struct gnp_cell cell;
		gnp_neighbors_knn(tree, points + 3 * i, 1, GNP_CELL_NEIGHBORS, index, distance, scratch, NULL);
		gnp_cell_make(points, points, i, index, GNP_CELL_NEIGHBORS, tangents, &cell);
		area[i] = cell.area;
		for (size_t e = 0; e < cell.edges && e < ROW; e++) {
			neighbor[ROW * i + e] = index[cell.neighbor[e]];
			weight[ROW * i + e] = (float)cell.weight[e];
		}
	}
	CHECK(gnp_stiffness_make(POINTS, ROW, neighbor, weight, NULL, &s, NULL) == GNP_OK);
	CHECK(gnp_stiffness_apply(&s, u, su, pool, NULL, NULL) == GNP_OK);
	double top[2] = {0}, bottom[2] = {0}; /* Rayleigh quotients */
	for (size_t i = 0; i < POINTS; i++)
		for (size_t c = 0; c < 2; c++) {
			top[c] += u[3 * i + c] * su[3 * i + c];
			bottom[c] += u[3 * i + c] * u[3 * i + c] * area[i];
		}
	CHECK_NEAR(top[0] / bottom[0], 2, 0.01);
	CHECK_NEAR(top[1] / bottom[1], 6, 0.03);
	/* an implicit step divides them by 1 + c l (l + 1) */
	double c = 0.3, worst[2] = {0};
	size_t iterations;
	for (size_t i = 0; i < 3 * POINTS; i++) {
		su[i] = area[i / 3] * u[i];
		x[i] = u[i];
	}
	CHECK(gnp_diffusion_solve(&(struct gnp_diffusion){&s, area, c, NULL}, su, x, pool, NULL, &iterations, NULL) == GNP_OK);
	for (size_t i = 0; i < 3 * POINTS; i++)
		if (i % 3 < 2)
			worst[i % 3] = fmax(worst[i % 3], fabs(x[i] - u[i] / (1 + c * (i % 3 ? 6 : 2))));
	CHECK_AT_MOST(worst[0], 0.003);
	CHECK_AT_MOST(worst[1], 0.003);
	gnp_stiffness_clear(&s);
	gnp_neighbors_free(tree);
	gnp_scratch_free(scratch);
	free(points);
	free(u);
	free(su);
	free(area);
	free(x);
	free(neighbor);
	free(weight);
}

static void *cancel_later(void *task)
{
	nanosleep(&(struct timespec){.tv_nsec = 30000000}, NULL);
	gnp_task_cancel(task);
	return NULL;
}

/* A ring of as many points as need far more iterations than there is time for. */
static void making_and_solving_are_cancelled(void)
{
	enum { MANY = 40000 };
	uint32_t *neighbor = malloc(MANY * 2 * sizeof *neighbor);
	float *weight = malloc(MANY * 2 * sizeof *weight);
	double *mass = malloc(MANY * sizeof *mass), *rhs = malloc(3 * MANY * sizeof *rhs), *x = calloc(3 * MANY, sizeof *x);
	size_t iterations;
	struct gnp_task task;
	struct gnp_stiffness s;
	pthread_t thread;
	for (size_t i = 0; i < 2 * MANY; i++) {
		neighbor[i] = (uint32_t)((i / 2 + (i % 2 ? 1 : MANY - 1)) % MANY);
		weight[i] = 1;
		mass[i / 2] = 1;
	}
	fill(rhs, 3 * MANY, 10);
	gnp_task_init(&task);
	CHECK(gnp_stiffness_make(MANY, 2, neighbor, weight, &task, &s, NULL) == GNP_OK);
	CHECK(pthread_create(&thread, NULL, cancel_later, &task) == 0);
	double begun = gnp_clock();
	CHECK(gnp_diffusion_solve(&(struct gnp_diffusion){&s, mass, 1e12, NULL}, rhs, x, pool, &task, &iterations, NULL) == GNP_CANCELLED);
	CHECK_AT_MOST(gnp_clock() - begun, 2);
	pthread_join(thread, NULL);
	gnp_stiffness_clear(&s);
	struct gnp_stiffness unchanged = s;
	CHECK(gnp_stiffness_make(MANY, 2, neighbor, weight, &task, &s, NULL) == GNP_CANCELLED);
	CHECK(memcmp(&s, &unchanged, sizeof s) == 0);
	free(neighbor);
	free(weight);
	free(mass);
	free(rhs);
	free(x);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(stiffness_is_the_dense_one),
	                                    TEST(solution_solves_and_holds_what_is_fixed),
	                                    TEST(solution_is_that_of_elimination),
	                                    TEST(units_do_not_matter),
	                                    TEST(nothing_diffuses_to_nothing),
	                                    TEST(numbers_that_are_none_do_not_converge),
	                                    TEST(points_without_edges_keep_to_themselves),
	                                    TEST(bytes_do_not_depend_on_workers),
	                                    TEST(cells_of_a_sphere_have_its_laplacian),
	                                    TEST(making_and_solving_are_cancelled)};
	CHECK(gnp_pool_create(2, &pool, NULL) == GNP_OK);
	int failed = RUN_TESTS(tests);
	gnp_pool_free(pool);
	return failed;
}
