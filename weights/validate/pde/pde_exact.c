#include "weights/validate/pde/pde_exact.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/random.h"
#include "core/base/vector.h"
#include "core/shapes/shapes.h"
#include "weights/protocol/protocol.h"
#include "weights/validate/pde/pde_torus.h"

enum surface { SPHERE, TORUS, SQUARE, HALF };
enum sampling { EVEN, RANDOM, GRID, JITTERED, RANDOM_WITHIN, ROWS };

static const struct exact {
	enum surface surface;
	enum sampling sampling;
	size_t points;
	double ratio; /* of rows: how much farther apart they are than points in them */
	const char *name;
} exacts[] = {
	{SPHERE, EVEN, 2000, 0, "even"},
	{SPHERE, EVEN, 10000, 0, "even"},
	{SPHERE, RANDOM, 2000, 0, "random"},
	{SPHERE, RANDOM, 10000, 0, "random"},
	{TORUS, EVEN, 10000, 0, "even"},
	{TORUS, RANDOM, 10000, 0, "random"},
	{HALF, EVEN, 5000, 0, "even"},
	{HALF, RANDOM, 5000, 0, "random"},
	{SQUARE, GRID, 2601, 0, "grid"},
	{SQUARE, JITTERED, 2601, 0, "jittered"},
	{SQUARE, RANDOM, 2601, 0, "random"},
	{SQUARE, RANDOM_WITHIN, 2601, 0, "random, none on the rim"},
	{SQUARE, JITTERED, 10201, 0, "jittered"},
	{SQUARE, RANDOM, 10201, 0, "random"},
	{SQUARE, ROWS, 10201, 4, "rows of ratio 4"},
	{SQUARE, ROWS, 10201, 8, "rows of ratio 8"},
	{SQUARE, ROWS, 10201, 16, "rows of ratio 16"},
};

static const struct {
	const char *name;
	double area;
} surfaces[] = {{"sphere", 4 * M_PI},
                {"torus", 4 * M_PI * M_PI * GNP_PDE_TORUS_TURN * GNP_PDE_TORUS_TUBE},
                {"square", 1},
                {"half-sphere", 2 * M_PI}};

bool gnp_pde_exact_name(size_t i, struct gnp_pde_exact_name *out)
{
	if (i >= sizeof exacts / sizeof *exacts)
		return false;
	*out = (struct gnp_pde_exact_name){surfaces[exacts[i].surface].name, exacts[i].name, exacts[i].points};
	return true;
}

/* ---- Points: room for all of them is there ---- */

/* One more; rim: it is on it. */
static void put(struct gnp_pde_case *known, double x, double y, double z, bool rim)
{
	double *p = known->points + 3 * known->count;
	p[0] = x, p[1] = y, p[2] = z;
	if (known->fixed)
		known->fixed[known->count] = rim;
	known->count++;
}

