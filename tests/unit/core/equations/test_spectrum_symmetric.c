/* Eigenpairs of the symmetric operator: real, never below zero, as often as the surface has them, with orthonormal
 * vectors, on any cloud; about a value; with fixed points; and the same that ARPACK finds of the same matrices. */
#include "core/equations/spectrum.h"

#include <dlfcn.h>

#include "core/base/random.h"
#include "core/cells/volume.h"
#include "core/linear/factor_solve.h"
#include "core/linear/lanczos.h"
#include "core/linear/linalg.h"
#include "tests/unit/test.h"

static struct gnp_pool *pool, *alone;
static const double pi = 3.14159265358979323846;

enum { SIDE = 45, MOST = 6000 };
struct made {
	size_t count;
	double points[3 * MOST];
	unsigned char fixed[MOST];
};

static void add(struct made *cloud, double x, double y, double z, bool fixed)
{
	const double p[] = {x, y, z};
	memcpy(cloud->points + 3 * cloud->count, p, sizeof p);
	cloud->fixed[cloud->count++] = fixed;
}

/* A unit square at x, its rim fixed; inner points moved by up to `jitter` spacings. */
static void add_square(struct made *cloud, size_t side, double x, double jitter)
{
	struct gnp_random random;
	gnp_random_seed(&random, 5, 1);
	double h = 1 / (double)(side - 1);
	for (size_t i = 0; i < side * side; i++) {
		size_t a = i % side, b = i / side;
		bool rim = a == 0 || b == 0 || a == side - 1 || b == side - 1;
		double move = rim ? 0 : jitter * h;
		add(cloud, x + (double)a * h + move * (2 * gnp_random_uniform(&random) - 1),
		    (double)b * h + move * (2 * gnp_random_uniform(&random) - 1), 0, rim);
	}
}

/* Grids on the faces of a cube, seen from its middle: a sphere with the cube's symmetry. */
static void add_sphere(struct made *cloud, int side, double x)
{
	for (int a = -side; a <= side; a++)
		for (int b = -side; b <= side; b++)
			for (int c = -side; c <= side; c++) {
				if (abs(a) != side && abs(b) != side && abs(c) != side)
					continue;
				double u = tan(a * pi / 4 / side), v = tan(b * pi / 4 / side), w = tan(c * pi / 4 / side);
				double length = sqrt(u * u + v * v + w * w);
				add(cloud, x + u / length, v / length, w / length, false);
			}
}

static struct gnp_spectrum spectrum_with(const struct made *cloud, int system, const unsigned char *fixed, size_t count,
                                         double shift, struct gnp_pool *workers)
{
	struct gnp_poisson_options options = gnp_poisson_defaults();
	struct gnp_spectrum spectrum = {.count = 0};
	struct gnp_error error = {0};
	options.laplacian.system = system;
	options.laplacian.domain.estimate.cover = GNP_COVER_ALL;
	options.fixed = fixed;
	const struct gnp_cloud given = {cloud->count, cloud->points, NULL};
	const struct gnp_spectrum_wanted wanted = {count, shift, 1e-9};
	CHECK(gnp_spectrum_run(&given, &options, &wanted, workers, NULL, &spectrum, &error) == GNP_OK);
	CHECK_STRING(error.text, "");
	return spectrum;
}

static struct gnp_spectrum spectrum_of(const struct made *cloud, size_t count)
{
	return spectrum_with(cloud, GNP_SYSTEM_SYMMETRIC, NULL, count, 0, pool);
}

/* The matrices themselves. */
static void make_matrices(const struct made *cloud, struct gnp_domain *domain, struct gnp_stiffness *volumes)
{
	struct gnp_laplacian_options options = gnp_laplacian_defaults();
	const struct gnp_cloud given = {cloud->count, cloud->points, NULL};
	options.domain.estimate.cover = GNP_COVER_ALL;
	CHECK(gnp_domain_make(&given, &options.domain, pool, NULL, domain, NULL) == GNP_OK);
	CHECK(gnp_volume_stiffness(&domain->prepared, pool, NULL, volumes, NULL) == GNP_OK);
}

