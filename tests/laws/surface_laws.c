/* surface_laws: areas against those of the surfaces, the Gauss-Bonnet sum, and the points flagged as boundary, by the
 * default estimator; minutes. `make build/tests/laws/surface_laws`. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/random.h"
#include "core/cells/area.h"
#include "core/estimate/estimate.h"
#include "core/linear/blas_environment.h"
#include "core/linear/linalg.h"
#include "core/model/models.h"
#include "core/shapes/shapes.h"

static const double PI = 3.14159265358979324;

static struct gnp_pool *pool;
static struct gnp_models *models;

static void fail(const char *what, const struct gnp_error *error)
{
	fprintf(stderr, "surface_laws: %s: %s\n", what, error->text);
	exit(1);
}

/* What is measured of a cloud. */
struct measured {
	struct gnp_estimate estimate;
	double *area; /* (count) */
	double total, curvature; /* the sum of areas, and of K by them */
};

static struct measured measure(size_t count, const double *points)
{
	struct gnp_error error = {0};
	struct gnp_estimate_options options = gnp_estimate_defaults();
	struct measured m = {.area = malloc(count * sizeof *m.area)};
	struct gnp_prepared prepared;
	options.estimator = GNP_ESTIMATOR_GNP;
	options.models = models;
	options.quantities = GNP_QUANTITY_BIT(GNP_NORMALS) | GNP_QUANTITY_BIT(GNP_GAUSSIAN_CURVATURE) |
	                     GNP_QUANTITY_BIT(GNP_BOUNDARY);
	struct gnp_cloud cloud = {count, points, NULL};
	if (!m.area || gnp_estimate_run(&cloud, &options, pool, NULL, &m.estimate, &error) != GNP_OK)
		fail("estimate", &error);
	cloud.normals = m.estimate.values[GNP_NORMALS];
	if (gnp_prepare(&cloud, pool, NULL, &prepared, &error) != GNP_OK)
		fail("prepare", &error);
	double *own = malloc(count * sizeof *own);
	if (!own || gnp_area_measure(&prepared, pool, NULL, own, NULL, &error) != GNP_OK)
		fail("area", &error);
	for (size_t i = 0; i < count; i++) {
		m.area[prepared.order[i]] = own[i];
		m.total += own[i];
		m.curvature += own[i] * m.estimate.values[GNP_GAUSSIAN_CURVATURE][prepared.order[i]];
	}
	free(own);
	gnp_prepared_clear(&prepared);
	return m;
}

static void forget(struct measured *m)
{
	gnp_estimate_clear(&m->estimate);
	free(m->area);
}

static double share(const double *flag, size_t count)
{
	double sum = 0;
	for (size_t i = 0; i < count; i++)
		sum += flag[i] / (double)count;
	return sum;
}

/* ---- Closed surfaces ---- */

struct surface {
	const char *name;
	unsigned degree;
	int characteristic;
	double area; /* 0: not known in closed form */
};

static void print_closed(const struct surface *surface, size_t count)
{
	struct gnp_error error = {0};
	struct gnp_shape *shape;
	struct gnp_sample sample;
	const struct gnp_sample_options drawn = {.count = count, .seed = 1};
	if (gnp_shape_create(surface->name, 1, surface->degree, &shape, &error) != GNP_OK ||
	    gnp_sample_create(shape, &drawn, pool, NULL, &sample, &error) != GNP_OK)
		fail(surface->name, &error);
	struct measured m = measure(count, sample.points);
	double want = 2 * PI * surface->characteristic, scale = surface->characteristic ? fabs(want) : 4 * PI;
	printf("| %s", surface->name);
	if (surface->degree)
		printf(", degree %u", surface->degree);
	printf(" | %zu | ", count);
	if (surface->area > 0)
		printf("%+.3f %%", 100 * (m.total / surface->area - 1));
	printf(" | %+.2f %% | %.2f %% |\n", 100 * (m.curvature - want) / scale,
	       100 * share(m.estimate.values[GNP_BOUNDARY], count));
	fflush(stdout);
	forget(&m);
	gnp_sample_clear(&sample);
	gnp_shape_free(shape);
}

