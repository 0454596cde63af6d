/* Finds eigenpairs of a symmetric operator that is known by what it does to vectors: block Lanczos iteration with
 * thick restarts (Wu & Simon 2000; Saad 2011, chapter 7).
 *
 * Every vector is made orthogonal to all others of the basis, twice, and the operator's matrix in the basis is taken
 * as it is measured: pairs come once each, real, with orthonormal vectors. A multiple eigenvalue is found as often as a
 * block has vectors, and more often where a block comes to less than its number of vectors: then others begin. */
#ifndef GNP_CORE_LANCZOS_H
#define GNP_CORE_LANCZOS_H

#include <stddef.h>

#include "core/base/pool.h"
#include "core/base/status.h"
#include "core/base/task.h"

enum { GNP_LANCZOS_BLOCK = 8 };

/* y (GNP_LANCZOS_BLOCK, n) = A x, a vector a row; x and y do not overlap. Uses the pool itself. */
typedef gnp_status (*gnp_lanczos_map_fn)(const void *context, const double *x, double *y, struct gnp_pool *pool,
                                         struct gnp_task *task, struct gnp_error *error);

/* All borrowed. */
struct gnp_lanczos {
	size_t n, wanted;     /* n more than gnp_lanczos_vectors(wanted) */
	const double *mass;   /* (n) > 0: of the inner product sum_i mass_i x_i y_i, by which A is symmetric */
	gnp_lanczos_map_fn apply;
	const void *context;
	const double *known;  /* (n) of length 1: an eigenvector to begin with, or NULL */
	double known_value;   /* its eigenvalue */
	double tolerance;     /* of ||A v - theta v|| / |theta| */
	struct gnp_pool *pool;
	struct gnp_task *task; /* asked before each block whether to go on; may be NULL */
};

/* Those whose eigenvalues theta are largest by magnitude: theta (wanted) in that order, vector (wanted, n), residual
 * (wanted). *products: vectors that A was applied to. GNP_NO_CONVERGENCE. On failure what is written is undefined.
 * Deterministic for any worker count. */
gnp_status gnp_lanczos_find(const struct gnp_lanczos *system, double *theta, double *vector, double *residual,
                            size_t *products, struct gnp_error *error);

/* Vectors of n numbers that the basis has room for. */
size_t gnp_lanczos_vectors(size_t wanted);

#endif
