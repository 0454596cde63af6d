#include "core/solids/solid_grid.h"

#include <math.h>
#include <string.h>

#include "core/base/random.h"

static void vertex_place(const struct gnp_solid_grid *grid, int i, int j, double x[2])
{
	struct gnp_random random;
	gnp_random_seed(&random, grid->seed, (uint64_t)(uint32_t)i << 32 | (uint32_t)j);
	x[0] = grid->cell * (i + grid->jitter * (2 * gnp_random_uniform(&random) - 1));
	x[1] = grid->cell * (j + grid->jitter * (2 * gnp_random_uniform(&random) - 1));
}

/* The least of p's barycentric coordinates: negative outside. */
static double depth(double corner[3][2], const double p[2])
{
	const double a[2] = {corner[1][0] - corner[0][0], corner[1][1] - corner[0][1]};
	const double b[2] = {corner[2][0] - corner[0][0], corner[2][1] - corner[0][1]};
	const double d[2] = {p[0] - corner[0][0], p[1] - corner[0][1]};
	double determinant = a[0] * b[1] - a[1] * b[0];
	double second = (d[0] * b[1] - d[1] * b[0]) / determinant, third = (a[0] * d[1] - a[1] * d[0]) / determinant;
	return fmin(1 - second - third, fmin(second, third));
}

/* Of the triangles seen so far the corners are of the one that p is deepest in, which is `best` deep; NaN before the
 * first. The cut changes its direction from square to square. */
static double square_try(const struct gnp_solid_grid *grid, int i, int j, const double p[2], double best,
                         double corner[3][2])
{
	static const int halves[2][2][3] = {{{0, 1, 3}, {1, 2, 3}}, {{0, 1, 2}, {0, 2, 3}}};
	double around[4][2], triangle[3][2];
	for (int c = 0; c < 4; c++)
		vertex_place(grid, i + (c == 1 || c == 2), j + (c >= 2), around[c]);
	for (int half = 0; half < 2; half++) {
		for (int c = 0; c < 3; c++)
			memcpy(triangle[c], around[halves[(i + j) & 1][half][c]], sizeof triangle[c]);
		double deep = depth(triangle, p);
		if (!(deep <= best)) {
			best = deep;
			memcpy(corner, triangle, sizeof triangle);
		}
	}
	return best;
}

static int square_of(double x, double cell)
{
	static const double FARTHEST = 1e8;
	return (int)fmin(FARTHEST, fmax(-FARTHEST, floor(x / cell)));
}

void gnp_solid_grid_find(const struct gnp_solid_grid *grid, const double p[2], double corner[3][2])
{
	static const int beside[9][2] = {{0, 0}, {-1, 0}, {1, 0}, {0, -1}, {0, 1}, {-1, -1}, {1, -1}, {-1, 1}, {1, 1}};
	int i = square_of(p[0], grid->cell), j = square_of(p[1], grid->cell);
	double best = NAN;
	for (int n = 0; n < 9 && !(best >= 0); n++)
		best = square_try(grid, i + beside[n][0], j + beside[n][1], p, best, corner);
}
