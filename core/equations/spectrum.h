/* Finds eigenpairs of -Delta on a cloud: the lowest, or those nearest to a value. All inverts -Delta - sigma by one
 * factor: what is nearest to sigma becomes largest.
 *
 * By the symmetric operator (spectrum_symmetric.c) they are those of a symmetric matrix, by collocation
 * (spectrum_square.c) those of one that is nearly symmetric. */
#ifndef GNP_CORE_SPECTRUM_H
#define GNP_CORE_SPECTRUM_H

#include "core/equations/poisson.h"

/* Owned; freed by gnp_spectrum_clear. */
struct gnp_spectrum {
	size_t points, count;
	double *value;     /* (count) ascending [1 / length^2]; where nothing is fixed 0 once for each component first */
	double *imaginary; /* (count) what an unsymmetric operator leaves beside it, a measure of its error; symmetric: 0 */
	double *vector;    /* (count, points) in the cloud's order, unit length when points weigh by their area, symmetric:
	                    * orthonormal; 0 at fixed points; points the filter dropped have the local fit's value */
	double *residual;  /* (count) ||(-Delta - sigma)^-1 v - v / (value - sigma)|| |value - sigma| */
	size_t solves;
	int system;          /* enum gnp_system: as asked for, or chosen */
	const char *why;     /* it was chosen; NULL: it was asked for */
	struct gnp_domain_facts surface;
};

struct gnp_spectrum_wanted {
	size_t count;     /* 1..500, no more than free points; of collocation fewer by far */
	double shift;     /* >= 0 [1 / length^2]: those nearest to it, to a ten-thousandth of it; 0: the lowest */
	double tolerance; /* of the residuals; 1e-12..0.1 */
};

/* Whether a cloud of so many points has enough for the count lowest by a system. */
gnp_status gnp_spectrum_check(size_t count, size_t points, int system, struct gnp_error *error);

/* options: as for gnp_poisson_prepare, screening ignored; fixed: u = 0 there (Dirichlet), else open edges are natural.
 * With the symmetric operator every cloud has its pairs, pieces of a single point too (the eigenvalue 0), and no value
 * is below 0; its factor is always direct. GNP_NO_CONVERGENCE, GNP_TOO_LARGE. Deterministic for any worker count. On
 * failure *out is unchanged. task may be NULL; it is warned of eigenpairs that are not to be believed
 * (spectrum_check.h). */
gnp_status gnp_spectrum_run(const struct gnp_cloud *cloud, const struct gnp_poisson_options *options,
                            const struct gnp_spectrum_wanted *wanted, struct gnp_pool *pool, struct gnp_task *task,
                            struct gnp_spectrum *out, struct gnp_error *error);
void gnp_spectrum_clear(struct gnp_spectrum *spectrum);

/* Bytes that finding them takes beside the operator and its solver; of the basis, most of it, only what iterations
 * reach is touched. */
size_t gnp_spectrum_memory(size_t points, size_t count, int system);

#endif
