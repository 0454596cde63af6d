/* What the operations that solve equations on a cloud share: the parameters of the discretisation and the solver,
 * and the prepared operator that requests with the same cloud and parameters share. */
#ifndef GNP_PROTO_OPERATION_EQUATION_H
#define GNP_PROTO_OPERATION_EQUATION_H

#include "core/equations/poisson.h"
#include "proto/operation/operation_common.h"
#include "proto/operation/prepared_cache.h"

/* The first member of such an operation's options. */
struct gnp_equation_options {
	struct gnp_poisson_options core;
	char weights[GNP_MODEL_NAME_MAX + 1];
	bool filter; /* drop outliers and project noisy points first */
};

/* Words of choices, in the order of the enumerations. */
extern const char *const gnp_equation_systems[], *const gnp_equation_solvers[], *const gnp_equation_means[];

/* Rows of a table of parameters; type's member `equation` is the struct above. */
#define GNP_EQUATION_FILTER(type)                                               \
	{"filter", GNP_PARAMETER_BOOL, offsetof(type, equation.filter), 0, 0, NULL, \
	 "drop outliers and move noisy points onto the surface first (as the operation filter with project)"}

#define GNP_EQUATION_DISCRETISATION(type)                                                                              \
	GNP_EQUATION_FILTER(type),                                                                                         \
	{"function_degree", GNP_PARAMETER_INTEGER, offsetof(type, equation.core.laplacian.degree), 0, 7, NULL,             \
	 "of the polynomials that functions are fitted with, in both coordinates together; 0: 5 if square, 4 of "          \
	 "least squares"},                                                                                                 \
	{"stencil", GNP_PARAMETER_INTEGER, offsetof(type, equation.core.laplacian.neighbors), 0, 500, NULL,                \
	 "points of a stencil; 0: twice the polynomial's coefficients"},                                                   \
	GNP_COMMON_PARAMETERS(type, equation.core.laplacian.domain.estimate, equation.weights)

#define GNP_EQUATION_SYSTEM(type)                                                                                \
	{"system", GNP_PARAMETER_CHOICE, offsetof(type, equation.core.laplacian.system), 0, 0, gnp_equation_systems, \
	 "symmetric: finite elements, holds on any cloud, open edges are natural; square: collocation, far more accurate " \
	 "on closed and well-sampled surfaces; least_squares: all points collocate, a share of them without unknowns; "  \
	 "auto: square where it can be believed, else symmetric"},                                                        \
	{"drop", GNP_PARAMETER_NUMBER, offsetof(type, equation.core.laplacian.drop), 0, 0.5, NULL,                   \
	 "share of points without unknowns, by farthest points (least_squares)"}

#define GNP_EQUATION_SOLVER(type)                                                                                      \
	{"solver", GNP_PARAMETER_CHOICE, offsetof(type, equation.core.solver), 0, 0, gnp_equation_solvers,                 \
	 "direct: one factor, each further right-hand side in hundredths of a second; iterative: for millions of points; " \
	 "auto: by size"},                                                                                                 \
	{"tolerance", GNP_PARAMETER_NUMBER, offsetof(type, equation.core.tolerance), 1e-14, 0.1, NULL,                     \
	 "relative residual (iterative)"},                                                                                 \
	{"iterations", GNP_PARAMETER_INTEGER, offsetof(type, equation.core.iterations), 1, 10000, NULL, \
	 "at most (iterative)"}

/* What these operations share of their functions. The options of their calls begin with a struct
 * gnp_equation_options. */
void gnp_equation_defaults(struct gnp_equation_options *options);
gnp_status gnp_equation_resolve(void *options, const struct gnp_models *models, struct gnp_error *error);
/* That the cloud has the points that a domain and its stencils need, and that stencils have the points their
 * polynomials do. */
gnp_status gnp_equation_check(const struct gnp_call *call, struct gnp_error *error);
/* Columns of an input of the call; 0 when it is absent. */
size_t gnp_equation_sides(const struct gnp_call *call, const char *name);
/* Bytes to prepare an operator and solve for `sides` right-hand sides, with all that is made of their columns. */
size_t gnp_equation_memory(const struct gnp_call *call, const struct gnp_equation_options *options, size_t sides);
/* The same for distances, whose operators are triangles. */
size_t gnp_equation_distance_memory(const struct gnp_call *call, const struct gnp_equation_options *options);

/* The filter of the domain, where it is asked for; options' domain then borrows it. */
void gnp_equation_set_filter(struct gnp_equation_options *options, struct gnp_filter_options *filter);

/* A kind of prepared operator. */
struct gnp_equation_kind {
	const char *word; /* its name among others with the same cloud and options */
	gnp_status (*make)(const struct gnp_cloud *cloud, const struct gnp_poisson_options *options, struct gnp_pool *pool,
	                   struct gnp_task *task, void **object, size_t *bytes, struct gnp_error *error);
	struct gnp_prepared_kind prepared; /* {gnp_equation_make_prepared, what frees it} */
};
gnp_status gnp_equation_make_prepared(void *context, struct gnp_task *task, void **object, size_t *bytes,
                                      struct gnp_error *error);

/* An operator of the cloud from the cache of the call, or made; its key is the digest of all that it is made of.
 * options->core.fixed: mask or NULL. *found: it was there. */
gnp_status gnp_equation_get(const struct gnp_call *call, const struct gnp_equation_kind *kind,
                            const struct gnp_equation_options *options,
                            const struct gnp_common_cloud *cloud, struct gnp_pool *pool, struct gnp_task *task,
                            struct gnp_prepared_entry **entry, bool *found, struct gnp_error *error);

/* A struct gnp_poisson. */
extern const struct gnp_equation_kind gnp_equation_poisson;

/* That an input, where it is there, has columns, and as many as the input `other` (NULL: any number). */
gnp_status gnp_equation_check_columns(const struct gnp_call *call, const char *name, const char *other,
                                      struct gnp_error *error);
/* An input (n) or (n, r) of the request as numbers (n, *sides); NULL where it is absent. Freed by the caller. */
gnp_status gnp_equation_columns(const struct gnp_call *call, const char *name, double **values, size_t *sides,
                                struct gnp_error *error);

/* What is reported of a domain's surface. */
struct gnp_common_facts gnp_equation_facts(struct gnp_domain_facts surface);
/* gnp_common_report_end of it. Which way each component is oriented, no equation asks: there is no warning of that. */
gnp_status gnp_equation_report_end(struct gnp_domain_facts surface, const struct gnp_task *task,
                                   struct gnp_values *report, struct gnp_error *error);

/* What became of the operator: prepared (whether it was kept), solver, unknowns, components, ..., with the
 * estimator's choices. */
gnp_status gnp_equation_report(const struct gnp_poisson_info *info, bool found,
                               const struct gnp_equation_options *options,
                               struct gnp_values *report, struct gnp_error *error);

#endif
