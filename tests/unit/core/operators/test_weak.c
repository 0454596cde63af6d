/* The weak Laplacian holds on any cloud: symmetric, no weight negative, constants in its kernel; heat by it stays
 * between what it began with, and its eigenvalues are real and not negative. */
#include "core/operators/weak.h"

#include "core/base/random.h"
#include "core/equations/heat.h"
#include "core/equations/spectrum.h"
#include "core/estimate/estimate_options.h"
#include "core/model/models.h"
#include "tests/unit/test.h"

static struct gnp_pool *pool;

enum { BOTH = GNP_DERIVATIVE_BIT(GNP_DERIVATIVE_LAPLACIAN) | GNP_DERIVATIVE_BIT(GNP_DERIVATIVE_STIFFNESS) };
enum cloud { GRID, RANDOM_SQUARE, RANDOM_SPHERE, TWO_PIECES, LINES, CLOUDS };

static size_t make_cloud(enum cloud kind, double *points)
{
	struct gnp_random random;
	size_t made = 0;
	gnp_random_seed(&random, 9, (uint64_t)kind);
	for (size_t i = 0; i < 1600; i++) {
		double x = (double)(i % 40) / 39, y = (double)(i / 40) / 39, z = 0, length = 1;
		if (kind == RANDOM_SQUARE) {
			x = gnp_random_uniform(&random);
			y = gnp_random_uniform(&random);
		}
		if (kind == TWO_PIECES)
			x += i % 40 < 20 ? 0 : 3;
		if (kind == LINES)
			y *= 6;
		if (kind == RANDOM_SPHERE) {
			x = gnp_random_normal(&random);
			y = gnp_random_normal(&random);
			z = gnp_random_normal(&random);
			length = sqrt(x * x + y * y + z * z);
		}
		points[made++] = x / length;
		points[made++] = y / length;
		points[made++] = z / length;
	}
	return made / 3;
}

static struct gnp_poisson_options options_with(int system)
{
	struct gnp_poisson_options options = gnp_poisson_defaults();
	options.laplacian.domain.estimate = gnp_estimate_defaults();
	options.laplacian.domain.estimate.estimator = GNP_ESTIMATOR_GMLS;
	options.laplacian.system = system;
	return options;
}

static void it_is_symmetric_and_monotone_on_every_cloud(void)
{
	static double points[3 * 1600];
	for (int kind = 0; kind < CLOUDS; kind++) {
		size_t n = make_cloud((enum cloud)kind, points);
		struct gnp_poisson_options options = options_with(GNP_SYSTEM_SYMMETRIC);
		struct gnp_domain domain;
		struct gnp_collocation made;
		const struct gnp_cloud cloud = {n, points, NULL};
		CHECK(gnp_domain_make(&cloud, &options.laplacian.domain, pool, NULL, &domain, NULL) == GNP_OK);
		CHECK(gnp_weak_make(&domain, BOTH, NULL, pool, NULL, &made, NULL) == GNP_OK);
		double *dense = calloc(n * n, sizeof *dense);
		const double *value = made.value[GNP_DERIVATIVE_LAPLACIAN];
		for (size_t i = 0; i < n; i++) {
			double sum = 0, own = 0;
			for (size_t e = made.row_offsets[i]; e < made.row_offsets[i + 1]; e++) {
				dense[i * n + made.column[e]] = domain.area[i] * value[e];
				sum += value[e];
				own += made.column[e] == i ? value[e] : 0;
				CHECK(made.column[e] == i ? value[e] <= 0 : value[e] > 0);
				CHECK_NEAR(-made.value[GNP_DERIVATIVE_STIFFNESS][e] / made.mass[i], value[e], 1e-14 * fabs(value[e]));
			}
			CHECK_NEAR(sum, 0, 1e-12 * fabs(own));
		}
		size_t off = 0;
		for (size_t i = 0; i < n * n; i++)
			off += fabs(dense[i] - dense[i % n * n + i / n]) > 1e-12 * fabs(dense[i]);
		CHECK(off == 0);
		free(dense);
		gnp_collocation_clear(&made);
		gnp_domain_clear(&domain);
	}
}

