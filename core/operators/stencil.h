/* A polynomial fit's derivatives at a point as linear functionals of its neighbours' values (generalised moving least
 * squares; Wendland 2005, Trask et al. 2016).
 *
 * The polynomial p of total degree d minimises sum_j w(r_j) (p(u_j, v_j) - f_j)^2, r_j the in-plane distance from the
 * point in units of the farthest neighbour's, w(r) = (1 - r^2)^4 / (r^2 + 1e-3): the nearest weigh most, which is what
 * makes a Laplacian of such rows stable. Each derivative at the point is then sum_j s_j f_j, exact for polynomials of
 * degree d. */
#ifndef GNP_CORE_STENCIL_H
#define GNP_CORE_STENCIL_H

#include <stddef.h>

#include "core/base/scratch.h"
#include "core/base/status.h"

enum gnp_stencil_part {
	GNP_STENCIL_VALUE,
	GNP_STENCIL_U,
	GNP_STENCIL_V,
	GNP_STENCIL_UU,
	GNP_STENCIL_UV,
	GNP_STENCIL_VV,
	GNP_STENCIL_PARTS
};

enum { GNP_STENCIL_DEGREE_MAX = 7 };

/* u, v (count): in-plane coordinates of the neighbours about the point [length], the point itself among them or not. Of
 * each part with weights[part] not NULL its functional is written there (count) [length^-order]. Where the neighbours
 * do not determine the degree, or so hardly that constants do not come out as such, the next lower one is taken, down
 * to `lowest`; *used says which. GNP_DEGENERATE when that fails too, GNP_OUT_OF_MEMORY. */
gnp_status gnp_stencil_fit(unsigned degree, unsigned lowest, const double *u, const double *v, size_t count,
                           struct gnp_scratch *scratch, double *const weights[GNP_STENCIL_PARTS], unsigned *used,
                           struct gnp_error *error);

#endif
