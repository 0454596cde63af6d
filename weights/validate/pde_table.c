#include "weights/validate/pde_table.h"

#include <math.h>
#include <stdlib.h>

#include "core/base/memory.h"
#include "core/equations/poisson.h"
#include "weights/validate/pde_condition.h"
#include "weights/validate/pde_truth.h"

/* The last stands in for the paper's cow: features of many scales, made exactly. */
static const char *const shapes[GNP_PDE_SHAPES] = {"bumpy_torus", "genus3", "genus2", "radial"};
static const char *const titles[GNP_PDE_SHAPES] = {"bumpy torus", "genus 3", "genus 2", "radial, L = 22"};
static const char *const estimators[GNP_PDE_ESTIMATORS] = {"gnp", "gmls", "adaptive"};
static const char *const systems[GNP_PDE_SYSTEMS] = {"square", "least_squares"};
static const size_t sizes[GNP_PDE_SIZES] = {5000, 10000, 20000, 50000, 100000, 200000};
enum { RADIAL_DEGREE = 22 };

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

const char *gnp_pde_shape(unsigned shape)
{
	return titles[shape];
}

struct gnp_pde_plan gnp_pde_plan_full(void)
{
	return (struct gnp_pde_plan){100000, 10, (1u << GNP_REGIMES) - 1, 200000};
}

struct gnp_pde_plan gnp_pde_plan_quick(void)
{
	return (struct gnp_pde_plan){20000, 2, (1u << GNP_REGIMES) - 1, 20000};
}

/* ---- A cloud and its problems ---- */

struct problem {
	struct gnp_sample sample;
	size_t solutions;
	double *value, *source, *found; /* (points, solutions) */
};

static void problem_clear(struct problem *problem)
{
	gnp_sample_clear(&problem->sample);
	free(problem->value);
	free(problem->source);
	free(problem->found);
}

static gnp_status problem_make(unsigned which, enum gnp_regime regime, size_t points, size_t solutions, struct gnp_pool *pool,
                               struct gnp_task *task, struct problem *out, struct gnp_error *error)
{
	const struct gnp_regime_info *info = gnp_regime_info(regime);
	const struct gnp_sample_options options = {.count = points, .seed = GNP_SEED_VALIDATION + which, .noise = info->noise,
	                                           .outlier_fraction = info->outlier_fraction, .outlier_noise = info->outlier_noise};
	struct gnp_shape *shape = NULL;
	*out = (struct problem){.solutions = solutions};
	gnp_status status = gnp_shape_create(shapes[which], GNP_SEED_VALIDATION, RADIAL_DEGREE, &shape, error);
	if (status == GNP_OK)
		status = gnp_sample_create(shape, &options, pool, task, &out->sample, error);
	gnp_shape_free(shape);
	if (status != GNP_OK)
		return status;
	out->value = gnp_array_new(points, solutions * sizeof(double));
	out->source = gnp_array_new(points, solutions * sizeof(double));
	out->found = gnp_array_new(points, solutions * sizeof(double));
	if (!out->value || !out->source || !out->found)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "table: no memory for %zu solutions of %zu points", solutions, points);
	return gnp_pde_truth(&out->sample, GNP_SEED_VALIDATION, solutions, pool, task, out->value, out->source, error);
}

/* Over the points that were not displaced as outliers: u at a displaced one is not u at its foot. */
static double mean_error(const struct problem *problem)
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

/* ---- Cells ---- */

static gnp_status set_estimate(const struct gnp_models *models, enum gnp_regime regime, unsigned estimator, struct gnp_estimate_options *out,
                               struct gnp_error *error)
{
	const struct gnp_regime_info *info = gnp_regime_info(regime);
	static const enum gnp_estimator_kind kinds[] = {GNP_ESTIMATOR_GNP, GNP_ESTIMATOR_GMLS, GNP_ESTIMATOR_ADAPTIVE};
	*out = gnp_estimate_defaults();
	out->estimator = kinds[estimator];
	out->k = info->k;
	out->models = models;
	return estimator == 0 ? gnp_models_find(models, info->weights, &out->model, error) : GNP_OK;
}

