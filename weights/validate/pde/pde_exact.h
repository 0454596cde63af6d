/* Clouds on surfaces where equations have exact answers: spheres, a torus, unit squares and a half-sphere, sampled
 * evenly, at random and in rows. */
#ifndef GNP_WEIGHTS_PDE_EXACT_H
#define GNP_WEIGHTS_PDE_EXACT_H

#include "weights/validate/pde/pde_case.h"

struct gnp_pde_exact_name {
	const char *surface, *sampling;
	size_t points; /* about */
};

/* The i-th; false past the last. */
bool gnp_pde_exact_name(size_t i, struct gnp_pde_exact_name *out);

/* Deterministic. On failure *out is unchanged. */
gnp_status gnp_pde_exact_make(size_t i, struct gnp_pool *pool, struct gnp_task *task, struct gnp_pde_case *out,
                              struct gnp_error *error);

#endif
