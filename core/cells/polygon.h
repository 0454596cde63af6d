/* A convex polygon about the origin that is cut by lines: a Voronoi cell in the making. */
#ifndef GNP_CORE_POLYGON_H
#define GNP_CORE_POLYGON_H

#include <stddef.h>
#include <stdint.h>

enum { GNP_POLYGON_MAX = 40 }; /* corners */

/* A side that nobody cut: of the square at the beginning. */
#define GNP_POLYGON_OUTER UINT32_MAX

/* Counterclockwise; the side that begins at corner i was cut by cutter[i]. */
struct gnp_polygon {
	size_t count;
	double x[GNP_POLYGON_MAX], y[GNP_POLYGON_MAX];
	uint32_t cutter[GNP_POLYGON_MAX];
};

/* Of sides 2 half. */
void gnp_polygon_square(double half, struct gnp_polygon *out);

/* Keeps the half plane a x + b y <= c, c > 0. O(corners). */
void gnp_polygon_cut(struct gnp_polygon *polygon, double a, double b, double c, uint32_t cutter);

/* The squared distance of the farthest corner, which is *farthest; 0 where there is none. */
double gnp_polygon_reach(const struct gnp_polygon *polygon, size_t *farthest);

#endif
