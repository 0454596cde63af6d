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
#include "core/cloud/prepare.h"

enum { GNP_STAR_NEIGHBORS = 160 }; /* nearest points that are looked at, at most */

struct gnp_star {
	size_t edges;
	uint32_t neighbor[GNP_CELL_EDGES_MAX]; /* (edges) position in `index` */
	double weight[GNP_CELL_EDGES_MAX];     /* (edges) half the sum of the cotangents of the angles across; may be < 0 */
	/* The point's part of the triangles, by the mixed cells of Meyer et al. 2003, and of a strip along a ragged rim
	 * [length^2]; without a triangle, what the nearest neighbour leaves; 0: there is none. */
	double area;
	double rim;            /* the length of an open edge that the point stands for [length]; 0: it is at none */
	size_t triangles;
	uint8_t corner[GNP_CELL_EDGES_MAX][2]; /* (triangles) with the edges to the other two, in turn about the normal */
	bool open;   /* the triangles do not close around the point */
};

/* As gnp_cell_make; index: up to GNP_STAR_NEIGHBORS. Of points that lie on one circle, as on grids, the same diagonals
 * are taken from every side. */
void gnp_star_make(const double *points, const double *normals, size_t centre, const uint32_t *index, size_t count,
                   struct gnp_star *out);

/* What is done with the star of a point: its positions are in row, whose farthest point is so far away. */
typedef void (*gnp_star_visit)(void *context, size_t point, const struct gnp_star *star, const uint32_t *row,
                               double farthest);

/* Visits the stars of points begin .. end - 1 of a cloud, in order: of their nearest GNP_CELL_NEIGHBORS, or of
 * GNP_STAR_NEIGHBORS where those do not close the star and lie in a row; by the normals from before a fit where there
 * are any: they run on over creases. GNP_OUT_OF_MEMORY. */
gnp_status gnp_stars_visit(const struct gnp_prepared *prepared, size_t begin, size_t end, gnp_star_visit visit,
                           void *context, struct gnp_scratch *scratch, struct gnp_error *error);

#endif
