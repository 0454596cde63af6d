#include "weights/validate/pde/pde_problem.h"

#include <math.h>
#include <stdlib.h>

#include "core/base/memory.h"
#include "core/base/vector.h"
#include "weights/validate/method.h"
#include "weights/validate/pde/pde_truth.h"

/* The last stands in for the paper's cow: features of many scales, made exactly. */
static const char *const shapes[GNP_PDE_SHAPES] = {"bumpy_torus", "genus3", "genus2", "radial"};
static const char *const titles[GNP_PDE_SHAPES] = {"bumpy torus", "genus 3", "genus 2", "radial, L = 22"};
static const char *const estimators[GNP_PDE_ESTIMATORS] = {"gnp", "gmls", "adaptive"};
static const char *const systems[GNP_PDE_SYSTEMS] = {"square", "least_squares"};
enum { RADIAL_DEGREE = 22 };

const char *gnp_pde_shape(unsigned shape)
{
	return titles[shape];
}

const char *gnp_pde_estimator(unsigned estimator)
{
	return estimators[estimator];
}

const char *gnp_pde_system(unsigned system)
{
	return systems[system];
}

void gnp_pde_problem_clear(struct gnp_pde_problem *problem)
{
	gnp_sample_clear(&problem->sample);
	free(problem->value);
	free(problem->source);
	free(problem->found);
}

gnp_status gnp_pde_problem_make(unsigned shape_index, enum gnp_regime regime, size_t points, size_t solutions,
                                struct gnp_pool *pool, struct gnp_task *task, struct gnp_pde_problem *out,
                                struct gnp_error *error)
{
	const struct gnp_regime_info *info = gnp_regime_info(regime);
	const struct gnp_sample_options options = {.count = points, .seed = GNP_SEED_VALIDATION + shape_index, .noise = info->noise,
	                                           .outlier_fraction = info->outlier_fraction, .outlier_noise = info->outlier_noise};
	struct gnp_shape *shape = NULL;
	*out = (struct gnp_pde_problem){.solutions = solutions};
	gnp_status status = gnp_shape_create(shapes[shape_index], GNP_SEED_VALIDATION, RADIAL_DEGREE, &shape, error);
	if (status == GNP_OK)
		status = gnp_sample_create(shape, &options, pool, task, &out->sample, error);
	gnp_shape_free(shape);
	if (status != GNP_OK)
		return status;
	out->value = gnp_array_new(points, solutions * sizeof(double));
	out->source = gnp_array_new(points, solutions * sizeof(double));
	out->found = gnp_array_new(points, solutions * sizeof(double));
	if (!out->value || !out->source || !out->found)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY,
		                     "table: no memory for %zu solutions of %zu points", solutions, points);
	return gnp_pde_truth(&out->sample, GNP_SEED_VALIDATION, solutions, pool, task, out->value, out->source, error);
}

/* Over the points that were not displaced as outliers: u at a displaced one is not u at its foot. */
static double mean_error(const struct gnp_pde_problem *problem)
{
	size_t n = problem->sample.count, columns = problem->solutions;
	double total = 0;
	for (size_t s = 0; s < columns; s++) {
		double sums[3] = {0}, error = 0, size = 0;
		for (size_t i = 0; i < n; i++) {
			bool judged = !problem->sample.outlier[i];
			sums[0] += judged;
			sums[1] += judged ? problem->found[i * columns + s] : 0;
			sums[2] += judged ? problem->value[i * columns + s] : 0;
		}
		for (size_t i = 0; i < n; i++) {
			double want = problem->value[i * columns + s] - sums[2] / sums[0], got = problem->found[i * columns + s] - sums[1] / sums[0];
			error += problem->sample.outlier[i] ? 0 : (got - want) * (got - want);
			size += problem->sample.outlier[i] ? 0 : want * want;
		}
		total += sqrt(error / size);
	}
	return total / (double)columns;
}

/* ---- Solving ---- */

static gnp_status set_estimate(const struct gnp_models *models, enum gnp_regime regime, unsigned estimator,
                               struct gnp_estimate_options *out, struct gnp_error *error)
{
	static const enum gnp_method methods[] = {GNP_METHOD_GNP, GNP_METHOD_GMLS, GNP_METHOD_ADAPTIVE};
	*out = gnp_estimate_defaults();
	out->estimator = gnp_method_info(methods[estimator])->estimator;
	out->k = gnp_regime_info(regime)->k;
	out->models = models;
	return gnp_method_model(methods[estimator], regime, models, &out->model, error);
}

