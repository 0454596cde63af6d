/* Finds the lowest eigenpairs of -Delta on a cloud: block Arnoldi iteration (Saad 2011, chapter 6) with (sigma -
 * Delta)^-1, all of it on one factor. */
#ifndef GNP_CORE_SPECTRUM_H
#define GNP_CORE_SPECTRUM_H

#include "core/equations/poisson.h"

/* Owned; freed by gnp_spectrum_clear. */
struct gnp_spectrum {
	size_t points, count;
	double *value;     /* (count) ascending [1 / length^2]: 0 once for each component first */
	double *imaginary; /* (count) what the unsymmetric discretisation leaves beside it: a measure of its error */
	double *vector;    /* (count, points) in the cloud's order, unit length when points weigh by their area; points the filter dropped have the local fit's value */
	double *residual;  /* (count) ||(sigma - Delta)^-1 v - v / (value + sigma)|| (value + sigma) */
	size_t solves;
	int system;          /* enum gnp_system: as asked for, or chosen */
	const char *why;     /* it was chosen; NULL: it was asked for */
	struct gnp_domain_facts surface;
};

/* Whether a cloud of so many points has enough for the count lowest. */
gnp_status gnp_spectrum_check(size_t count, size_t points, struct gnp_error *error);

/* The `count` lowest (1..500, fewer than the points by far). options: as for gnp_poisson_prepare, screening ignored and
 * nothing fixed. tolerance: of the residuals; 1e-12..0.1. GNP_NO_CONVERGENCE. Deterministic for any worker count. On
 * failure *out is unchanged. task may be NULL; it is warned of eigenpairs that are not to be believed
 * (spectrum_check.h). */
gnp_status gnp_spectrum_run(const struct gnp_cloud *cloud, const struct gnp_poisson_options *options, size_t count,
                            double tolerance, struct gnp_pool *pool, struct gnp_task *task, struct gnp_spectrum *out,
                            struct gnp_error *error);
void gnp_spectrum_clear(struct gnp_spectrum *spectrum);

/* Bytes that finding them takes beside the operator and its solver; of the basis, most of it, only what iterations
 * reach is touched. */
size_t gnp_spectrum_memory(size_t points, size_t count);

#endif
