/* Flux through open edges and sources at points are what drives the solutions that have them. */
#include "core/equations/load.h"

#include "core/base/random.h"
#include "core/linear/linalg.h"
#include "core/operators/rim.h"
#include "tests/unit/test.h"

enum { SIDE = 41, N = SIDE * SIDE };
static struct gnp_pool *pool;

/* The unit square, on a lattice or at random. */
static void make_square(bool lattice, double *points)
{
	struct gnp_random random;
	gnp_random_seed(&random, 5, 5);
	for (size_t i = 0; i < N; i++) {
		points[3 * i] = lattice ? (double)(i % SIDE) / (SIDE - 1) : gnp_random_uniform(&random);
		points[3 * i + 1] = lattice ? (double)(i / SIDE) / (SIDE - 1) : gnp_random_uniform(&random);
		points[3 * i + 2] = 0;
	}
}

static struct gnp_poisson *prepare(const double *points, size_t count, int system, double screening)
{
	const struct gnp_cloud cloud = {count, points, NULL};
	struct gnp_poisson_options options = gnp_poisson_defaults();
	struct gnp_poisson *poisson = NULL;
	options.laplacian.system = system;
	options.screening = screening;
	CHECK(gnp_poisson_prepare(&cloud, &options, pool, NULL, &poisson, NULL) == GNP_OK);
	return poisson;
}

static void rims_have_their_length(void)
{
	static double points[3 * N], length[N];
	for (int lattice = 0; lattice < 2; lattice++) {
		make_square(lattice, points);
		struct gnp_poisson *poisson = prepare(points, N, GNP_SYSTEM_SYMMETRIC, 1);
		double sum = 0;
		CHECK(gnp_rim_measure(&gnp_poisson_domain(poisson)->prepared, pool, NULL, length, NULL) == GNP_OK);
		for (size_t i = 0; i < N; i++)
			sum += length[i];
		CHECK_NEAR(sum, 4, lattice ? 1e-9 : 0.4);
		gnp_poisson_release(poisson);
	}
}

/* u = x has no Laplacian, and the flux of 1 out at x = 1, of -1 at x = 0; half of it at corners, which are of two
 * edges. */
static void flux_drives_what_has_it(void)
{
	static double points[3 * N], flux[N], f[N], u[N], rim;
	make_square(true, points);
	for (size_t i = 0; i < N; i++) {
		double x = points[3 * i], y = points[3 * i + 1];
		flux[i] = (x == 1) - (x == 0);
		flux[i] *= (x == 0 || x == 1) && (y == 0 || y == 1) ? 0.5 : 1;
		flux[i] = x == 0 || x == 1 || y == 0 || y == 1 ? flux[i] : NAN;
	}
	struct gnp_poisson *poisson = prepare(points, N, GNP_SYSTEM_SYMMETRIC, 0);
	CHECK(gnp_load_flux(poisson, flux, 1, pool, NULL, f, &rim, NULL) == GNP_OK);
	CHECK_NEAR(rim, 4, 1e-9);
	CHECK(gnp_poisson_solve(poisson, f, NULL, 1, pool, NULL, u, NULL, NULL) == GNP_OK);
	for (size_t i = 0; i < N; i++)
		CHECK_NEAR(u[i], points[3 * i] - 0.5, 1e-9);
	gnp_poisson_release(poisson);
}

/* On a sphere, of a strength of 1 at the pole, less the mean: u = -ln(1 - cos theta) / (4 pi) + a constant. Each point
 * twice: places have one unknown. */
static void points_drive_what_has_a_source_there(void)
{
	enum { PLACES = 4000, POINTS = 2 * PLACES };
	static double points[3 * POINTS], f[POINTS], u[POINTS];
	for (size_t i = 0; i < POINTS; i++) {
		double k = (double)(i % PLACES), z = 1 - 2 * k / (PLACES - 1);
		double turn = k * M_PI * (3 - sqrt(5)), r = sqrt(fmax(0, 1 - z * z));
		points[3 * i] = r * cos(turn);
		points[3 * i + 1] = r * sin(turn);
		points[3 * i + 2] = z;
	}
	struct gnp_poisson *poisson = prepare(points, POINTS, GNP_SYSTEM_SYMMETRIC, 0);
	static const uint32_t pole = PLACES;
	CHECK(gnp_load_points(poisson, &pole, &(double){1}, 1, 1, f, NULL) == GNP_OK);
	CHECK(gnp_poisson_solve(poisson, f, NULL, 1, pool, NULL, u, NULL, NULL) == GNP_OK);
	for (size_t i = 0; i < POINTS; i++) {
		double z = points[3 * i + 2], constant = (log(2) - 1) / (4 * M_PI);
		if (z < 0.9)
			CHECK_NEAR(u[i], -log(1 - z) / (4 * M_PI) + constant, 1e-3);
		CHECK(u[i] == u[(i + PLACES) % POINTS]);
	}
	gnp_poisson_release(poisson);
}

static void what_cannot_be_loaded_is_named(void)
{
	static double points[3 * N], flux[N], f[N];
	struct gnp_error error = {0};
	for (size_t i = 0; i < N; i++) {
		double k = (double)i, z = 1 - (2 * k + 1) / N, turn = k * M_PI * (3 - sqrt(5)), r = sqrt(1 - z * z);
		points[3 * i] = r * cos(turn);
		points[3 * i + 1] = r * sin(turn);
		points[3 * i + 2] = z;
	}
	struct gnp_poisson *square = prepare(points, N, GNP_SYSTEM_SQUARE, 1);
	struct gnp_poisson *closed = prepare(points, N, GNP_SYSTEM_SYMMETRIC, 1);
	CHECK(gnp_load_flux(square, flux, 1, pool, NULL, f, NULL, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "flux: the operator is collocation, which has no open edges: need system=symmetric");
	error = (struct gnp_error){0};
	CHECK(gnp_load_flux(closed, flux, 1, pool, NULL, f, NULL, &error) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "flux: the surface has no open edge");
	error = (struct gnp_error){0};
	CHECK(gnp_load_points(closed, &(uint32_t){N}, &(double){1}, 1, 1, f, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "source_points[0]: got point 1681, the cloud has 1681");
	gnp_poisson_release(square);
	gnp_poisson_release(closed);
	make_square(true, points);
	struct gnp_poisson *open = prepare(points, N, GNP_SYSTEM_SYMMETRIC, 1);
	flux[0] = INFINITY;
	error = (struct gnp_error){0};
	CHECK(gnp_load_flux(open, flux, 1, pool, NULL, f, NULL, &error) == GNP_INVALID_ARGUMENT);
	CHECK_CONTAINS(error.text, "flux: value 0 of point 0 is inf");
	gnp_poisson_release(open);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(rims_have_their_length), TEST(flux_drives_what_has_it),
	                                    TEST(points_drive_what_has_a_source_there), TEST(what_cannot_be_loaded_is_named)};
	gnp_linalg_init();
	if (gnp_pool_create(0, &pool, NULL) != GNP_OK)
		return 1;
	int status = RUN_TESTS(tests);
	gnp_pool_free(pool);
	return status;
}
