/* Triangles of the plane: a square grid whose vertices are moved at random, each square cut in two.
 *
 * Nothing is stored: a vertex follows from its number and the seed, and the grid has no end. */
#ifndef GNP_CORE_SOLID_GRID_H
#define GNP_CORE_SOLID_GRID_H

#include <stdint.h>

struct gnp_solid_grid {
	double cell;   /* side of the squares */
	double jitter; /* how far a vertex is moved along x and y at most, in cells; below 1/4 no triangle turns over */
	uint64_t seed;
};

/* The corners of the triangle that p is in, counterclockwise, in an order of the triangle's own. */
void gnp_solid_grid_find(const struct gnp_solid_grid *grid, const double p[2], double corner[3][2]);

#endif
