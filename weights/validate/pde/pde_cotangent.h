/* The Laplacian of a mesh's own triangles, which clouds of its vertices are held against: the cotangent weights of
 * Pinkall & Polthier 1993. */
#ifndef GNP_WEIGHTS_PDE_COTANGENT_H
#define GNP_WEIGHTS_PDE_COTANGENT_H

#include "weights/validate/pde/pde_form.h"
#include "weights/validate/pde/pde_mesh.h"

/* S: for each triangle half the cotangent of a corner to the side across, also where that is negative, and however
 * many triangles a side has; rims are natural. M: a third of each triangle to each corner. A cotangent is at most
 * 1e6 in size, which thinner corners would exceed. The form borrows the mesh's vertices. On failure *out is
 * unchanged. */
gnp_status gnp_pde_cotangent_make(const struct gnp_pde_mesh *mesh, struct gnp_pde_form *out, struct gnp_error *error);

#endif