/* Random beginnings and steps of every size. */
static void heat_stays_between_its_least_and_its_most(void)
{
	static const double steps[] = {1e-6, 1e-3, 1, 1e3};
	static double points[3 * 1600], u[2 * 1600];
	struct gnp_random random;
	gnp_random_seed(&random, 3, 3);
	for (int kind = 0; kind < CLOUDS; kind++)
		for (int s = 0; s < 4; s++) {
			size_t n = make_cloud((enum cloud)kind, points);
			struct gnp_poisson_options options = options_with(GNP_SYSTEM_SYMMETRIC);
			struct gnp_poisson *poisson = NULL;
			const struct gnp_cloud cloud = {n, points, NULL};
			CHECK(gnp_heat_prepare(&cloud, &options, &(struct gnp_heat_options){.dt = steps[s]},
			                   pool, NULL, &poisson, NULL) == GNP_OK);
			for (size_t i = 0; i < n; i++) {
				u[2 * i] = 1;
				u[2 * i + 1] = gnp_random_uniform(&random) < 0.5;
			}
			CHECK(gnp_heat_run(poisson, &(struct gnp_heat_options){.dt = steps[s], .steps = 5},
			                   &(struct gnp_heat_field){.count = 2, .u = u},
			                   pool, NULL, NULL) == GNP_OK);
			double worst = 0, least = 0, most = 1;
			for (size_t i = 0; i < n; i++) {
				worst = fmax(worst, fabs(u[2 * i] - 1));
				least = fmin(least, u[2 * i + 1]);
				most = fmax(most, u[2 * i + 1]);
			}
			CHECK_AT_MOST(worst, 1e-10);
			CHECK_AT_MOST(-least, 1e-10);
			CHECK_AT_MOST(most - 1, 1e-10);
			gnp_poisson_release(poisson);
		}
}

static struct gnp_spectrum spectrum_of(enum cloud kind, int system, size_t count)
{
	static double points[3 * 1600];
	size_t n = make_cloud(kind, points);
	struct gnp_poisson_options options = options_with(system);
	struct gnp_spectrum spectrum = {.count = 0};
	const struct gnp_cloud cloud = {n, points, NULL};
	const struct gnp_spectrum_wanted wanted = {count, 0, 1e-8};
	CHECK(gnp_spectrum_run(&cloud, &options, &wanted, pool, NULL, &spectrum, NULL) == GNP_OK);
	return spectrum;
}

static void eigenvalues_are_real_and_those_of_the_surface(void)
{
	static const double square[] = {0, 1, 1, 2, 4, 4, 5, 5}, sphere[] = {0, 2, 2, 2, 6, 6, 6, 6, 6};
	static const struct {
		enum cloud kind;
		const double *want;
		double unit, tolerance;
		size_t count;
	} rows[] = {{GRID, square, 9.8696044010893586, 0.01, 8}, {RANDOM_SPHERE, sphere, 1, 0.04, 9}};
	for (size_t r = 0; r < 2; r++)
		for (int system = GNP_SYSTEM_AUTO; system <= GNP_SYSTEM_SYMMETRIC; system++) {
			struct gnp_spectrum spectrum = spectrum_of(rows[r].kind, system, rows[r].count);
			CHECK(spectrum.system == GNP_SYSTEM_SYMMETRIC && !spectrum.why == (system == GNP_SYSTEM_SYMMETRIC));
			CHECK_NEAR(spectrum.value[0], 0, 1e-9);
			for (size_t k = 1; k < rows[r].count; k++) {
				CHECK(spectrum.imaginary[k] < 1e-6);
				CHECK_NEAR(spectrum.value[k] / (rows[r].unit * rows[r].want[k]), 1, rows[r].tolerance);
			}
			gnp_spectrum_clear(&spectrum);
		}
	struct gnp_spectrum two = spectrum_of(TWO_PIECES, GNP_SYSTEM_SYMMETRIC, 4);
	CHECK_NEAR(two.value[1], 0, 1e-9); /* once for each piece */
	CHECK(two.value[2] > 1);
	gnp_spectrum_clear(&two);
}