/* Values are real, ascending and not negative, vectors orthonormal by the masses, and S v = lambda M v. */
static void check_pairs(const struct made *cloud, const struct gnp_spectrum *spectrum)
{
	struct gnp_domain domain;
	struct gnp_stiffness s;
	make_matrices(cloud, &domain, &s);
	size_t n = domain.prepared.count;
	double *v = calloc(spectrum->count * n, sizeof *v), off = 0, left = 0;
	for (size_t k = 0; k < spectrum->count; k++) {
		CHECK(spectrum->imaginary[k] == 0 && spectrum->value[k] >= 0);
		CHECK(k == 0 || spectrum->value[k] >= spectrum->value[k - 1]);
		for (size_t i = 0; i < n; i++)
			v[k * n + i] = spectrum->vector[k * spectrum->points + domain.prepared.order[i]];
		for (size_t j = 0; j <= k; j++) {
			double product = 0;
			for (size_t i = 0; i < n; i++)
				product += domain.area[i] * v[k * n + i] * v[j * n + i];
			off = fmax(off, fabs(product - (j == k)));
		}
		for (size_t i = 0; i < n; i++) {
			double sum = -spectrum->value[k] * domain.area[i] * v[k * n + i];
			for (size_t e = s.start[i]; e < s.start[i + 1]; e++)
				sum += s.value[e] * (v[k * n + i] - v[k * n + s.column[e]]);
			left = fmax(left, fabs(sum) / (s.diagonal[i] + 1e-300));
		}
	}
	CHECK_AT_MOST(off, 1e-8);
	CHECK_AT_MOST(left, 1e-6);
	free(v);
	gnp_domain_clear(&domain);
	gnp_stiffness_clear(&s);
}

/* By symmetry alone: irreducible representations of the cube's group of 1, 2 and 3 dimensions. */
static void multiplicities_are_those_of_symmetry(void)
{
	static struct made one, two;
	add_sphere(&one, 9, 0);
	add_sphere(&two, 9, 0);
	add_sphere(&two, 9, 8);
	struct gnp_spectrum single = spectrum_of(&one, 30), twice = spectrum_of(&two, 60);
	check_pairs(&one, &single);
	check_pairs(&two, &twice);
	CHECK(single.value[0] == 0);
	CHECK_NEAR(single.value[3], single.value[1], 1e-9 * single.value[1]);
	CHECK_NEAR(single.value[1], 2, 0.02);
	CHECK_NEAR(single.value[8], 6, 0.1);
	CHECK(single.value[8] - single.value[4] > 1e-6 && single.value[4] > 5);
	for (size_t k = 0; k < 30; k++) {
		CHECK_NEAR(twice.value[2 * k], single.value[k], 1e-8 * single.value[29]);
		CHECK_NEAR(twice.value[2 * k + 1], single.value[k], 1e-8 * single.value[29]);
	}
	gnp_spectrum_clear(&single);
	gnp_spectrum_clear(&twice);
}

static void every_piece_has_its_zero(void)
{
	static struct made five, tiny;
	struct gnp_random random;
	gnp_random_seed(&random, 3, 3);
	for (int p = 0; p < 5; p++)
		add_square(&five, 20, 3 * p, 0);
	struct gnp_spectrum spectrum = spectrum_of(&five, 12);
	check_pairs(&five, &spectrum);
	for (size_t k = 0; k < 5; k++)
		CHECK(spectrum.value[k] == 0);
	for (size_t k = 5; k < 12; k++) /* pi^2, ten times */
		CHECK_NEAR(spectrum.value[k], pi * pi, 0.01 * pi * pi);
	gnp_spectrum_clear(&spectrum);
	for (int p = 0; p < 60; p++)
		for (int k = 0; k <= p % 2; k++)
			add(&tiny, 1000 * gnp_random_uniform(&random), 1000 * gnp_random_uniform(&random) + k, 0, false);
	spectrum = spectrum_of(&tiny, tiny.count);
	check_pairs(&tiny, &spectrum);
	CHECK(spectrum.value[0] == 0 && spectrum.value[tiny.count - 1] < 1e6);
	gnp_spectrum_clear(&spectrum);
}

