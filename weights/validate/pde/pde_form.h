/* The judge's own equations: a symmetric stiffness S and lumped masses M, its lowest eigenpairs S x = lambda M x,
 * and its solutions S u = M f. Shares factors and sums with the library (core/linear), and no operator. */
#ifndef GNP_WEIGHTS_PDE_FORM_H
#define GNP_WEIGHTS_PDE_FORM_H

#include "core/linear/csr.h"

/* Owned; freed by gnp_pde_form_clear. points are the caller's. */
struct gnp_pde_form {
	struct gnp_csr stiffness; /* symmetric, positive semidefinite; an entry on every diagonal */
	double *mass;             /* (rows) > 0 */
	const double *points;     /* (rows, 3) where the unknowns are: to eliminate them in a good order */
};
void gnp_pde_form_clear(struct gnp_pde_form *form);

/* The `count` lowest eigenvalues, ascending (count) out, by block Lanczos iteration with (S + sigma M)^-1 and every
 * vector made orthogonal to all before it. It ends when ||S x - lambda M x|| <= 1e-6 (lambda + sigma) for all of
 * them, in the norm of M^-1 for x of unit length, so that there is an eigenvalue as near to lambda; sigma is of the
 * size of the first one but zero. GNP_NO_CONVERGENCE. Deterministic. */
gnp_status gnp_pde_form_lowest(const struct gnp_pde_form *form, size_t count, struct gnp_pool *pool,
                               struct gnp_task *task, double *value, struct gnp_error *error);

/* u (rows) out for f (rows): of zero mean by M on each part that stands alone, f too: its mean is taken off. */
gnp_status gnp_pde_form_solve(const struct gnp_pde_form *form, const double *source, struct gnp_pool *pool,
                              struct gnp_task *task, double *solution, struct gnp_error *error);

#endif
