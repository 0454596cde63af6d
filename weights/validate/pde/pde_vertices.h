/* The vertices of a mesh as a cloud, with what its triangles say of equations on it. */
#ifndef GNP_WEIGHTS_PDE_VERTICES_H
#define GNP_WEIGHTS_PDE_VERTICES_H

#include "weights/validate/pde/pde_case.h"
#include "weights/validate/pde/pde_mesh.h"

/* Eigenvalues and the solution by cotangents (pde_cotangent.h), distances along triangles (pde_paths.h). f is three
 * bells of both signs, of a tenth of the diagonal about vertices far from each other, less its mean; distances are
 * from those. Normals are the triangles' means about each vertex. */
gnp_status gnp_pde_vertices_make(const char *name, const struct gnp_pde_mesh *mesh, struct gnp_pool *pool,
                                 struct gnp_task *task, struct gnp_pde_case *out, struct gnp_error *error);

#endif
