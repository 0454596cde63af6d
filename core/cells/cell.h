/* Voronoi cells of a cloud's points, each in the point's tangent plane among the neighbours of its sheet: how much
 * area a point stands for, where the cell's centroid is, how wide the largest gap about the point is, and the edges
 * shared with neighbours, from which the finite-volume Laplacian follows (on a mesh: the cotangent Laplacian of the
 * local Delaunay triangulation).
 *
 * Cells that neighbours do not close, at open boundaries, are cut at about half a spacing outside. */
#ifndef GNP_CORE_CELL_H
#define GNP_CORE_CELL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/status.h"

enum {
	GNP_CELL_NEIGHBORS = 32, /* nearest points a cell is cut by */
	GNP_CELL_EDGES_MAX = 40  /* of a polygon cut from a square by those (polygon.h) */
};

/* In the frame (t1, t2) of the tangent plane, about the point. */
struct gnp_cell {
	double area;          /* [length^2] */
	double centroid[2];   /* [length] */
	double gap;           /* distance of the farthest corner: no point is nearer to it than this one [length] */
	double corner[2];     /* that corner */
	bool hole;            /* wide for its surroundings (over the mean distance of the six nearest points), with points on all sides */
	bool open;            /* not closed by neighbours: on or near a boundary, or the gap is wider than the neighbours looked at */
	size_t edges;
	uint32_t neighbor[GNP_CELL_EDGES_MAX]; /* (edges) position in `index` of the neighbour across each edge */
	double weight[GNP_CELL_EDGES_MAX];     /* (edges) length of the edge over the distance to that neighbour, > 0 */
};

/* The cell of points[centre]. normals (n, 3) unit; index (count): the nearest points ascending by distance, the centre itself or
 * points that coincide with it (to a billionth of the way to the last) may be among them, and do not cut. tangents: two unit vectors that span the plane. */
void gnp_cell_make(const double *points, const double *normals, size_t centre, const uint32_t *index, size_t count,
                   double tangents[2][3], struct gnp_cell *out);

/* What the point stands for: the cell's area, or where it is alone on its sheet the square of the distance to the last neighbour looked at. > 0 */
double gnp_cell_share(const struct gnp_cell *cell, double last);

/* Two unit vectors t1, t2 with t1 x t2 = n, the same for the same n. */
void gnp_tangents_of(const double n[3], double tangents[2][3]);

#endif
