/* A triangle mesh that the real table samples: read from a file, with its area, size and normals.
 *
 * Files are what deploy/mesh-to-triangles.js writes: binary little-endian PLY with float vertices x, y, z and faces of
 * three int corners, in exactly this form. Corners turn counter-clockwise seen from outside. */
#ifndef GNP_WEIGHTS_REAL_MESH_H
#define GNP_WEIGHTS_REAL_MESH_H

#include <stddef.h>
#include <stdint.h>

#include "core/base/status.h"

/* Owned; gnp_real_mesh_clear frees the arrays. */
struct gnp_real_mesh {
	size_t vertex_count, triangle_count;
	double *vertices;    /* (vertex_count, 3) [length] */
	uint32_t *triangles; /* (triangle_count, 3) */
	double area;         /* of all triangles [length squared] */
	double diagonal;     /* of the vertices' bounding box [length] */
};

/* GNP_IO: the file cannot be read; GNP_INVALID_ARGUMENT: what it holds is not of the form. On failure *out is
 * unchanged. */
gnp_status gnp_real_mesh_read(const char *path, struct gnp_real_mesh *out, struct gnp_error *error);
/* The same of arrays, which are copied: vertices (vertex_count, 3), triangles (triangle_count, 3) with corners below
 * vertex_count. */
gnp_status gnp_real_mesh_create(const double *vertices, size_t vertex_count, const uint32_t *triangles,
                                size_t triangle_count, struct gnp_real_mesh *out, struct gnp_error *error);
void gnp_real_mesh_clear(struct gnp_real_mesh *mesh);

/* The area of a triangle, and its unit normal out (0 where there is no area). */
double gnp_real_mesh_normal(const struct gnp_real_mesh *mesh, size_t triangle, double normal[3]);

/* Unit normals of the vertices (vertex_count, 3): the mean of those of the triangles about each, weighed by area; 0
 * where they cancel or there are none. */
void gnp_real_mesh_vertex_normals(const struct gnp_real_mesh *mesh, double *normals);

#endif