/* The paper filters by its operator in either case; so do we. */
static gnp_status set_filter(const struct gnp_models *models, enum gnp_regime regime, struct gnp_filter_options *out, struct gnp_error *error)
{
	*out = gnp_filter_defaults();
	out->project = true;
	return set_estimate(models, regime, 0, &out->estimate, error);
}

static gnp_status set_options(const struct gnp_models *models, enum gnp_regime regime, unsigned estimator, unsigned system,
                              struct gnp_poisson_options *options, struct gnp_filter_options *filter, struct gnp_error *error)
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

static gnp_status fill_cell(struct problem *problem, enum gnp_regime regime, unsigned estimator, unsigned system, const struct gnp_models *models,
                            struct gnp_pool *pool, struct gnp_task *task, struct gnp_pde_cell *cell, struct gnp_error *error)
{
	struct gnp_poisson_options options;
	struct gnp_filter_options filter;
	struct gnp_poisson *poisson = NULL;
	const struct gnp_cloud cloud = {problem->sample.count, problem->sample.points, problem->sample.normals};
	gnp_status status = set_options(models, regime, estimator, system, &options, &filter, error);
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

/* What is left of the noise when the geometry is exact: each point moves along the surface as it did, by its second fundamental form to
 * third order, and not across it. Sources stay with their points, so that they are off by this much too: no solver knows better. */
static void keep_on_surface(const struct gnp_sample *sample, double *points)
{
	for (size_t i = 0; i < sample->count; i++) {
		const double *at = sample->points + 3 * i, *foot = sample->exact + 3 * i, *n = sample->normals + 3 * i, *form = sample->second_form + 9 * i;
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

static gnp_status fill_along(struct problem *problem, const struct gnp_models *models, struct gnp_pool *pool, struct gnp_task *task, double *out,
                             struct gnp_error *error)
{
	struct gnp_pde_cell cell = {.error = NAN};
	double *noisy = problem->sample.points, *moved = gnp_array_new(problem->sample.count, 3 * sizeof *moved);
	if (!moved)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "table: no memory for %zu points", problem->sample.count);
	keep_on_surface(&problem->sample, moved);
	problem->sample.points = moved;
	gnp_status status = fill_cell(problem, GNP_REGIME_CLEAN_50, 0, 0, models, pool, task, &cell, error);
	problem->sample.points = noisy;
	free(moved);
	*out = cell.error;
	return status;
}

static gnp_status fill_regime(const struct gnp_pde_plan *plan, unsigned shape, enum gnp_regime regime, const struct gnp_models *models,
                              struct gnp_pool *pool, struct gnp_task *task, FILE *log, struct gnp_pde_table *table, struct gnp_error *error)
{
	struct problem problem;
	gnp_status status = problem_make(shape, regime, plan->points, plan->solutions, pool, task, &problem, error);
	for (unsigned e = 0; e < GNP_PDE_ESTIMATORS; e++)
		for (unsigned s = 0; s < GNP_PDE_SYSTEMS && status == GNP_OK; s++) {
			struct gnp_pde_cell *cell = &table->cell[shape][regime][e][s];
			status = fill_cell(&problem, regime, e, s, models, pool, task, cell, error);
			if (log && status == GNP_OK)
				fprintf(log, "%s %s %s %s: %.2e (%.1f s and %.3f s)\n", titles[shape], gnp_regime_info(regime)->name, estimators[e],
				        systems[s], cell->error, cell->prepare, cell->solve);
		}
	if (status == GNP_OK && regime == GNP_REGIME_NOISE_70)
		status = fill_along(&problem, models, pool, task, &table->along[shape], error);
	problem_clear(&problem);
	return status;
}

static gnp_status fill_size(size_t points, size_t solutions, const struct gnp_models *models, struct gnp_pool *pool, struct gnp_task *task,
                            double *convergence, double *condition, struct gnp_error *error)
{
	struct problem problem;
	struct gnp_pde_cell cell = {.error = NAN};
	struct gnp_poisson_options options;
	struct gnp_filter_options filter;
	gnp_status status = problem_make(0, GNP_REGIME_CLEAN_50, points, solutions, pool, task, &problem, error);
	const struct gnp_cloud cloud = {problem.sample.count, problem.sample.points, problem.sample.normals};
	if (status == GNP_OK)
		status = fill_cell(&problem, GNP_REGIME_CLEAN_50, 0, 0, models, pool, task, &cell, error);
	if (status == GNP_OK)
		status = set_options(models, GNP_REGIME_CLEAN_50, 0, 0, &options, &filter, error);
	if (status == GNP_OK)
		status = gnp_pde_condition(&cloud, &options, pool, task, condition, error);
	problem_clear(&problem);
	*convergence = cell.error;
	return status;
}

static gnp_status fill_convergence(const struct gnp_pde_plan *plan, const struct gnp_models *models, struct gnp_pool *pool, struct gnp_task *task,
                                   struct gnp_pde_table *table, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	for (size_t i = 0; i < GNP_PDE_SIZES && sizes[i] <= plan->sizes_most && status == GNP_OK; i++) {
		table->sizes[i] = sizes[i];
		status = fill_size(sizes[i], plan->solutions, models, pool, task, &table->convergence[i], &table->condition[i], error);
	}
	return status;
}

gnp_status gnp_pde_table_run(const struct gnp_pde_plan *plan, const struct gnp_models *models, struct gnp_pool *pool, struct gnp_task *task,
                             FILE *log, struct gnp_pde_table *out, struct gnp_error *error)
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

/* ---- Writing ---- */

/* Rows as text with columns, or as Markdown with bars. */
struct style {
	const char *begin, *between, *end;
};

static void write_number(double error, FILE *out)
{
	if (isnan(error))
		fprintf(out, "%8s", "-");
	else
		fprintf(out, "%8.2e", error);
}

static void write_row(const struct gnp_pde_table *table, enum gnp_regime regime, unsigned e, unsigned s, const struct style *style, FILE *out)
{
	double prepare = 0, solve = 0;
	fprintf(out, "%s%-10s%s%-8s%s%-13s", style->begin, gnp_regime_info(regime)->name, style->between, estimators[e], style->between, systems[s]);
	for (unsigned shape = 0; shape < GNP_PDE_SHAPES; shape++) {
		const struct gnp_pde_cell *cell = &table->cell[shape][regime][e][s];
		fprintf(out, "%s", style->between);
		write_number(cell->error, out);
		prepare += cell->prepare / GNP_PDE_SHAPES;
		solve += cell->solve / GNP_PDE_SHAPES;
	}
	fprintf(out, "%s%7.1f%s%7.3f%s\n", style->between, prepare, style->between, solve, style->end);
}

static void write_printed(enum gnp_regime regime, unsigned e, const struct style *style, FILE *out)
{
	fprintf(out, "%s%-10s%s%-8s%s%-13s", style->begin, gnp_regime_info(regime)->name, style->between, estimators[e], style->between, "the paper's");
	for (unsigned shape = 0; shape < GNP_PDE_SHAPES; shape++) {
		fprintf(out, "%s", style->between);
		write_number(gnp_pde_printed(shape, regime, e), out);
	}
	fprintf(out, "%s%7s%s%7s%s\n", style->between, "", style->between, "", style->end);
}

static void write_along(const struct gnp_pde_table *table, const struct style *style, FILE *out)
{
	fprintf(out, "%s%-10s%s%-8s%s%-13s", style->begin, "noise-70", style->between, "exact", style->between, "square");
	for (unsigned shape = 0; shape < GNP_PDE_SHAPES; shape++) {
		fprintf(out, "%s", style->between);
		write_number(table->along[shape], out);
	}
	fprintf(out, "%s%7s%s%7s%s\n", style->between, "", style->between, "", style->end);
}

static void write_rows(const struct gnp_pde_table *table, const struct style *style, FILE *out)
{
	for (int regime = 0; regime < GNP_REGIMES; regime++) {
		for (unsigned e = 0; e < GNP_PDE_ESTIMATORS; e++)
			for (unsigned s = 0; s < GNP_PDE_SYSTEMS; s++)
				write_row(table, (enum gnp_regime)regime, e, s, style, out);
		if (regime == GNP_REGIME_NOISE_70)
			write_along(table, style, out);
		for (unsigned e = 0; e < 2; e++)
			write_printed((enum gnp_regime)regime, e, style, out);
	}
}

static void write_head(const struct style *style, FILE *out)
{
	fprintf(out, "%s%-10s%s%-8s%s%-13s", style->begin, "regime", style->between, "geometry", style->between, "system");
	for (unsigned shape = 0; shape < GNP_PDE_SHAPES; shape++)
		fprintf(out, "%s%8s", style->between, titles[shape]);
	fprintf(out, "%s%s%s%s%s\n", style->between, "prepare", style->between, "a solve", style->end);
}

/* The order between a size and the one before, in the spacing, which falls with the root of the number of points. */
static void write_convergence(const struct gnp_pde_table *table, const struct style *style, FILE *out)
{
	for (size_t i = 0; i < GNP_PDE_SIZES && table->sizes[i]; i++) {
		fprintf(out, "%s%8zu%s%.2e%s", style->begin, table->sizes[i], style->between, table->convergence[i], style->between);
		if (i > 0)
			fprintf(out, "%5.1f", 2 * log(table->convergence[i - 1] / table->convergence[i]) / log((double)table->sizes[i] / (double)table->sizes[i - 1]));
		fprintf(out, "%s%.1e", style->between, table->condition[i]);
		fprintf(out, "%s\n", style->end);
	}
}

void gnp_pde_table_write_text(const struct gnp_pde_table *table, FILE *out)
{
	static const struct style plain = {"", "  ", ""};
	fprintf(out, "Laplace-Beltrami PDE, %zu points, %zu solutions: relative L2 error of u; seconds\n", table->points, table->solutions);
	write_head(&plain, out);
	write_rows(table, &plain, out);
	fprintf(out, "\nconvergence, bumpy torus, gnp, square: points, error, order in the spacing, condition\n");
	write_convergence(table, &plain, out);
}

void gnp_pde_table_write_markdown(const struct gnp_pde_table *table, FILE *out)
{
	static const struct style bars = {"| ", " | ", " |"};
	fprintf(out, "# The Laplace-Beltrami PDE: the paper's Table 2\n\n"
	             "Written by `make validate-pde`. Delta u = -f on %zu points, relative L2 error of u without its mean, averaged over %zu solutions u =\n"
	             "U restricted to the surface: U is a Fourier series of period 2 with all modes up to %d in each direction and coefficients\n"
	             "N(0, 1) / |m|^2, so that f, which follows exactly, has the flat spectrum the paper draws f with. The first three shapes are exact\n"
	             "stand-ins for the paper's meshes, the radial manifold stands in for its cow, so that its figures beside ours are of other shapes:\n"
	             "orders of magnitude compare, digits do not. Under outliers and noise points are filtered and projected by `gnp` first, as in the\n"
	             "paper; f stays with its point wherever that is moved. `geometry` says whose normals; functions are fitted with degree 5, of\n"
	             "least squares 4. Seconds are means over the shapes.\n\n"
	             "`exact` under noise is what cannot be helped: the points are moved along the exact surface as the noise moved them, and not\n"
	             "across it, so that only f and u are not where they belong.\n\n",
	        table->points, table->solutions, GNP_PDE_MODES);
	write_head(&bars, out);
	fprintf(out, "| --- | --- | --- | ---: | ---: | ---: | ---: | ---: | ---: |\n");
	write_rows(table, &bars, out);
	fprintf(out, "\n## Convergence\nBumpy torus, clean, `gnp`, square; the order is in the spacing; the condition is the largest |eigenvalue| over\nthe smallest but zero.\n\n| points | error | order | condition |\n| ---: | ---: | ---: | ---: |\n");
	write_convergence(table, &bars, out);
}
