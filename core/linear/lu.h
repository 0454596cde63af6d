/* Sparse LU of matrices whose unknowns sit at points of a surface, L L^T where the plan says that they are symmetric and positive definite:
 * multifrontal (Duff & Reid 1983), rows exchanged within supernodes, in parallel over subtrees and within the fronts above them.
 *
 * For the collocation matrices here, which are nearly symmetric in structure and heavy on the diagonal; accuracy is what
 * pivoting within supernodes gives, which a step of refinement by the caller makes full. */
#ifndef GNP_CORE_LU_H
#define GNP_CORE_LU_H

#include "core/linear/lu_plan.h"

struct gnp_lu; /* opaque, immutable, shared between threads */

/* Takes the plan made for this matrix's structure, also on failure. GNP_SINGULAR with the step where no pivot was found, also for
 * entries that are not finite; GNP_CANCELLED within one front. Deterministic for any worker count. task may be NULL; its stage
 * advances by plan->symbolic.supernodes items. */
gnp_status gnp_lu_factor_take(const struct gnp_csr *matrix, struct gnp_lu_plan *plan, struct gnp_pool *pool, struct gnp_task *task,
                              struct gnp_lu **out, struct gnp_error *error);
void gnp_lu_free(struct gnp_lu *lu);
size_t gnp_lu_bytes(const struct gnp_lu *lu);

/* x (count, n): right-hand sides in, solutions out, a row each. On failure x is undefined. */
gnp_status gnp_lu_solve(const struct gnp_lu *lu, double *x, size_t count, struct gnp_pool *pool, struct gnp_task *task,
                        struct gnp_error *error);

#endif
