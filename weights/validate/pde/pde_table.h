/* The paper's Table 2: errors of the solution of the Laplace-Beltrami PDE, by shape, regime, estimator and system. */
#ifndef GNP_WEIGHTS_PDE_TABLE_H
#define GNP_WEIGHTS_PDE_TABLE_H

#include <stdio.h>

#include "core/base/pool.h"
#include "core/model/models.h"
#include "weights/protocol/protocol.h"
#include "weights/validate/pde/pde_problem.h"

enum { GNP_PDE_SIZES = 6 };

struct gnp_pde_table {
	size_t points, solutions;
	double along[GNP_PDE_SHAPES]; /* error under noise that moves points along the exact surface alone; NAN: not run */
	struct gnp_pde_cell cell[GNP_PDE_SHAPES][GNP_REGIMES][GNP_PDE_ESTIMATORS][GNP_PDE_SYSTEMS];
	size_t sizes[GNP_PDE_SIZES];               /* of the convergence on the bumpy torus; 0: not run */
	double convergence[GNP_PDE_SIZES];         /* errors by gnp, square, clean */
	double condition[GNP_PDE_SIZES];           /* of their systems (pde_condition.h) */
};

struct gnp_pde_plan {
	size_t points;
	size_t solutions;
	unsigned regimes;     /* mask */
	size_t sizes_most;    /* largest cloud of the convergence */
};

/* 100,000 points, 10 solutions, all regimes, up to 200,000; quick: 20,000 points, 2 solutions, up to 20,000. */
struct gnp_pde_plan gnp_pde_plan_full(void);
struct gnp_pde_plan gnp_pde_plan_quick(void);

/* Fills the table. models: the folder's, with those of every regime for the estimator gnp. Lines of progress to `log`
 * (NULL: none). */
gnp_status gnp_pde_table_run(const struct gnp_pde_plan *plan, const struct gnp_models *models, struct gnp_pool *pool,
                             struct gnp_task *task, FILE *log, struct gnp_pde_table *out, struct gnp_error *error);

/* The error the paper prints; NAN where it prints none. estimator 0 gnp, 1 gmls. */
double gnp_pde_printed(unsigned shape, enum gnp_regime regime, unsigned estimator);
#endif