/* ---- Patches with a rim ---- */

enum patch { SQUARE, HEMISPHERE, CAP, CYLINDER, PATCHES };
static const char *const patch_names[] = {"square", "hemisphere", "cap of 45 degrees", "cylinder without lids"};

/* A point of the patch from two numbers in [0, 1); its distance from the rim. */
static double place(enum patch patch, double s, double t, double point[3])
{
	double low = patch == HEMISPHERE ? 0 : sqrt(0.5), z = patch == CYLINDER ? 2 * t : low + (1 - low) * t;
	double r = sqrt(fmax(1 - z * z, 0));
	const double square[3] = {s, t, 0}, tube[3] = {cos(2 * PI * s), sin(2 * PI * s), z};
	const double ball[3] = {r * tube[0], r * tube[1], z};
	memcpy(point, patch == SQUARE ? square : patch == CYLINDER ? tube : ball, 3 * sizeof *point);
	if (patch == SQUARE)
		return fmin(fmin(s, 1 - s), fmin(t, 1 - t));
	return patch == CYLINDER ? fmin(z, 2 - z) : acos(low) - acos(z);
}

static void print_patch(enum patch patch, size_t count)
{
	const double areas[] = {1, 2 * PI, 2 * PI * (1 - sqrt(0.5)), 4 * PI}, h = sqrt(areas[patch] / (double)count);
	double *points = malloc(3 * count * sizeof *points), *depth = malloc(count * sizeof *depth);
	double within[3] = {0}, seen[3] = {0};
	struct gnp_random random;
	if (!points || !depth)
		exit(1);
	gnp_random_seed(&random, 1, patch);
	for (size_t i = 0; i < count; i++) {
		double s = gnp_random_uniform(&random), t = gnp_random_uniform(&random);
		depth[i] = place(patch, s, t, points + 3 * i) / h;
	}
	struct measured m = measure(count, points);
	for (size_t i = 0; i < count; i++) {
		const bool is[3] = {depth[i] < 0.5, depth[i] < 1, depth[i] > 2};
		for (int k = 0; k < 3; k++) {
			within[k] += is[k];
			seen[k] += is[k] * m.estimate.values[GNP_BOUNDARY][i];
		}
	}
	printf("| %s | %zu | %+.2f %% | %.1f %% | %.1f %% | %.2f %% |\n", patch_names[patch], count,
	       100 * (m.total / areas[patch] - 1), 100 * seen[0] / within[0], 100 * seen[1] / within[1],
	       100 * seen[2] / within[2]);
	fflush(stdout);
	forget(&m);
	free(points);
	free(depth);
}

int main(int argc, char **argv)
{
	static const struct surface surfaces[] = {
		{"sphere", 0, 2, 4 * 3.14159265358979324}, {"ellipsoid", 0, 2, 0}, {"torus", 0, 0, 8.77298168925},
		{"bumpy_torus", 0, 0, 0}, {"genus2", 0, -2, 0}, {"genus3", 0, -4, 0},
		{"radial", 3, 2, 0}, {"radial", 8, 2, 0}, {"radial", 15, 2, 0}};
	struct gnp_error error = {0};
	(void)argc;
	gnp_blas_environment_restart(argv);
	gnp_linalg_init();
	if (gnp_pool_create(0, &pool, &error) != GNP_OK || gnp_models_load("weights", &models, &error) != GNP_OK)
		fail("start", &error);
	printf("| surface | points | area | Gauss-Bonnet | flagged |\n| --- | ---: | ---: | ---: | ---: |\n");
	for (size_t s = 0; s < sizeof surfaces / sizeof *surfaces; s++)
		for (size_t count = 10000; count <= 100000; count *= 10)
			print_closed(&surfaces[s], count);
	printf("\n| patch, points at random | points | area | flagged within half a spacing | within one | beyond two |\n"
	       "| --- | ---: | ---: | ---: | ---: | ---: |\n");
	for (int p = 0; p < PATCHES; p++)
		for (size_t count = 2000; count <= 20000; count *= 10)
			print_patch((enum patch)p, count);
	gnp_models_release(models);
	gnp_pool_free(pool);
	return 0;
}