/* Small clouds are dense matrices, where many pairs are asked for; the same ones are found by iteration. */
static void iteration_and_dense_matrices_agree(void)
{
	enum { FEW = 10, MANY = 390 };
	static struct made cloud;
	add_square(&cloud, 20, 0, 0.3);
	struct gnp_spectrum few = spectrum_of(&cloud, FEW), many = spectrum_of(&cloud, MANY);
	CHECK(few.solves > 0 && many.solves == 0);
	check_pairs(&cloud, &many);
	for (size_t k = 0; k < FEW; k++)
		CHECK_NEAR(few.value[k], many.value[k], 1e-9 * many.value[FEW]);
	gnp_spectrum_clear(&few);
	gnp_spectrum_clear(&many);
}

/* Points of a square whose rim is held at 0: pi^2 (i^2 + j^2), i, j >= 1. */
static void fixed_rims_have_dirichlets_eigenvalues(void)
{
	static const double want[] = {2, 5, 5, 8, 10, 10, 13, 13};
	for (int system = GNP_SYSTEM_AUTO; system <= GNP_SYSTEM_SQUARE; system++)
		for (int jittered = 0; jittered <= (system != GNP_SYSTEM_SQUARE); jittered++) {
			static struct made cloud;
			cloud.count = 0;
			add_square(&cloud, SIDE, 0, jittered ? 0.25 : 0);
			struct gnp_spectrum spectrum = spectrum_with(&cloud, system, cloud.fixed, 8, 0, pool);
			CHECK(spectrum.system == (system == GNP_SYSTEM_AUTO ? GNP_SYSTEM_SYMMETRIC : system));
			for (size_t k = 0; k < 8; k++) {
				CHECK_NEAR(spectrum.value[k] / (pi * pi * want[k]), 1, system == GNP_SYSTEM_SQUARE ? 1e-3 : 0.01);
				for (size_t i = 0; i < cloud.count; i++)
					CHECK(!cloud.fixed[i] || spectrum.vector[k * cloud.count + i] == 0);
			}
			gnp_spectrum_clear(&spectrum);
		}
}

/* Those nearest to a value are the same as among the lowest, also where it is an eigenvalue itself. */
static void a_shift_finds_those_about_it(void)
{
	enum { MANY = 60, FEW = 7 };
	static struct made cloud;
	add_sphere(&cloud, 9, 0);
	for (int system = GNP_SYSTEM_SYMMETRIC; system <= GNP_SYSTEM_SQUARE; system++) {
		struct gnp_spectrum lowest = spectrum_with(&cloud, system, NULL, MANY, 0, pool);
		const double shifts[] = {0.9, 6.6, 12.5, lowest.value[20]};
		for (size_t s = 0; s < 4; s++) {
			struct gnp_spectrum about = spectrum_with(&cloud, system, NULL, FEW, shifts[s], pool);
			size_t first = 0;
			while (first + FEW < MANY && lowest.value[first + FEW] - shifts[s] < shifts[s] - lowest.value[first])
				first++;
			for (size_t k = 0; k < FEW; k++)
				CHECK_NEAR(about.value[k], lowest.value[first + k], 1e-3 * shifts[s]);
			CHECK_NEAR(about.value[FEW / 2], lowest.value[first + FEW / 2], 1e-7 * shifts[s]);
			gnp_spectrum_clear(&about);
		}
		gnp_spectrum_clear(&lowest);
	}
}

/* Where the shift is far from 0, many of those about it are nearly one: each comes once, as among the lowest. */
static void clusters_about_a_shift_are_complete(void)
{
	enum { LOWEST = 121, FEW = 20, CLUSTER = 21 };
	static struct made cloud;
	add_sphere(&cloud, 14, 0);
	struct gnp_spectrum lowest = spectrum_of(&cloud, LOWEST);
	struct gnp_spectrum about = spectrum_with(&cloud, GNP_SYSTEM_SYMMETRIC, NULL, FEW, 99, pool);
	size_t first = LOWEST - CLUSTER;
	CHECK(lowest.value[first] > 105 && lowest.value[first - 1] < 92);
	for (size_t k = 0; k < FEW; k++) {
		double off = INFINITY;
		for (size_t j = 0; j < LOWEST; j++)
			off = fmin(off, fabs(about.value[k] - lowest.value[j]));
		CHECK_AT_MOST(off, 1e-7 * about.value[k]);
	}
	check_pairs(&cloud, &about);
	gnp_spectrum_clear(&lowest);
	gnp_spectrum_clear(&about);
}

