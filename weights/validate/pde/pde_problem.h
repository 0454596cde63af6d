/* A shape's cloud in one regime, known solutions of the PDE on it, and what an estimator with a system makes of
 * them. */
#ifndef GNP_WEIGHTS_PDE_PROBLEM_H
#define GNP_WEIGHTS_PDE_PROBLEM_H

#include "core/base/pool.h"
#include "core/equations/poisson.h"
#include "core/model/models.h"
#include "core/shapes/shapes.h"
#include "weights/protocol/protocol.h"

enum { GNP_PDE_SHAPES = 4, GNP_PDE_ESTIMATORS = 3, GNP_PDE_SYSTEMS = 2 };

/* The names in the table. */
const char *gnp_pde_shape(unsigned shape);
const char *gnp_pde_estimator(unsigned estimator);
const char *gnp_pde_system(unsigned system);

/* What one operator did for all solutions. */
struct gnp_pde_cell {
	double error;   /* relative L2 of u without its mean, averaged over the solutions; NAN: not run */
	double prepare, solve; /* seconds: of the operator, of a right-hand side */
};

struct gnp_pde_problem {
	struct gnp_sample sample;
	size_t solutions;
	double *value, *source, *found; /* (points, solutions) */
};

/* Freed by gnp_pde_problem_clear, also when it fails. */
gnp_status gnp_pde_problem_make(unsigned shape_index, enum gnp_regime regime, size_t points, size_t solutions,
                                struct gnp_pool *pool, struct gnp_task *task, struct gnp_pde_problem *out,
                                struct gnp_error *error);
void gnp_pde_problem_clear(struct gnp_pde_problem *problem);

/* How a problem of the regime is solved; options borrow filter. */
gnp_status gnp_pde_problem_options(const struct gnp_models *models, enum gnp_regime regime, unsigned estimator,
                                   unsigned system, struct gnp_poisson_options *options,
                                   struct gnp_filter_options *filter, struct gnp_error *error);

/* Solves for all solutions and fills the cell. */
gnp_status gnp_pde_problem_solve(struct gnp_pde_problem *problem, enum gnp_regime regime, unsigned estimator,
                                 unsigned system, const struct gnp_models *models, struct gnp_pool *pool,
                                 struct gnp_task *task, struct gnp_pde_cell *cell, struct gnp_error *error);

/* The error that noise along the surface alone leaves: geometry is exact, sources are not where they belong. */
gnp_status gnp_pde_problem_solve_along(struct gnp_pde_problem *problem, const struct gnp_models *models,
                                       struct gnp_pool *pool, struct gnp_task *task, double *out,
                                       struct gnp_error *error);

#endif
