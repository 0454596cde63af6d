/* Factors a sparse matrix whose unknowns sit at points of a surface: L U, or L L^T (Cholesky) where the plan says
 * that it is symmetric and positive definite. factor_solve.h solves by it.
 *
 * Multifrontal (Duff & Reid 1983), rows exchanged within supernodes, in parallel over subtrees and within the fronts
 * above them.
 *
 * For the collocation matrices here, which are nearly symmetric in structure and heavy on the diagonal; accuracy
 * is what pivoting within supernodes gives, which a step of refinement by the caller makes full. */
#ifndef GNP_CORE_FACTOR_H
#define GNP_CORE_FACTOR_H

#include "core/linear/factor_plan.h"

struct gnp_factor; /* opaque, immutable, shared between threads */

/* Takes the plan made for this matrix's structure, also on failure. GNP_SINGULAR with the step where no pivot was
 * found, also for entries that are not finite; GNP_CANCELLED within one front. Deterministic for any worker count.
 * task may be NULL; its stage advances by plan->symbolic.supernodes items. On a surface O(n^1.5) operations and
 * O(n log n) memory: with 13 entries a row some 380 n^1.5, and 2.2 kB an unknown at n = 100,000. The plan has the
 * numbers: operations, bytes, peak_bytes. */
gnp_status gnp_factor_make_take(const struct gnp_csr *matrix, struct gnp_factor_plan *plan, struct gnp_pool *pool,
                                struct gnp_task *task, struct gnp_factor **out, struct gnp_error *error);
void gnp_factor_free(struct gnp_factor *factor);
size_t gnp_factor_bytes(const struct gnp_factor *factor);

#endif
