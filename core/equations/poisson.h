/* Poisson equations on a cloud: alpha u - Delta u = f; with alpha = 0 Delta u = -f, u of zero mean.
 *
 * What is the same for every right-hand side (geometry, assembly, factor) is made once and kept in an opaque,
 * immutable, reference-counted object; threads may solve with one at the same time. */
#ifndef GNP_CORE_POISSON_H
#define GNP_CORE_POISSON_H

#include "core/cells/diffusion.h"
#include "core/equations/solver.h"
#include "core/operators/laplacian.h"

/* Which mean is zero: that of the surface, points weighing by their area, or that of the list of points. */
enum gnp_mean { GNP_MEAN_AREA, GNP_MEAN_PLAIN };

struct gnp_poisson_options {
	struct gnp_laplacian_options laplacian; /* domain, system, drop, degree, neighbors; which is ignored */
	double screening;           /* alpha [1 / length^2]; below 0 -alpha may be no eigenvalue */
	const unsigned char *fixed; /* (n) 1 where u is given with each right-hand side (Dirichlet); NULL: nowhere. Read while preparing alone */
	int solver;                 /* enum gnp_solver_kind */
	size_t memory_limit;        /* of the factor while it is made [bytes]; 0: none */
	int mean;                   /* enum gnp_mean */
	double tolerance;           /* relative residual of iterative solutions; 1e-14..0.1 */
	int iterations;             /* of them, at most; 1..10000 */
};

/* As gnp_laplacian_defaults; no screening, nothing fixed, solver auto without a limit, area mean, 1e-8 within 500
 * iterations. */
struct gnp_poisson_options gnp_poisson_defaults(void);

struct gnp_poisson; /* opaque */

/* The caller holds one reference. GNP_INVALID_ARGUMENT, GNP_DEGENERATE, GNP_SINGULAR, GNP_TOO_LARGE with the estimate
 * of the memory. Deterministic for any worker count. On failure *out is unchanged. task may be NULL; it is warned of an
 * operator that is not to be believed (operator_check.h). */
gnp_status gnp_poisson_prepare(const struct gnp_cloud *cloud, const struct gnp_poisson_options *options,
                               struct gnp_pool *pool, struct gnp_task *task, struct gnp_poisson **out,
                               struct gnp_error *error);
/* The same of a domain, which is taken over, also when it fails. */
gnp_status gnp_poisson_prepare_take(struct gnp_domain *domain, const struct gnp_poisson_options *options,
                                    struct gnp_pool *pool, struct gnp_task *task, struct gnp_poisson **out,
                                    struct gnp_error *error);
struct gnp_poisson *gnp_poisson_retain(struct gnp_poisson *poisson);
void gnp_poisson_release(struct gnp_poisson *poisson); /* frees with the last reference; NULL is allowed */

struct gnp_poisson_info {
	size_t points;     /* n of the cloud */
	size_t unknowns;
	size_t components; /* parts of the cloud that stand alone, each solved with a zero mean of its own; 0 where nothing is free */
	size_t isolated;   /* points in none of these, which follow from others */
	size_t dropped;    /* points the filter dropped: they get the value of the local fit */
	size_t reduced;    /* stencils of a lower degree for want of neighbours */
	size_t open;       /* points at open boundaries, where derivatives are one-sided */
	size_t bytes;      /* held by the object */
	int solver;        /* enum gnp_solver_kind: direct or iterative */
	int system;        /* enum gnp_system: as asked for, or chosen */
	const char *why;   /* it was chosen; NULL: it was asked for */
	int normals_estimated;
	size_t patches, degenerate, outliers;
	const struct gnp_model *model; /* as in struct gnp_estimate */
};
struct gnp_poisson_info gnp_poisson_info(const struct gnp_poisson *poisson);
const struct gnp_domain *gnp_poisson_domain(const struct gnp_poisson *poisson);
const struct gnp_stiffness *gnp_poisson_volumes(const struct gnp_poisson *poisson); /* over the domain's points */

/* Writes what values (n, count) say of fixed points into u (n, count), at all points of their places. */
void gnp_poisson_put_given(const struct gnp_poisson *poisson, const double *values, size_t count, double *u);

/* What became of one right-hand side. */
struct gnp_poisson_report {
	double residual;      /* relative: of the system, or of the normal equations of least squares */
	double misfit;        /* ||alpha u - Delta u - f|| / ||f|| over all points but fixed ones: of least squares no zero */
	double mean;          /* the constant taken off f, the largest over components */
	int mean_removed;     /* 1 where that is more than discretisation explains (1e-3 of f's root mean square): f had no zero mean */
	size_t iterations;    /* 1 or 2 (refined) when direct */
	double energy;        /* of u over what f explains (energy.h); NaN where values other than zero are given */
};

/* Solves for count right-hand sides f: source (n, count), solution (n, count) out, in the cloud's order; values (n,
 * count) are read where u is fixed, may be NULL when nothing is. reports (count) out, may be NULL. Points without an
 * unknown get the value of the local fit. GNP_INVALID_ARGUMENT for numbers that are not finite, GNP_NO_CONVERGENCE,
 * also where solutions are not. On failure solution is undefined. task may be NULL. */
gnp_status gnp_poisson_solve(const struct gnp_poisson *poisson, const double *source, const double *values,
                             size_t count, struct gnp_pool *pool, struct gnp_task *task, double *solution,
                             struct gnp_poisson_report *reports, struct gnp_error *error);

#endif
