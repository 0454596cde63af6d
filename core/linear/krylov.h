/* Solves linear systems by iteration, where a system is known by what it does to a vector: GMRES for square ones,
 * CGLS for least squares. */
#ifndef GNP_CORE_KRYLOV_H
#define GNP_CORE_KRYLOV_H

#include <stddef.h>

#include "core/base/pool.h"
#include "core/base/status.h"
#include "core/base/task.h"

/* y = A x; x and y do not overlap. Called by one thread at a time, uses the pool itself. */
typedef gnp_status (*gnp_krylov_map_fn)(const void *context, const double *x, double *y, struct gnp_pool *pool,
                                        struct gnp_task *task, struct gnp_error *error);

struct gnp_krylov_map {
	gnp_krylov_map_fn apply;
	const void *context;
};

/* A x = b, known by what its parts do; all borrowed. */
struct gnp_krylov_system {
	size_t rows, n;                  /* of A; n unknowns */
	struct gnp_krylov_map matrix;    /* A */
	struct gnp_krylov_map transpose; /* A^T; GMRES does without */
	struct gnp_krylov_map inverse;   /* (n, n) the preconditioner: nearly A^-1 for GMRES, (A^T A)^-1 for CGLS */
	struct gnp_pool *pool;
	struct gnp_task *task;           /* asked before each iteration whether to go on; may be NULL */
};

struct gnp_krylov_options {
	double tolerance;  /* the residual wanted, relative to the right-hand side */
	size_t iterations; /* at most */
	size_t restart;    /* of GMRES: vectors kept */
};

struct gnp_krylov_report {
	double residual; /* ||b - A x|| / ||b||, computed anew at the end; of CGLS ||A^T (b - A x)|| / ||A^T b|| */
	size_t iterations;
};

/* GMRES (Saad & Schultz 1986) with a preconditioner from the right, so that residuals are the system's own; A is
 * square. b (rows); x (n): a guess in, the solution out. GNP_NO_CONVERGENCE, with the report and the best x so far; x
 * is undefined after other failures. The same bytes for any number of workers. Takes restart + 2 vectors of n; the k-th
 * iteration of a cycle reads k of them four times. */
gnp_status gnp_krylov_gmres(const struct gnp_krylov_system *system, const double *b,
                            const struct gnp_krylov_options *options, double *x, struct gnp_krylov_report *report,
                            struct gnp_error *error);

/* Conjugate gradients on A^T A x = A^T b (CGLS, Bjorck 1996) with a symmetric positive preconditioner. As above.
 * Takes 2 vectors of rows and 3 of n. */
gnp_status gnp_krylov_cgls(const struct gnp_krylov_system *system, const double *b,
                           const struct gnp_krylov_options *options, double *x, struct gnp_krylov_report *report,
                           struct gnp_error *error);

#endif