/* The square's rim in equal steps, or at random but for its corners. */
static void put_rim(struct gnp_pde_case *known, size_t side, double shake, struct gnp_random *random)
{
	static const double corner[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
	for (size_t s = 0; s < 4; s++)
		for (size_t k = 0; k < side; k++) {
			double at = k == 0 ? 0 : (k + shake * (gnp_random_uniform(random) - 0.5)) / (double)side;
			const double *from = corner[s], *to = corner[(s + 1) % 4];
			put(known, from[0] + at * (to[0] - from[0]), from[1] + at * (to[1] - from[1]), 0, true);
		}
}

static void put_square(struct gnp_pde_case *known, const struct exact *exact, struct gnp_random *random)
{
	size_t side = (size_t)lround(sqrt((double)exact->points)) - 1;
	double shake = exact->sampling == JITTERED ? 0.8 : 0;
	if (exact->sampling == RANDOM_WITHIN || exact->sampling == RANDOM) {
		if (exact->sampling == RANDOM)
			put_rim(known, side, 0.8, random);
		while (known->count < exact->points)
			put(known, gnp_random_uniform(random), gnp_random_uniform(random), 0, false);
		return;
	}
	put_rim(known, side, shake, random);
	for (size_t i = 1; i < side; i++)
		for (size_t j = 1; j < side; j++) {
			double x = (i + shake * (gnp_random_uniform(random) - 0.5)) / (double)side;
			double y = (j + shake * (gnp_random_uniform(random) - 0.5)) / (double)side;
			put(known, x, y, 0, false);
		}
}

/* Rows along x from rim to rim, each shifted by a share of a step of its own. */
static void put_rows(struct gnp_pde_case *known, const struct exact *exact, struct gnp_random *random)
{
	size_t rows = (size_t)lround(sqrt((double)exact->points / exact->ratio)), steps = exact->points / (rows + 1) - 1;
	for (size_t r = 0; r <= rows; r++) {
		double shift = gnp_random_uniform(random), y = (double)r / (double)rows;
		put(known, 0, y, 0, true);
		for (size_t k = 0; k + 1 < steps; k++)
			put(known, (k + 0.5 + shift) / (double)steps, y, 0, r == 0 || r == rows);
		put(known, 1, y, 0, true);
	}
}

static void put_on_sphere(struct gnp_pde_case *known, size_t points, bool half, struct gnp_random *random)
{
	while (known->count < points) {
		double z = half ? gnp_random_uniform(random) : 2 * gnp_random_uniform(random) - 1;
		double turn = 2 * M_PI * gnp_random_uniform(random), r = sqrt(1 - z * z);
		put(known, r * cos(turn), r * sin(turn), z, false);
	}
}

static void put_on_torus(struct gnp_pde_case *known, size_t points, struct gnp_random *random)
{
	while (known->count < points) {
		double tube = 2 * M_PI * gnp_random_uniform(random), turn = 2 * M_PI * gnp_random_uniform(random);
		double w = GNP_PDE_TORUS_TURN + GNP_PDE_TORUS_TUBE * cos(tube);
		if (gnp_random_uniform(random) * (GNP_PDE_TORUS_TURN + GNP_PDE_TORUS_TUBE) < w)
			put(known, w * cos(turn), w * sin(turn), GNP_PDE_TORUS_TUBE * sin(tube), false);
	}
}

/* The equator in steps of the spacing. */
static void put_equator(struct gnp_pde_case *known)
{
	size_t steps = (size_t)lround(2 * M_PI / known->spacing);
	for (size_t k = 0; k < steps; k++)
		put(known, cos(2 * M_PI * (double)k / (double)steps), sin(2 * M_PI * (double)k / (double)steps), 0, true);
}

/* Blue noise of the whole shape; of a half-sphere what is half a spacing above its rim. */
static gnp_status put_even(struct gnp_pde_case *known, const struct exact *exact, struct gnp_pool *pool,
                           struct gnp_task *task, struct gnp_error *error)
{
	bool half = exact->surface == HALF;
	const struct gnp_sample_options options = {.count = half ? 2 * exact->points : exact->points,
	                                           .seed = GNP_SEED_VALIDATION};
	struct gnp_shape *shape = NULL;
	struct gnp_sample sample;
	gnp_status status = gnp_shape_create(exact->surface == TORUS ? "torus" : "sphere", 0, 0, &shape, error);
	if (status == GNP_OK)
		status = gnp_sample_create(shape, &options, pool, task, &sample, error);
	gnp_shape_free(shape);
	if (status != GNP_OK)
		return status;
	for (size_t i = 0; i < sample.count; i++)
		if (!half || sample.points[3 * i + 2] > known->spacing / 2)
			put(known, sample.points[3 * i], sample.points[3 * i + 1], sample.points[3 * i + 2], false);
	gnp_sample_clear(&sample);
	return GNP_OK;
}

static gnp_status put_points(struct gnp_pde_case *known, const struct exact *exact, struct gnp_pool *pool,
                             struct gnp_task *task, struct gnp_error *error)
{
	struct gnp_random random;
	gnp_random_seed(&random, GNP_SEED_VALIDATION, exact->points);
	if (exact->surface == HALF)
		put_equator(known);
	if (exact->sampling == EVEN)
		return put_even(known, exact, pool, task, error);
	if (exact->sampling == ROWS)
		put_rows(known, exact, &random);
	else if (exact->surface == SQUARE)
		put_square(known, exact, &random);
	else if (exact->surface == TORUS)
		put_on_torus(known, exact->points, &random);
	else
		put_on_sphere(known, exact->points, exact->surface == HALF, &random);
	return GNP_OK;
}

/* ---- What is known ---- */

/* Of spheres l (l + 1): 2 l + 1 times; of half of one as many as are even about its rim, l + 1, and of functions
 * that are zero there the others, l. */
static void set_spherical(struct gnp_pde_case *known, bool half)
{
	size_t all = known->pieces + known->eigenvalues, k = 0, d = 0;
	for (size_t l = 0; k < all || (known->dirichlet_value && d < known->eigenvalues); l++) {
		for (size_t m = 0; m < (half ? l + 1 : 2 * l + 1) && k < all; m++)
			known->eigenvalue[k++] = (double)(l * (l + 1));
		for (size_t m = 0; m < l && known->dirichlet_value && d < known->eigenvalues; m++)
			known->dirichlet_value[d++] = (double)(l * (l + 1));
	}
	for (size_t i = 0; i < known->count; i++) {
		const double *x = known->points + 3 * i;
		memcpy(known->normals + 3 * i, x, 3 * sizeof *x);
		known->solution[i] = x[0] + x[0] * x[1] + (half ? 0 : x[1] * x[2]);
		known->source[i] = 2 * x[0] + 6 * x[0] * x[1] + (half ? 0 : 6 * x[1] * x[2]);
		known->warm[i] = x[0];
		for (size_t s = 0; s < GNP_PDE_SOURCES; s++)
			known->distance[s * known->count + i] =
				acos(fmax(-1, fmin(1, gnp_dot(x, known->points + 3 * (size_t)known->at[s]))));
		if (known->dirichlet) {
			known->dirichlet[i] = x[2];
			known->dirichlet_source[i] = 2 * x[2];
		}
	}
	known->rate = 2;
}

static void set_square_values(double *value, size_t count, int from)
{
	size_t found = 0;
	for (int square = 0; found < count; square++)
		for (int i = from; i * i <= square; i++)
			for (int j = from; i * i + j * j <= square; j++)
				if (i * i + j * j == square && found < count)
					value[found++] = M_PI * M_PI * square;
}

static void set_square(struct gnp_pde_case *known)
{
	set_square_values(known->eigenvalue, known->pieces + known->eigenvalues, 0);
	if (known->dirichlet_value)
		set_square_values(known->dirichlet_value, known->eigenvalues, 1);
	for (size_t i = 0; i < known->count; i++) {
		const double *x = known->points + 3 * i;
		known->normals[3 * i + 2] = 1;
		known->solution[i] = cos(M_PI * x[0]) * cos(M_PI * x[1]);
		known->source[i] = 2 * M_PI * M_PI * known->solution[i];
		known->warm[i] = cos(M_PI * x[0]);
		for (size_t s = 0; s < GNP_PDE_SOURCES; s++) {
			const double *from = known->points + 3 * (size_t)known->at[s];
			known->distance[s * known->count + i] = hypot(x[0] - from[0], x[1] - from[1]);
		}
		if (known->dirichlet) {
			known->dirichlet[i] = sin(M_PI * x[0]) * sin(M_PI * x[1]);
			known->dirichlet_source[i] = 2 * M_PI * M_PI * known->dirichlet[i];
		}
	}
	known->rate = M_PI * M_PI;
}

/* ---- The whole ---- */

static gnp_status allocate(struct gnp_pde_case *known, const struct exact *exact, size_t room,
                           struct gnp_error *error)
{
	bool rim = exact->surface == HALF || (exact->surface == SQUARE && exact->sampling != RANDOM_WITHIN),
		 torus = exact->surface == TORUS;
	known->eigenvalues = exact->surface == SPHERE ? 24 : 20;
	known->eigenvalue = gnp_array_new(known->pieces + known->eigenvalues, sizeof(double));
	known->source = gnp_array_new(room, sizeof(double));
	known->solution = gnp_array_new(room, sizeof(double));
	known->warm = torus ? NULL : gnp_array_new(room, sizeof(double));
	known->distance = torus ? NULL : gnp_array_new(room, GNP_PDE_SOURCES * sizeof(double));
	known->fixed = rim ? gnp_array_zero(room, 1) : NULL;
	known->dirichlet = rim ? gnp_array_new(room, sizeof(double)) : NULL;
	known->dirichlet_source = rim ? gnp_array_new(room, sizeof(double)) : NULL;
	known->dirichlet_value = rim ? gnp_array_new(known->eigenvalues, sizeof(double)) : NULL;
	if (known->eigenvalue && known->source && known->solution && (torus || (known->warm && known->distance)) &&
	    (!rim || (known->fixed && known->dirichlet && known->dirichlet_source && known->dirichlet_value)))
		return GNP_OK;
	return gnp_no_memory("case", room, "points", error);
}

static gnp_status set_known(struct gnp_pde_case *known, const struct exact *exact, struct gnp_pool *pool,
                            struct gnp_task *task, struct gnp_error *error)
{
	for (size_t s = 0; s < GNP_PDE_SOURCES; s++)
		known->at[s] = (uint32_t)(s * known->count / GNP_PDE_SOURCES + known->count / 6);
	for (size_t i = 0; i < known->count; i++)
		known->mass[i] = surfaces[exact->surface].area / (double)known->count;
	if (exact->surface == TORUS)
		return gnp_pde_torus_set(known, pool, task, error);
	if (exact->surface == SQUARE)
		set_square(known);
	else
		set_spherical(known, exact->surface == HALF);
	for (size_t i = 0; i < known->count; i++)
		known->open += known->fixed && known->fixed[i];
	return GNP_OK;
}

gnp_status gnp_pde_exact_make(size_t i, struct gnp_pool *pool, struct gnp_task *task, struct gnp_pde_case *out,
                              struct gnp_error *error)
{
	const struct exact *exact = &exacts[i];
	struct gnp_pde_case known;
	size_t room = 2 * exact->points; /* half-spheres have their rims beside, and a half of chance */
	gnp_status status = gnp_pde_case_create(surfaces[exact->surface].name, exact->name, room, &known, error);
	if (status != GNP_OK)
		return status;
	known.count = 0;
	known.spacing = sqrt(surfaces[exact->surface].area / (double)exact->points);
	status = allocate(&known, exact, room, error);
	if (status == GNP_OK)
		status = put_points(&known, exact, pool, task, error);
	if (status == GNP_OK)
		status = set_known(&known, exact, pool, task, error);
	if (status == GNP_OK)
		*out = known;
	else
		gnp_pde_case_clear(&known);
	return status;
}
