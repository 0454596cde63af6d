/* Iterations for linear systems known by what they do to a vector. */
#ifndef GNP_CORE_KRYLOV_H
#define GNP_CORE_KRYLOV_H

#include <stddef.h>

#include "core/base/pool.h"
#include "core/base/status.h"
#include "core/base/task.h"

/* y (rows) = A x (columns); x and y do not overlap. Called by one thread at a time, uses the pool itself. */
typedef gnp_status (*gnp_linear_fn)(const void *context, const double *x, double *y, struct gnp_pool *pool, struct gnp_task *task,
                                    struct gnp_error *error);

struct gnp_linear {
	gnp_linear_fn apply;
	const void *context;
};

struct gnp_krylov_options {
	double tolerance;  /* the residual wanted, relative to the right-hand side */
	size_t iterations; /* at most */
	size_t restart;    /* of GMRES: vectors kept */
};

struct gnp_krylov_report {
	double residual; /* ||b - A x|| / ||b||, computed anew at the end; of normal equations ||A^T (b - A x)|| / ||A^T b|| */
	size_t iterations;
};

/* GMRES (Saad & Schultz 1986) with a preconditioner from the right, so that residuals are the system's own. A and
 * inverse are (n, n). x (n): a guess in, the solution out. GNP_NO_CONVERGENCE, with the report and the best x so
 * far; x is undefined after other failures. The same bytes for any number of workers. */
gnp_status gnp_gmres(size_t n, struct gnp_linear matrix, struct gnp_linear inverse, const double *b,
                     const struct gnp_krylov_options *options, struct gnp_pool *pool, struct gnp_task *task, double *x,
                     struct gnp_krylov_report *report, struct gnp_error *error);

/* Conjugate gradients on A^T A x = A^T b (CGLS, Bjorck 1996) with a symmetric positive inverse of A^T A, roughly.
 * A (rows, n). As above. */
gnp_status gnp_cgls(size_t rows, size_t n, struct gnp_linear matrix, struct gnp_linear transpose, struct gnp_linear inverse,
                    const double *b, const struct gnp_krylov_options *options, struct gnp_pool *pool, struct gnp_task *task,
                    double *x, struct gnp_krylov_report *report, struct gnp_error *error);

#endif
