/* The triangles of a point with its neighbours: its star in the local Delaunay triangulation, measured in space.
 *
 * Which triangles there are is decided in the tangent plane, where neighbours keep their distance and direction (the
 * logarithm of the surface, to first order); how large they are, by the places themselves. Stars of neighbours agree
 * where the surface is resolved, and then the weights are those of the cotangent Laplacian (Pinkall & Polthier 1993) of
 * a Delaunay mesh; where they do not, each counts for its point. Compare the local triangulations of Sharp & Crane 2020
 * ("A Laplacian for nonmanifold triangle meshes"). */
#ifndef GNP_CORE_STAR_H
#define GNP_CORE_STAR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/cells/cell.h"

struct gnp_star {
	size_t edges;
	uint32_t neighbor[GNP_CELL_EDGES_MAX]; /* (edges) position in `index` */
	double weight[GNP_CELL_EDGES_MAX];     /* (edges) half the sum of the cotangents of the angles across; may be < 0 */
	/* The point's part of the triangles, by the mixed cells of Meyer et al. 2003 [length^2]; 0: there are none. */
	double area;
	bool open;   /* the triangles do not close around the point */
};

/* As gnp_cell_make. Of points that lie on one circle, as on grids, the same diagonals are taken from every side. */
void gnp_star_make(const double *points, const double *normals, size_t centre, const uint32_t *index, size_t count,
                   struct gnp_star *out);

#endif
