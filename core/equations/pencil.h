/* The matrix S - sigma M of one piece of a cloud with its factor: what eigenpairs about sigma are found with. */
#ifndef GNP_CORE_PENCIL_H
#define GNP_CORE_PENCIL_H

#include "core/equations/pieces.h"
#include "core/linear/csr.h"
#include "core/linear/factor.h"

/* Of n points. Owned; freed by gnp_pencil_clear, also after a failure. */
struct gnp_pencil {
	struct gnp_csr matrix; /* (n, n) */
	struct gnp_factor *factor;
	double *mass;      /* (n) */
	double *points;    /* (n, 3) */
	double *constant;  /* (n) of length 1 by the masses */
	double *left;      /* (GNP_LANCZOS_BLOCK, n): what solutions leave, where sigma is above 0; else NULL */
	double sigma;
	bool floats;       /* nothing of it is next to a fixed point: the constant has the eigenvalue 0 */
};

/* sigma: what is wanted. Below 0 it may come out farther from 0, above all eigenvalues nearer to them. GNP_TOO_LARGE
 * where the factor would not fit the memory limit (0: none), GNP_SINGULAR where sigma is an eigenvalue. */
gnp_status gnp_pencil_make(const struct gnp_pieces *pieces, size_t piece, const struct gnp_domain *domain,
                           const struct gnp_stiffness *volumes, double sigma, size_t memory_limit,
                           struct gnp_pool *pool, struct gnp_task *task, struct gnp_pencil *out,
                           struct gnp_error *error);
void gnp_pencil_clear(struct gnp_pencil *pencil);

/* y = (S - sigma M)^-1 M x, a block at a time (lanczos.h). pencil: as context. */
gnp_status gnp_pencil_apply(const void *pencil, const double *x, double *y, struct gnp_pool *pool,
                            struct gnp_task *task, struct gnp_error *error);

#endif