static void one_worker_and_several_give_the_same_bytes(void)
{
	static struct made cloud;
	add_square(&cloud, SIDE, 0, 0.3);
	struct gnp_spectrum one = spectrum_with(&cloud, GNP_SYSTEM_SYMMETRIC, cloud.fixed, 20, 50, alone);
	struct gnp_spectrum many = spectrum_with(&cloud, GNP_SYSTEM_SYMMETRIC, cloud.fixed, 20, 50, pool);
	CHECK(memcmp(one.value, many.value, 20 * sizeof(double)) == 0);
	CHECK(memcmp(one.vector, many.vector, 20 * cloud.count * sizeof(double)) == 0);
	gnp_spectrum_clear(&one);
	gnp_spectrum_clear(&many);
}

static void what_is_not_there_is_refused(void)
{
	static struct made cloud;
	add_square(&cloud, 12, 0, 0);
	struct gnp_poisson_options options = gnp_poisson_defaults();
	struct gnp_spectrum spectrum;
	struct gnp_error error = {0}, other = {0}, more = {0};
	const struct gnp_cloud given = {cloud.count, cloud.points, NULL};
	options.laplacian.system = GNP_SYSTEM_SYMMETRIC;
	options.fixed = cloud.fixed;
	const struct gnp_spectrum_wanted many = {101, 0, 1e-8}, below = {10, -1, 1e-8}, few = {5, 0, 1e-8};
	CHECK(gnp_spectrum_run(&given, &options, &many, pool, NULL, &spectrum, &error) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(error.text, "points: got 100, need at least 101, as many as count");
	CHECK(gnp_spectrum_run(&given, &options, &below, pool, NULL, &spectrum, &other) == GNP_INVALID_ARGUMENT);
	CHECK_STRING(other.text, "shift: got -1, need a finite number >= 0");
	static struct made large;
	add_square(&large, SIDE, 0, 0);
	options.memory_limit = 1000;
	options.fixed = NULL;
	const struct gnp_cloud all = {large.count, large.points, NULL};
	CHECK(gnp_spectrum_run(&all, &options, &few, pool, NULL, &spectrum, &more) == GNP_TOO_LARGE);
	CHECK_CONTAINS(more.text, "memory: the factor of 2025 unknowns needs ");
}

/* ---- ARPACK ---- */

/* Its dsaupd and dseupd. */
typedef void saupd(int *ido, const char *bmat, const int *n, const char *which, const int *nev, const double *tol,
                   double *resid, const int *ncv, double *v, const int *ldv, int *iparam, int *ipntr, double *workd,
                   double *workl, const int *lworkl, int *info, size_t, size_t);
typedef void seupd(const int *rvec, const char *howmny, int *select, double *d, double *z, const int *ldz,
                   const double *sigma, const char *bmat, const int *n, const char *which, const int *nev,
                   const double *tol, double *resid, const int *ncv, double *v, const int *ldv, int *iparam,
                   int *ipntr, double *workd, double *workl, const int *lworkl, int *info, size_t, size_t, size_t);

/* (S + M)^-1, with which they are asked to go on. */
static struct gnp_factor *factor_of(const struct gnp_domain *domain, const struct gnp_stiffness *s)
{
	struct gnp_csr matrix;
	struct gnp_factor_plan plan;
	struct gnp_factor *factor = NULL;
	CHECK(gnp_volume_matrix(s, domain->area, NULL, &matrix, NULL) == GNP_OK);
	CHECK(gnp_factor_plan_make(&matrix, true, domain->prepared.points, pool, NULL, &plan, NULL) == GNP_OK);
	CHECK(gnp_factor_make_take(&matrix, &plan, pool, NULL, &factor, NULL) == GNP_OK);
	gnp_csr_clear(&matrix);
	return factor;
}

/* Eigenvalues of S v = lambda M v by shift and invert (mode 3) into value (nev). */
static void ask_arpack(saupd *update, seupd *extract, const struct gnp_domain *domain, const struct gnp_stiffness *s,
                       int nev, double *value)
{
	enum { BASIS = 128 };
	static double v[BASIS * MOST], work[3 * MOST], small[BASIS * (BASIS + 8)], left[MOST];
	static int select[BASIS];
	int n = (int)s->count, ncv = 2 * nev + 20, ido = 0, info = 0, length = ncv * (ncv + 8), yes = 0;
	int iparam[11] = {1, 0, 1000, 1, 0, 0, 3}, ipntr[11];
	double tolerance = 1e-13, sigma = -1;
	struct gnp_factor *factor = factor_of(domain, s);
	while (ido != 99) {
		update(&ido, "G", &n, "LM", &nev, &tolerance, left, &ncv, v, &n, iparam, ipntr, work, small, &length, &info,
		       1, 2);
		double *from = work + ipntr[0] - 1, *to = work + ipntr[1] - 1, *weighed = work + ipntr[2] - 1;
		for (int i = 0; i < n && (ido == -1 || ido == 1 || ido == 2); i++)
			to[i] = ido == 1 ? weighed[i] : domain->area[i] * from[i];
		if (ido == -1 || ido == 1)
			CHECK(gnp_factor_solve(factor, to, 1, pool, NULL, NULL) == GNP_OK);
	}
	CHECK(info == 0);
	extract(&yes, "A", select, value, v, &n, &sigma, "G", &n, "LM", &nev, &tolerance, left, &ncv, v, &n, iparam, ipntr,
	        work, small, &length, &info, 1, 1, 2);
	CHECK(info == 0 && iparam[4] >= nev);
	gnp_factor_free(factor);
}

static int by_size(const void *a, const void *b)
{
	double x = *(const double *)a, y = *(const double *)b;
	return (x > y) - (x < y);
}

static void arpack_finds_the_same(void)
{
	enum { NEV = 50 };
	void *library = dlopen("libarpack.so.2", RTLD_NOW | RTLD_LOCAL);
	saupd *update = NULL;
	seupd *extract = NULL;
	if (library) {
		*(void **)&update = dlsym(library, "dsaupd_");
		*(void **)&extract = dlsym(library, "dseupd_");
	}
	if (!update || !extract) {
		printf("test_spectrum_symmetric: skipped: arpack\n");
		return;
	}
	for (int kind = 0; kind < 3; kind++) {
		static struct made cloud;
		struct gnp_domain domain;
		struct gnp_stiffness s;
		double value[NEV];
		cloud.count = 0;
		if (kind == 0)
			add_sphere(&cloud, 12, 0);
		else
			add_square(&cloud, SIDE, 0, kind == 1 ? 0 : 0.4);
		make_matrices(&cloud, &domain, &s);
		ask_arpack(update, extract, &domain, &s, NEV, value);
		qsort(value, NEV, sizeof *value, by_size);
		struct gnp_spectrum spectrum = spectrum_of(&cloud, NEV);
		CHECK_AT_MOST(fabs(value[0]), 1e-8);
		for (size_t k = 1; k < NEV; k++)
			CHECK_NEAR(spectrum.value[k] / value[k], 1, 1e-8);
		gnp_spectrum_clear(&spectrum);
		gnp_domain_clear(&domain);
		gnp_stiffness_clear(&s);
	}
	dlclose(library);
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {
		TEST(multiplicities_are_those_of_symmetry),
		TEST(every_piece_has_its_zero),
		TEST(iteration_and_dense_matrices_agree),
		TEST(fixed_rims_have_dirichlets_eigenvalues),
		TEST(a_shift_finds_those_about_it),
		TEST(clusters_about_a_shift_are_complete),
		TEST(one_worker_and_several_give_the_same_bytes),
		TEST(what_is_not_there_is_refused),
		TEST(arpack_finds_the_same),
	};
	gnp_linalg_init();
	if (gnp_pool_create(3, &pool, NULL) != GNP_OK || gnp_pool_create(1, &alone, NULL) != GNP_OK)
		return 1;
	int status = RUN_TESTS(tests);
	gnp_pool_free(pool);
	gnp_pool_free(alone);
	return status;
}
