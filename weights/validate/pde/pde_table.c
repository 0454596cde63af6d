#include "weights/validate/pde/pde_table.h"

#include <math.h>

#include "weights/validate/pde/pde_condition.h"

static const size_t sizes[GNP_PDE_SIZES] = {5000, 10000, 20000, 50000, 100000, 200000};

/* As printed: the cow's column belongs to no shape of ours. */
static const double printed[GNP_REGIMES][2][GNP_PDE_SHAPES] = {
	[GNP_REGIME_CLEAN_30] = {{7.97e-02, 9.55e-03, 8.23e-02, 7.11e-02}, {8.03e-02, 9.88e-03, 7.33e-02, 7.27e-02}},
	[GNP_REGIME_CLEAN_50] = {{8.49e-02, 1.26e-02, 3.86e-02, 9.93e-02}, {1.01e-01, 1.39e-02, 2.94e-02, 6.63e-02}},
	[GNP_REGIME_OUTLIER_50] = {{9.30e-02, 1.72e-02, 6.94e-02, 1.08e-01}, {9.12e-02, 1.74e-02, 4.98e-02, 9.20e-02}},
	[GNP_REGIME_NOISE_70] = {{9.95e-02, 2.02e-02, 5.52e-02, 1.02e-01}, {1.59e-01, 6.09e-02, 1.22e-01, 9.99e-01}},
};

double gnp_pde_printed(unsigned shape, enum gnp_regime regime, unsigned estimator)
{
	return estimator < 2 ? printed[regime][estimator][shape] : NAN;
}

struct gnp_pde_plan gnp_pde_plan_full(void)
{
	return (struct gnp_pde_plan){100000, 10, (1u << GNP_REGIMES) - 1, 200000};
}

struct gnp_pde_plan gnp_pde_plan_quick(void)
{
	return (struct gnp_pde_plan){20000, 2, (1u << GNP_REGIMES) - 1, 20000};
}

static gnp_status fill_regime(const struct gnp_pde_plan *plan, unsigned shape, enum gnp_regime regime,
                              const struct gnp_models *models, struct gnp_pool *pool, struct gnp_task *task, FILE *log,
                              struct gnp_pde_table *table, struct gnp_error *error)
{
	struct gnp_pde_problem problem;
	gnp_status status = gnp_pde_problem_make(shape, regime, plan->points, plan->solutions, pool, task, &problem, error);
	for (unsigned e = 0; e < GNP_PDE_ESTIMATORS; e++)
		for (unsigned s = 0; s < GNP_PDE_SYSTEMS && status == GNP_OK; s++) {
			struct gnp_pde_cell *cell = &table->cell[shape][regime][e][s];
			status = gnp_pde_problem_solve(&problem, regime, e, s, models, pool, task, cell, error);
			if (log && status == GNP_OK)
				fprintf(log,
				        "%s %s %s %s: %.2e (%.1f s and %.3f s)\n", gnp_pde_shape(shape), gnp_regime_info(regime)->name, gnp_pde_estimator(e),
				        gnp_pde_system(s), cell->error, cell->prepare, cell->solve);
		}
	if (status == GNP_OK && regime == GNP_REGIME_NOISE_70)
		status = gnp_pde_problem_solve_along(&problem, models, pool, task, &table->along[shape], error);
	gnp_pde_problem_clear(&problem);
	return status;
}

static gnp_status fill_size(size_t points, size_t solutions, const struct gnp_models *models, struct gnp_pool *pool,
                            struct gnp_task *task, double *convergence, double *condition, struct gnp_error *error)
{
	struct gnp_pde_problem problem;
	struct gnp_pde_cell cell = {.error = NAN};
	struct gnp_poisson_options options;
	struct gnp_filter_options filter;
	gnp_status status = gnp_pde_problem_make(0, GNP_REGIME_CLEAN_50, points, solutions, pool, task, &problem, error);
	const struct gnp_cloud cloud = {problem.sample.count, problem.sample.points, problem.sample.normals};
	if (status == GNP_OK)
		status = gnp_pde_problem_solve(&problem, GNP_REGIME_CLEAN_50, 0, 0, models, pool, task, &cell, error);
	if (status == GNP_OK)
		status = gnp_pde_problem_options(models, GNP_REGIME_CLEAN_50, 0, 0, &options, &filter, error);
	if (status == GNP_OK)
		status = gnp_pde_condition(&cloud, &options, pool, task, condition, error);
	gnp_pde_problem_clear(&problem);
	*convergence = cell.error;
	return status;
}

static gnp_status fill_convergence(const struct gnp_pde_plan *plan, const struct gnp_models *models,
                                   struct gnp_pool *pool, struct gnp_task *task, struct gnp_pde_table *table,
                                   struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	for (size_t i = 0; i < GNP_PDE_SIZES && sizes[i] <= plan->sizes_most && status == GNP_OK; i++) {
		table->sizes[i] = sizes[i];
		status = fill_size(sizes[i], plan->solutions, models, pool, task, &table->convergence[i], &table->condition[i], error);
	}
	return status;
}

gnp_status gnp_pde_table_run(const struct gnp_pde_plan *plan, const struct gnp_models *models, struct gnp_pool *pool,
                             struct gnp_task *task, FILE *log, struct gnp_pde_table *out, struct gnp_error *error)
{
	struct gnp_pde_table table = {.points = plan->points, .solutions = plan->solutions};
	struct gnp_pde_cell *cells = &table.cell[0][0][0][0];
	gnp_status status = GNP_OK;
	for (size_t c = 0; c < sizeof table.cell / sizeof *cells; c++)
		cells[c].error = NAN;
	for (unsigned shape = 0; shape < GNP_PDE_SHAPES; shape++)
		table.along[shape] = NAN;
	for (unsigned shape = 0; shape < GNP_PDE_SHAPES; shape++)
		for (int regime = 0; regime < GNP_REGIMES && status == GNP_OK; regime++)
			if (plan->regimes >> regime & 1)
				status = fill_regime(plan, shape, (enum gnp_regime)regime, models, pool, task, log, &table, error);
	if (status == GNP_OK)
		status = fill_convergence(plan, models, pool, task, &table, error);
	if (status == GNP_OK)
		*out = table;
	return status;
}