/* -u'' = pi^2 cos(pi x) on a square with open edges: no flux through them. */
static void open_edges_are_natural(void)
{
	static double points[3 * 1600], f[1600], u[1600];
	size_t n = make_cloud(GRID, points);
	double pi = acos(-1), square = 0, size = 0;
	struct gnp_poisson_options options = options_with(GNP_SYSTEM_AUTO);
	struct gnp_poisson *poisson = NULL;
	CHECK(gnp_poisson_prepare(&(struct gnp_cloud){n, points, NULL}, &options, pool, NULL, &poisson, NULL) == GNP_OK);
	struct gnp_poisson_info info = gnp_poisson_info(poisson);
	CHECK(info.system == GNP_SYSTEM_SYMMETRIC);
	CHECK_STRING(info.why, "stars are open, at a rim or where normals disagree");
	for (size_t i = 0; i < n; i++)
		f[i] = pi * pi * cos(pi * points[3 * i]);
	CHECK(gnp_poisson_solve(poisson, f, NULL, 1, pool, NULL, u, NULL, NULL) == GNP_OK);
	for (size_t i = 0; i < n; i++) {
		double want = cos(pi * points[3 * i]);
		square += (u[i] - want) * (u[i] - want);
		size += want * want;
	}
	CHECK_AT_MOST(sqrt(square / size), 0.01);
	gnp_poisson_release(poisson);
}

/* Nothing flows to or from a point that is far from all others: what it is given it keeps, and of its source nothing is
 * left. */
static void lone_points_keep_to_themselves(void)
{
	static double points[3 * 1601], f[1601], u[1601];
	size_t n = make_cloud(GRID, points);
	for (size_t c = 0; c < 3; c++)
		points[3 * n + c] = c == 2 ? 40 : 0.5;
	const struct gnp_cloud cloud = {n + 1, points, NULL};
	struct gnp_poisson_options options = options_with(GNP_SYSTEM_SYMMETRIC);
	struct gnp_poisson *poisson = NULL;
	for (size_t i = 0; i <= n; i++)
		f[i] = i == n ? 7 : cos(3.14159265358979 * points[3 * i]);
	CHECK(gnp_poisson_prepare(&cloud, &options, pool, NULL, &poisson, NULL) == GNP_OK);
	CHECK(gnp_poisson_solve(poisson, f, NULL, 1, pool, NULL, u, NULL, NULL) == GNP_OK);
	CHECK_NEAR(u[n], 0, 1e-12);
	CHECK_NEAR(u[0], 1 / 9.8696044010893586, 1e-3);
	gnp_poisson_release(poisson);
	CHECK(gnp_heat_prepare(&cloud, &options, &(struct gnp_heat_options){.dt = 0.1},
	                   pool, NULL, &poisson, NULL) == GNP_OK);
	CHECK(gnp_heat_run(poisson, &(struct gnp_heat_options){.dt = 0.1, .steps = 3},
	                   &(struct gnp_heat_field){.count = 1, .u = f},
	                   pool, NULL, NULL) == GNP_OK);
	CHECK_NEAR(f[n], 7, 1e-9);
	gnp_poisson_release(poisson);
}

/* A sheet of 2 x 1 folded square is that sheet: the estimator's normals, which keep to one side of the fold, would
 * part it. */
static void folds_part_nothing(void)
{
	enum { SIDE = 31, N = SIDE * (2 * SIDE - 1) };
	static double points[3 * N];
	struct gnp_models *models;
	struct gnp_spectrum spectrum;
	for (size_t i = 0; i < N; i++) {
		double along = (double)(i / SIDE) / (SIDE - 1);
		points[3 * i] = fmin(along, 1);
		points[3 * i + 1] = (double)(i % SIDE) / (SIDE - 1);
		points[3 * i + 2] = fmax(along - 1, 0);
	}
	CHECK(gnp_models_load("weights", &models, NULL) == GNP_OK); /* tests run in the repository's root */
	struct gnp_poisson_options options = options_with(GNP_SYSTEM_SYMMETRIC);
	options.laplacian.domain.estimate.estimator = GNP_ESTIMATOR_GNP;
	options.laplacian.domain.estimate.models = models;
	const struct gnp_cloud cloud = {N, points, NULL};
	CHECK(gnp_spectrum_run(&cloud, &options, &(struct gnp_spectrum_wanted){.count = 6, .tolerance = 1e-8}, pool, NULL,
	                       &spectrum, NULL) == GNP_OK);
	static const double squares[6] = {0, 1, 4, 4, 5, 8}; /* times (pi / 2)^2 */
	for (size_t k = 0; k < 6; k++)
		CHECK_NEAR(spectrum.value[k] * 4 / 9.8696044010893586, squares[k], 0.01 * squares[k] + 1e-9);
	gnp_spectrum_clear(&spectrum);
	gnp_models_release(models);
}

