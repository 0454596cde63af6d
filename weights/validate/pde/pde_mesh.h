/* A mesh made ready for equations: one surface whose vertices are a cloud, with its edges.
 *
 * Vertices at one place are made one. Triangles without three places or without area, and all but one of those with
 * the same three corners, are left out; so are vertices without a triangle, and pieces of less than a hundredth of
 * the vertices: debris of scans. An edge of three triangles or more stays: such meshes have functions and ways on
 * them as others have. */
#ifndef GNP_WEIGHTS_PDE_MESH_H
#define GNP_WEIGHTS_PDE_MESH_H

#include "weights/validate/real_mesh.h"

/* Owned; freed by gnp_pde_mesh_clear. */
struct gnp_pde_mesh {
	struct gnp_real_mesh surface;
	size_t pieces; /* that do not touch each other */
	size_t edge_count;
	uint32_t *edge;       /* (edge_count, 2) ends, the lower one first; ascending */
	uint32_t *edge_of;    /* (triangles, 3) the edge across from each corner */
	size_t *around_start; /* (edge_count + 1) */
	uint32_t *around;     /* (3 triangles) triangles at each edge */
	size_t open, crowded; /* edges of one triangle, and of more than two */
	double edge_length;   /* their mean [length] */
};

/* GNP_INVALID_ARGUMENT: nothing is left of it. On failure *out is unchanged. */
gnp_status gnp_pde_mesh_make(const struct gnp_real_mesh *mesh, struct gnp_pde_mesh *out, struct gnp_error *error);
void gnp_pde_mesh_clear(struct gnp_pde_mesh *mesh);

/* The length of an edge. */
double gnp_pde_mesh_length(const struct gnp_pde_mesh *mesh, size_t edge);

#endif
