/* Solves linear systems by a factor that is there (factor.h): forward and backward substitution, several right-hand
 * sides at once, in parallel over subtrees. */
#ifndef GNP_CORE_FACTOR_SOLVE_H
#define GNP_CORE_FACTOR_SOLVE_H

#include "core/linear/factor.h"

/* x (count, n): right-hand sides in, solutions out, a row each. On failure x is undefined. Deterministic for any worker
 * count. Time of a right-hand side: 2 operations an entry of the factor, which is read once for 8 of them; memory: 8
 * bytes for each of their unknowns and of the factor's border rows. */
gnp_status gnp_factor_solve(const struct gnp_factor *factor, double *x, size_t count, struct gnp_pool *pool,
                            struct gnp_task *task, struct gnp_error *error);

#endif