/* A square that is turned up by 70 degrees, with normals that only say which side is up. */
static void crude_normals_say_the_side(void)
{
	enum { SIDE = 31, N = SIDE * SIDE };
	static double points[3 * N], normals[3 * N];
	struct gnp_poisson_options options = options_with(GNP_SYSTEM_SYMMETRIC);
	struct gnp_domain domain;
	struct gnp_random random;
	double area = 0;
	gnp_random_seed(&random, 3, 0);
	for (size_t i = 0; i < N; i++) {
		double x = gnp_random_uniform(&random);
		points[3 * i] = x * cos(1.22);
		points[3 * i + 1] = gnp_random_uniform(&random);
		points[3 * i + 2] = x * sin(1.22);
		normals[3 * i + 2] = 1;
	}
	const struct gnp_cloud cloud = {N, points, normals};
	CHECK(gnp_domain_make(&cloud, &options.laplacian.domain, pool, NULL, &domain, NULL) == GNP_OK);
	for (size_t i = 0; i < N; i++) {
		const double *chosen = domain.prepared.unfitted + 3 * i;
		CHECK_NEAR(chosen[2], cos(1.22), 1e-6); /* the plane's, not what was given */
		area += domain.area[i];
	}
	CHECK_NEAR(area, 1, 0.02);
	gnp_domain_clear(&domain);
}

/* A point that looks the other way is nobody's neighbour, and still no piece of its own: it has the value of one
 * nearby. */
static void contrary_points_are_tied(void)
{
	enum { SIDE = 31, N = SIDE * SIDE, CONTRARY = SIDE * SIDE / 2 };
	static double points[3 * N], normals[3 * N], f[N], u[N];
	struct gnp_poisson_options options = options_with(GNP_SYSTEM_SYMMETRIC);
	struct gnp_poisson *poisson;
	for (size_t i = 0; i < N; i++) {
		points[3 * i] = (double)(i % SIDE) / (SIDE - 1);
		points[3 * i + 1] = (double)(i / SIDE) / (SIDE - 1);
		normals[3 * i + 2] = i == CONTRARY ? -1 : 1;
		f[i] = 9.8696044010893586 * cos(3.14159265358979323846 * points[3 * i]);
	}
	const struct gnp_cloud cloud = {N, points, normals};
	CHECK(gnp_poisson_prepare(&cloud, &options, pool, NULL, &poisson, NULL) == GNP_OK);
	CHECK(gnp_poisson_info(poisson).components == 1);
	CHECK(gnp_poisson_solve(poisson, f, NULL, 1, pool, NULL, u, NULL, NULL) == GNP_OK);
	CHECK_NEAR(u[CONTRARY], 0, 0.11); /* cos pi x in the middle; a spacing away it is 0.105 */
	CHECK_NEAR(u[0], 1, 0.02);
	gnp_poisson_release(poisson);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(it_is_symmetric_and_monotone_on_every_cloud),
		TEST(heat_stays_between_its_least_and_its_most),
		TEST(eigenvalues_are_real_and_those_of_the_surface),
		TEST(open_edges_are_natural),
		TEST(lone_points_keep_to_themselves),
		TEST(folds_part_nothing),
		TEST(crude_normals_say_the_side),
		TEST(contrary_points_are_tied),
	};
	CHECK(gnp_pool_create(2, &pool, NULL) == GNP_OK);
	int failed = RUN_TESTS(tests);
	gnp_pool_free(pool);
	return failed;
}