/* The paper filters by its operator in either case; so do we. */
static gnp_status set_filter(const struct gnp_models *models, enum gnp_regime regime, struct gnp_filter_options *out,
                             struct gnp_error *error)
{
	*out = gnp_filter_defaults();
	out->project = true;
	return set_estimate(models, regime, 0, &out->estimate, error);
}

gnp_status gnp_pde_problem_options(const struct gnp_models *models, enum gnp_regime regime, unsigned estimator,
                                   unsigned system, struct gnp_poisson_options *options,
                                   struct gnp_filter_options *filter, struct gnp_error *error)
{
	struct gnp_domain_options *domain = &options->laplacian.domain;
	*options = gnp_poisson_defaults();
	options->laplacian.system = system == 0 ? GNP_SYSTEM_SQUARE : GNP_SYSTEM_LEAST_SQUARES;
	gnp_status status = set_estimate(models, regime, estimator, &domain->estimate, error);
	if (status == GNP_OK)
		status = set_filter(models, regime, filter, error);
	domain->project = regime == GNP_REGIME_OUTLIER_50 || regime == GNP_REGIME_NOISE_70;
	domain->filter = domain->project ? filter : NULL;
	return status;
}

gnp_status gnp_pde_problem_solve(struct gnp_pde_problem *problem, enum gnp_regime regime, unsigned estimator,
                                 unsigned system, const struct gnp_models *models, struct gnp_pool *pool,
                                 struct gnp_task *task, struct gnp_pde_cell *cell, struct gnp_error *error)
{
	struct gnp_poisson_options options;
	struct gnp_filter_options filter;
	struct gnp_poisson *poisson = NULL;
	const struct gnp_cloud cloud = {problem->sample.count, problem->sample.points, problem->sample.normals};
	gnp_status status = gnp_pde_problem_options(models, regime, estimator, system, &options, &filter, error);
	double begun = gnp_clock();
	if (status == GNP_OK)
		status = gnp_poisson_prepare(&cloud, &options, pool, task, &poisson, error);
	cell->prepare = gnp_clock() - begun;
	begun = gnp_clock();
	if (status == GNP_OK)
		status = gnp_poisson_solve(poisson, problem->source, NULL, problem->solutions, pool, task, problem->found, NULL, error);
	cell->solve = (gnp_clock() - begun) / (double)problem->solutions;
	gnp_poisson_release(poisson);
	if (status == GNP_OK)
		cell->error = mean_error(problem);
	return status;
}

/* What is left of the noise when the geometry is exact: each point moves along the surface as it did, by its second
 * fundamental form to third order, and not across it. Sources stay with their points, so that they are off by this much
 * too: no solver knows better. */
static void keep_on_surface(const struct gnp_sample *sample, double *points)
{
	for (size_t i = 0; i < sample->count; i++) {
		const double *at = sample->points + 3 * i, *foot = sample->exact + 3 * i, *n = sample->normals + 3 * i,
					 *form = sample->second_form + 9 * i;
		double d[3] = {at[0] - foot[0], at[1] - foot[1], at[2] - foot[2]}, across = gnp_dot(d, n), height = 0;
		for (int c = 0; c < 3; c++)
			d[c] -= across * n[c];
		for (int a = 0; a < 3; a++)
			for (int b = 0; b < 3; b++)
				height += form[3 * a + b] * d[a] * d[b] / 2;
		for (int c = 0; c < 3; c++)
			points[3 * i + c] = foot[c] + d[c] + height * n[c];
	}
}

gnp_status gnp_pde_problem_solve_along(struct gnp_pde_problem *problem, const struct gnp_models *models,
                                       struct gnp_pool *pool, struct gnp_task *task, double *out,
                                       struct gnp_error *error)
{
	struct gnp_pde_cell cell = {.error = NAN};
	double *noisy = problem->sample.points, *moved = gnp_array_new(problem->sample.count, 3 * sizeof *moved);
	if (!moved)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "table: no memory for %zu points", problem->sample.count);
	keep_on_surface(&problem->sample, moved);
	problem->sample.points = moved;
	gnp_status status = gnp_pde_problem_solve(problem, GNP_REGIME_CLEAN_50, 0, 0, models, pool, task, &cell, error);
	problem->sample.points = noisy;
	free(moved);
	*out = cell.error;
	return status;
}
