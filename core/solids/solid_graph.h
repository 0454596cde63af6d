/* Height fields over a rectangle or a disc: a paraboloid and waves on it, smooth or as triangles, maybe with round
 * holes.
 *
 * In coordinates of their own; solid_face puts them into those of a body. */
#ifndef GNP_CORE_SOLID_GRAPH_H
#define GNP_CORE_SOLID_GRAPH_H

#include <stdbool.h>

#include "core/base/random.h"
#include "core/solids/solid_grid.h"

enum { GNP_SOLID_WAVES = 64, GNP_SOLID_HOLES = 3 };

/* z = (bend[0] x^2 + bend[1] y^2) / 2 + sum of height w(wave . (x, y) + phase) over |x| <= half[0], |y| <= half[1], or
 * over the disc of radius half[0], less round holes (x, y, radius). Parameters: x, y. */
struct gnp_solid_graph {
	bool disc;
	double half[2], bend[2];
	int waves, holes;
	double wave[GNP_SOLID_WAVES][2], height[GNP_SOLID_WAVES], phase[GNP_SOLID_WAVES];
	double soft[GNP_SOLID_WAVES]; /* w(t): sin t where 0, else the ridges sqrt(sin^2 t + soft^2) */
	double hole[GNP_SOLID_HOLES][3];
	struct gnp_solid_grid grid; /* cell 0: none; else z is the linear interpolant of the above on its triangles */
	double stretch; /* no less than the area of the surface over that of its shadow; of more than eight waves places
	                   steeper than four times the root mean square, fewer than 1 in 10^5, count as that steep */
};

/* z, its gradient and zxx, zxy, zyy; anywhere in the plane. On triangles the gradient is theirs and the second
 * derivatives are 0. */
double gnp_solid_graph_height(const struct gnp_solid_graph *graph, const double p[2], double slope[2],
                              double second[3]);

bool gnp_solid_graph_contains(const struct gnp_solid_graph *graph, const double p[2]);

/* Sets the stretch, which the functions below need. */
void gnp_solid_graph_bound(struct gnp_solid_graph *graph);

/* What draws are uniform over: the shadow of the field without its holes, stretched. */
double gnp_solid_graph_area(const struct gnp_solid_graph *graph);

/* Draws a place, uniform by area of the surface. False where the draw is refused. */
bool gnp_solid_graph_draw(const struct gnp_solid_graph *graph, struct gnp_random *random, double p[2]);

#endif
