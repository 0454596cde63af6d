/* Solves an equation's linear system: by a factor of it, or by iterations preconditioned with a factor of its
 * finite-volume form. */
#ifndef GNP_CORE_SOLVER_H
#define GNP_CORE_SOLVER_H

#include "core/equations/equation.h"
#include "core/linear/factor.h"
#include "core/linear/krylov.h"

enum gnp_solver_kind { GNP_SOLVER_AUTO, GNP_SOLVER_DIRECT, GNP_SOLVER_ITERATIVE };

struct gnp_solver; /* opaque, immutable; borrows its equation */

/* auto: direct up to 250,000 points where the memory allows it. memory_limit [bytes] of the factor while it is made; 0:
 * none. GNP_TOO_LARGE, before the factor is made, where it would exceed the limit; GNP_SINGULAR. The equation's normal
 * matrix is dropped. */
gnp_status gnp_solver_create(struct gnp_equation *equation, const struct gnp_domain *domain, int kind,
                             size_t memory_limit, struct gnp_pool *pool, struct gnp_task *task, struct gnp_solver **out,
                             struct gnp_error *error);
void gnp_solver_free(struct gnp_solver *solver);
size_t gnp_solver_bytes(const struct gnp_solver *solver);
int gnp_solver_kind(const struct gnp_solver *solver); /* direct or iterative */

/* x (count, unknowns) = solutions, a row each, of the pinned system for b (count, rows), at given points that of b. The
 * squares of b's numbers have to be numbers. report (count). The iterative solver's options say how accurate;
 * GNP_NO_CONVERGENCE with reports filled. */
gnp_status gnp_solver_apply(const struct gnp_solver *solver, const double *b, size_t count,
                            const struct gnp_krylov_options *options, struct gnp_pool *pool, struct gnp_task *task,
                            double *x, struct gnp_krylov_report *report, struct gnp_error *error);

/* The factor of a matrix (factor_plan.h), where the limit of memory (0: none) allows it. fits (may be NULL: then it
 * must) says whether that does. */
gnp_status gnp_solver_factor(const struct gnp_csr *matrix, bool symmetric, const double *points, size_t memory_limit,
                             struct gnp_pool *pool, struct gnp_task *task, bool *fits, struct gnp_factor **out,
                             struct gnp_error *error);

#endif
