/* The Laplace-Beltrami operator of a cloud, and other surface derivatives, as sparse matrices over its points. */
#ifndef GNP_CORE_LAPLACIAN_H
#define GNP_CORE_LAPLACIAN_H

#include "core/cells/diffusion.h"
#include "core/operators/collocation.h"
#include "core/operators/domain.h"

/* auto: square where that can be believed, else symmetric; of matrices alone square. square: collocation, every point
 * carries an unknown. least_squares (the paper): all points collocate, but a share of them, chosen
 * by farthest points, carries none. symmetric: the weak Laplacian (weak.h), which holds on any cloud. */
enum gnp_system { GNP_SYSTEM_AUTO, GNP_SYSTEM_SYMMETRIC, GNP_SYSTEM_SQUARE, GNP_SYSTEM_LEAST_SQUARES };

struct gnp_laplacian_options {
	struct gnp_domain_options domain;
	int system;      /* enum gnp_system */
	double drop;     /* share of points without unknowns, of least_squares; 0..0.5 */
	int degree;      /* of the local polynomials in u and v together; 2..7, 1..7 for first derivatives alone; 0: 5 if square, 4 of least squares */
	int neighbors;   /* points of a stencil; 0: twice the polynomial's coefficients; at most 500 */
	unsigned which;  /* mask of GNP_DERIVATIVE_BIT */
	const struct gnp_stiffness *stiffness; /* of the domain (volume.h), which symmetric stands on; NULL: it is made */
};

/* gmls at k 30 (estimate.h), square, drop 0.1, degree by system, neighbours by degree; the Laplacian. */
struct gnp_laplacian_options gnp_laplacian_defaults(void);
/* The degree that options come to, and the points of a stencil. */
unsigned gnp_laplacian_degree(const struct gnp_laplacian_options *options);
size_t gnp_laplacian_neighbors(const struct gnp_laplacian_options *options);
/* Whether a system has all matrices of a mask: collocation all but the stiffness, the weak form that and the
 * Laplacian. */
gnp_status gnp_laplacian_check_which(int system, unsigned which, struct gnp_error *error);

/* Row i is that of the cloud's point i, empty where the filter dropped it; kept names points of the cloud, ascending
 * (collocation.h). GNP_INVALID_ARGUMENT; GNP_DEGENERATE when all points are dropped. Deterministic
 * for any worker count. On failure *out and *facts are unchanged. facts and task may be NULL; the task is warned of
 * rows that no Laplacian has (operator_check.h). */
gnp_status gnp_laplacian_run(const struct gnp_cloud *cloud, const struct gnp_laplacian_options *options,
                             struct gnp_pool *pool, struct gnp_task *task, struct gnp_collocation *out,
                             struct gnp_domain_facts *facts, struct gnp_error *error);

/* The same of a domain, in its curve order. unknown (points): 1: never dropped; NULL: any may be. */
gnp_status gnp_laplacian_assemble(const struct gnp_domain *domain, const struct gnp_laplacian_options *options,
                                  const unsigned char *unknown, struct gnp_pool *pool, struct gnp_task *task,
                                  struct gnp_collocation *out, struct gnp_error *error);

#endif
