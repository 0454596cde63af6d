#include "core/equations/poisson.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/cells/volume.h"
#include "core/equations/energy.h"
#include "core/equations/equation_check.h"
#include "core/equations/interpolation.h"

static const double mean_explained = 1e-3; /* by discretisation, of the root mean square of f */

struct gnp_poisson {
	atomic_size_t references;
	struct gnp_domain domain;
	struct gnp_equation equation;
	struct gnp_solver *solver;
	struct gnp_collocation value; /* least squares: the fit's value at every point */
	struct gnp_csr outside;       /* (dropped, points) values at points the filter dropped from those at the others */
	double *response;   /* (unknowns) the solution for f = 1; NULL where nothing is free, and of least squares */
	double *weight;     /* (unknowns) of the mean */
	struct gnp_stiffness volumes; /* over all points: what energies are told by */
	struct gnp_krylov_options krylov;
};

struct gnp_poisson_options gnp_poisson_defaults(void)
{
	return (struct gnp_poisson_options){.laplacian = gnp_laplacian_defaults(), .solver = GNP_SOLVER_AUTO, .mean = GNP_MEAN_AREA,
	                                    .tolerance = 1e-8, .iterations = 500};
}

struct gnp_poisson *gnp_poisson_retain(struct gnp_poisson *poisson)
{
	atomic_fetch_add(&poisson->references, 1);
	return poisson;
}

void gnp_poisson_release(struct gnp_poisson *poisson)
{
	if (!poisson || atomic_fetch_sub(&poisson->references, 1) > 1)
		return;
	gnp_solver_free(poisson->solver);
	gnp_equation_clear(&poisson->equation);
	gnp_collocation_clear(&poisson->value);
	gnp_csr_clear(&poisson->outside);
	gnp_domain_clear(&poisson->domain);
	gnp_stiffness_clear(&poisson->volumes);
	free(poisson->response);
	free(poisson->weight);
	free(poisson);
}

const struct gnp_domain *gnp_poisson_domain(const struct gnp_poisson *poisson)
{
	return &poisson->domain;
}

const struct gnp_stiffness *gnp_poisson_volumes(const struct gnp_poisson *poisson)
{
	return &poisson->volumes;
}

struct gnp_poisson_info gnp_poisson_info(const struct gnp_poisson *poisson)
{
	const struct gnp_equation *equation = &poisson->equation;
	const struct gnp_domain *domain = &poisson->domain;
	struct gnp_csr value = gnp_collocation_view(&poisson->value, GNP_DERIVATIVE_VALUE);
	return (struct gnp_poisson_info){
		.points = domain->cloud_count, .unknowns = equation->unknowns, .components = equation->components.count,
		.isolated = equation->components.following, .dropped = domain->dropped, .reduced = equation->reduced, .open = domain->open,
		.bytes = sizeof *poisson + gnp_domain_bytes(domain) + gnp_equation_bytes(equation) + gnp_solver_bytes(poisson->solver) +
		         gnp_csr_bytes(&value) + gnp_csr_bytes(&poisson->outside) + gnp_stiffness_bytes(&poisson->volumes) +
		         2 * equation->unknowns * sizeof(double),
		.solver = gnp_solver_kind(poisson->solver), .normals_estimated = domain->normals_estimated, .patches = domain->patches,
		.degenerate = domain->degenerate, .outliers = domain->outliers, .model = domain->model};
}

static gnp_status check_options(const struct gnp_poisson_options *options, struct gnp_error *error)
{
	if (!(options->screening >= 0) || isinf(options->screening))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "screening: got %g, need a finite number >= 0", options->screening);
	if (options->solver < GNP_SOLVER_AUTO || options->solver > GNP_SOLVER_ITERATIVE)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "solver: got %d, need 0..%d", options->solver, GNP_SOLVER_ITERATIVE);
	if (options->mean < GNP_MEAN_AREA || options->mean > GNP_MEAN_PLAIN)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "mean: got %d, need 0..%d", options->mean, GNP_MEAN_PLAIN);
	if (!(options->tolerance >= 1e-14 && options->tolerance <= 0.1))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "tolerance: got %g, need 1e-14..0.1", options->tolerance);
	if (options->iterations < 1 || options->iterations > 10000)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "iterations: got %d, need 1..10000", options->iterations);
	return GNP_OK;
}

/* The fixed points in curve order; *given stays NULL when there are none. */
static gnp_status order_fixed(const struct gnp_domain *domain, const unsigned char *fixed, unsigned char **given, struct gnp_error *error)
{
	size_t count = domain->prepared.count, found = 0;
	if (!fixed)
		return GNP_OK;
	unsigned char *ordered = gnp_array_new(count, 1);
	if (!ordered)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "fixed: no memory for %zu points", count);
	for (size_t i = 0; i < count; i++)
		found += ordered[i] = fixed[domain->prepared.order[i]] != 0;
	if (found == 0) {
		free(ordered);
		return GNP_OK;
	}
	*given = ordered;
	return GNP_OK;
}

static gnp_status assemble_values(struct gnp_poisson *poisson, const struct gnp_laplacian_options *options, const unsigned char *given,
                                  struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error)
{
	struct gnp_laplacian_options wanted = *options;
	if (options->system != GNP_SYSTEM_LEAST_SQUARES)
		return GNP_OK;
	wanted.which = GNP_DERIVATIVE_BIT(GNP_DERIVATIVE_VALUE);
	return gnp_laplacian_assemble(&poisson->domain, &wanted, given, pool, task, &poisson->value, error);
}

static gnp_status weigh(struct gnp_poisson *poisson, int mean, struct gnp_error *error)
{
	const struct gnp_equation *equation = &poisson->equation;
	poisson->weight = gnp_array_new(equation->unknowns, sizeof *poisson->weight);
	if (!poisson->weight)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "mean: no memory for %zu unknowns", equation->unknowns);
	for (size_t c = 0; c < equation->unknowns; c++)
		poisson->weight[c] = mean == GNP_MEAN_AREA ? poisson->domain.area[equation->kept[c]] : 1;
	return GNP_OK;
}

static size_t part_of(const struct gnp_equation *equation, size_t c)
{
	uint32_t label = equation->components.label[c];
	return equation->components.count == 1 ? 0 : label == GNP_COMPONENT_NONE ? equation->components.count : label;
}

/* The solution for 1 in every part that stands alone: by it the constant that makes f consistent follows from the pinned solution. */
static gnp_status respond(struct gnp_poisson *poisson, struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error)
{
	const struct gnp_equation *equation = &poisson->equation;
	size_t n = equation->unknowns;
	struct gnp_krylov_report report;
	if (equation->components.count == 0 || equation->system == GNP_SYSTEM_LEAST_SQUARES)
		return GNP_OK;
	double *ones = gnp_array_new(n, sizeof *ones);
	poisson->response = gnp_array_new(n, sizeof *poisson->response);
	gnp_status status = GNP_OK;
	if (!ones || !poisson->response)
		status = gnp_error_set(error, GNP_OUT_OF_MEMORY, "solve: no memory for %zu unknowns", n);
	for (size_t c = 0; ones && c < n; c++)
		ones[c] = part_of(equation, c) < equation->components.count;
	gnp_task_stage(task, GNP_STAGE_SOLVE, 0);
	if (status == GNP_OK)
		status = gnp_solver_apply(poisson->solver, ones, 1, &poisson->krylov, pool, task, poisson->response, &report, error);
	free(ones);
	return status;
}

/* Solves for random right-hand sides, nothing given but zeros. Iterations, which take longer than preparing does, have one and stop early; where they
 * do not converge, whoever asks for a solution is told. */
static gnp_status check_operator(struct gnp_poisson *poisson, struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error)
{
	enum { SIDES = 4, ITERATIONS = 50 };
	bool direct = gnp_solver_kind(poisson->solver) == GNP_SOLVER_DIRECT;
	size_t sides = direct ? SIDES : 1, entries = poisson->domain.cloud_count * sides;
	const struct gnp_krylov_options wanted = poisson->krylov;
	struct gnp_poisson_report reports[SIDES] = {{.energy = 1}};
	double energy[SIDES], *source = gnp_array_new(entries, 3 * sizeof *source);
	if (!source)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "operator: no memory for %zu numbers", 3 * entries);
	gnp_equation_check_draw(entries, source);
	memset(source + entries, 0, entries * sizeof *source);
	poisson->krylov = (struct gnp_krylov_options){.tolerance = fmax(wanted.tolerance, 1e-3), .iterations = ITERATIONS};
	struct gnp_error own = {0};
	gnp_status status = gnp_poisson_solve(poisson, source, source + entries, sides, pool, task, source + 2 * entries, reports, &own);
	poisson->krylov = wanted;
	free(source);
	for (size_t r = 0; r < sides; r++)
		energy[r] = reports[r].energy;
	if (status == GNP_OK)
		gnp_equation_check_operator(energy, sides, &poisson->domain, gnp_task_warnings(task));
	return status == GNP_OK || (status == GNP_NO_CONVERGENCE && !direct) ? GNP_OK : gnp_error_set(error, status, "%s", own.text);
}

/* Beyond this the Laplacian is lost in alpha's rounding, and squares of products overflow. */
static gnp_status check_screening(const struct gnp_domain *domain, double alpha, struct gnp_error *error)
{
	static const double most = 1e12;
	double area = 0;
	for (size_t i = 0; i < domain->prepared.count; i++)
		area += domain->area[i] / (double)domain->prepared.count;
	if (alpha * area <= most)
		return GNP_OK;
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "screening: got %g (of heat: one over dt), need at most %g, %g over the area of %g that a point "
	                                                  "stands for", alpha, most / area, most, area);
}

static gnp_status make(struct gnp_poisson *poisson, const struct gnp_cloud *cloud, const struct gnp_poisson_options *options,
                       struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error)
{
	unsigned char *given = NULL;
	gnp_status status = gnp_domain_make(cloud, &options->laplacian.domain, pool, task, &poisson->domain, error);
	if (status == GNP_OK)
		status = gnp_domain_check_distinct(&poisson->domain, error);
	if (status == GNP_OK)
		status = check_screening(&poisson->domain, options->screening, error);
	if (status == GNP_OK)
		status = order_fixed(&poisson->domain, options->fixed, &given, error);
	if (status == GNP_OK)
		status = gnp_equation_make(&poisson->domain, &options->laplacian, options->screening, given, pool, task, &poisson->equation, error);
	if (status == GNP_OK)
		status = assemble_values(poisson, &options->laplacian, given, pool, task, error);
	free(given);
	if (status == GNP_OK && poisson->domain.dropped)
		status = gnp_interpolation_make(&poisson->domain.prepared, poisson->domain.dropped_points, poisson->domain.dropped,
		                                gnp_laplacian_degree(&options->laplacian), pool, task, &poisson->outside, error);
	if (status == GNP_OK)
		status = weigh(poisson, options->mean, error);
	if (status == GNP_OK)
		status = gnp_volume_stiffness(&poisson->domain.prepared, pool, task, &poisson->volumes, error);
	if (status == GNP_OK)
		status = gnp_solver_create(&poisson->equation, &poisson->domain, options->solver, options->memory_limit, pool, task,
		                           &poisson->solver, error);
	if (status == GNP_OK)
		status = respond(poisson, pool, task, error);
	if (status == GNP_OK) {
		gnp_equation_check_crossings(&poisson->domain.prepared, &poisson->volumes, gnp_task_warnings(task));
		status = check_operator(poisson, pool, task, error);
	}
	gnp_task_stage(task, GNP_STAGE_DONE, 0);
	return status;
}

gnp_status gnp_poisson_prepare(const struct gnp_cloud *cloud, const struct gnp_poisson_options *options, struct gnp_pool *pool,
                               struct gnp_task *task, struct gnp_poisson **out, struct gnp_error *error)
{
	gnp_status status = check_options(options, error);
	if (status != GNP_OK)
		return status;
	struct gnp_poisson *poisson = gnp_array_zero(1, sizeof *poisson);
	if (!poisson)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "poisson: no memory");
	poisson->references = 1;
	poisson->krylov = (struct gnp_krylov_options){.tolerance = options->tolerance, .iterations = (size_t)options->iterations};
	status = make(poisson, cloud, options, pool, task, error);
	if (status == GNP_OK)
		*out = poisson;
	else
		gnp_poisson_release(poisson);
	return status;
}

/* One right-hand side on its way: b (rows), x (unknowns). */
struct side {
	const struct gnp_poisson *poisson;
	double *b, *x;
	double *constant, *weight; /* (components + 1) of each part; of the last nothing is read */
};

/* What each part's constant must be for u to have no pin's pull, and takes it off. */
static void remove_inconsistency(struct side *side, struct gnp_poisson_report *report)
{
	const struct gnp_poisson *poisson = side->poisson;
	const struct gnp_equation *equation = &poisson->equation;
	size_t parts = equation->components.count;
	double square = 0;
	side->constant[parts] = 0;
	for (size_t k = 0; k < parts; k++) {
		uint32_t anchor = equation->components.anchor[k];
		side->constant[k] = side->x[anchor] / poisson->response[anchor];
		report->mean = fabs(side->constant[k]) > fabs(report->mean) ? side->constant[k] : report->mean;
	}
	for (size_t i = 0; i < equation->rows; i++)
		square += side->b[i] * side->b[i] / (double)equation->rows;
	for (size_t c = 0; c < equation->unknowns; c++) {
		double constant = side->constant[part_of(equation, c)];
		side->b[c] -= constant;
		side->x[c] -= constant * poisson->response[c];
	}
	report->mean_removed = fabs(report->mean) > mean_explained * sqrt(square);
}

/* Of the parts' means into constant. */
static void means_of(struct side *side)
{
	const struct gnp_equation *equation = &side->poisson->equation;
	size_t parts = equation->components.count;
	memset(side->constant, 0, (parts + 1) * sizeof *side->constant);
	memset(side->weight, 0, (parts + 1) * sizeof *side->weight);
	for (size_t c = 0; c < equation->unknowns; c++) {
		size_t part = part_of(equation, c);
		side->constant[part] += side->poisson->weight[c] * side->x[c];
		side->weight[part] += side->poisson->weight[c];
	}
	for (size_t k = 0; k < parts; k++)
		side->constant[k] /= side->weight[k];
	side->constant[parts] = 0;
}

/* Points between parts follow all of them: the system knows how, once each part's value at its anchor is asked for. */
static gnp_status solve_again(struct side *side, struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error)
{
	const struct gnp_equation *equation = &side->poisson->equation;
	struct gnp_krylov_report again;
	for (size_t k = 0; k < equation->components.count; k++)
		side->b[equation->components.anchor[k]] -= equation->pin[k] * side->constant[k];
	gnp_status status = gnp_solver_apply(side->poisson->solver, side->b, 1, &side->poisson->krylov, pool, task, side->x, &again, error);
	for (size_t k = 0; k < equation->components.count; k++)
		side->b[equation->components.anchor[k]] += equation->pin[k] * side->constant[k];
	return status;
}

static gnp_status settle_constants(struct side *side, struct gnp_pool *pool, struct gnp_task *task, struct gnp_poisson_report *report,
                                   struct gnp_error *error)
{
	const struct gnp_equation *equation = &side->poisson->equation;
	if (equation->components.count == 0)
		return GNP_OK;
	if (side->poisson->response)
		remove_inconsistency(side, report);
	means_of(side);
	if (side->poisson->response && equation->components.count > 1 && equation->components.following > 0)
		return solve_again(side, pool, task, error);
	for (size_t c = 0; c < equation->unknowns; c++)
		side->x[c] -= side->constant[part_of(equation, c)];
	return GNP_OK;
}

/* Of the equation itself, without pins and rows of given points. left (rows): spare. */
static gnp_status measure_misfit(const struct side *side, struct gnp_pool *pool, double *left, struct gnp_poisson_report *report,
                                 struct gnp_error *error)
{
	const struct gnp_equation *equation = &side->poisson->equation;
	double miss = 0, size = 0;
	gnp_status status = gnp_csr_multiply(&equation->matrix, side->x, left, pool, NULL, error);
	for (size_t k = 0; k < equation->components.count && side->poisson->response; k++)
		left[equation->components.anchor[k]] -= equation->pin[k] * side->x[equation->components.anchor[k]];
	for (size_t c = 0; equation->given && c < equation->unknowns; c++)
		if (equation->given[c])
			left[equation->kept[c]] = NAN;
	for (size_t i = 0; i < equation->rows && status == GNP_OK; i++) {
		if (isnan(left[i]))
			continue;
		miss += (left[i] - side->b[i]) * (left[i] - side->b[i]);
		size += side->b[i] * side->b[i];
	}
	report->misfit = size > 0 ? sqrt(miss / size) : sqrt(miss);
	return status;
}

static gnp_status write_dropped(const struct gnp_poisson *poisson, size_t column, size_t count, struct gnp_pool *pool,
                                const double *values, double *solution, struct gnp_error *error)
{
	size_t dropped = poisson->domain.dropped;
	double *there = dropped ? gnp_array_new(dropped, sizeof *there) : NULL;
	if (dropped == 0)
		return GNP_OK;
	gnp_status status = there ? gnp_csr_multiply(&poisson->outside, values, there, pool, NULL, error)
	                          : gnp_error_set(error, GNP_OUT_OF_MEMORY, "solve: no memory for %zu dropped points", dropped);
	for (size_t i = 0; i < dropped && status == GNP_OK; i++)
		solution[poisson->domain.dropped_index[i] * count + column] = there[i];
	free(there);
	return status;
}

static gnp_status write_solution(const struct side *side, size_t column, size_t count, struct gnp_pool *pool, double *values,
                                 double *solution, struct gnp_error *error)
{
	const struct gnp_poisson *poisson = side->poisson;
	const struct gnp_equation *equation = &poisson->equation;
	const uint32_t *order = poisson->domain.prepared.order;
	gnp_status status = GNP_OK;
	if (poisson->value.rows) {
		struct gnp_csr fit = gnp_collocation_view(&poisson->value, GNP_DERIVATIVE_VALUE);
		status = gnp_csr_multiply(&fit, side->x, values, pool, NULL, error);
	}
	for (size_t c = 0; c < equation->unknowns; c++)
		values[equation->kept[c]] = side->x[c];
	for (size_t i = 0; i < equation->rows; i++)
		solution[order[i] * count + column] = values[i];
	return status == GNP_OK ? write_dropped(poisson, column, count, pool, values, solution, error) : status;
}

/* b (count, rows) in curve order; rows of fixed points hold their values. */
static gnp_status read_sources(const struct gnp_poisson *poisson, const double *source, const double *values, size_t count, double *b,
                               struct gnp_error *error)
{
	const struct gnp_equation *equation = &poisson->equation;
	const uint32_t *order = poisson->domain.prepared.order;
	for (size_t i = 0; i < equation->rows; i++)
		for (size_t r = 0; r < count; r++)
			b[r * equation->rows + i] = source[order[i] * count + r];
	for (size_t c = 0; equation->given && c < equation->unknowns; c++)
		for (size_t r = 0; equation->given[c] && r < count; r++)
			b[r * equation->rows + equation->kept[c]] = values[order[equation->kept[c]] * count + r];
	for (size_t i = 0; i < equation->rows; i++)
		for (size_t r = 0; r < count; r++)
			if (!isfinite(b[r * equation->rows + i]))
				return gnp_error_set(error, GNP_INVALID_ARGUMENT, "source: value %zu of point %u is %g", r, order[i],
				                     b[r * equation->rows + i]);
	return GNP_OK;
}

/* The power of two that brings the largest of a side's numbers to 0.5..1. Squares of what is divided by it neither overflow nor vanish, and
 * dividing changes no digit. */
static int exponent_of(const double *b, size_t rows)
{
	double most = 0;
	int exponent = 0;
	for (size_t i = 0; i < rows; i++)
		most = fmax(most, fabs(b[i]));
	frexp(most, &exponent);
	return exponent;
}

static void multiply_by_power(double *values, size_t count, size_t stride, int exponent)
{
	for (size_t i = 0; i < count; i++)
		values[i * stride] = ldexp(values[i * stride], exponent);
}

/* A side's solution and report in the units of its source. */
static gnp_status take_power_back(const struct gnp_poisson *poisson, size_t column, size_t count, int exponent, double *solution,
                                  struct gnp_poisson_report *report, struct gnp_error *error)
{
	size_t points = poisson->domain.cloud_count;
	report->mean = ldexp(report->mean, exponent);
	multiply_by_power(solution + column, points, count, exponent);
	for (size_t i = 0; i < points; i++)
		if (!isfinite(solution[i * count + column]))
			return gnp_error_set(error, GNP_NO_CONVERGENCE, "solution: value %zu of point %zu is %g: the numbers of the source or the points are "
			                                                "too large or too small for their unit", column, i, solution[i * count + column]);
	return GNP_OK;
}

/* values (rows): the solution, at given points what is given. */
static double energy_of(const struct side *side, const double *values)
{
	const struct gnp_poisson *poisson = side->poisson;
	const struct gnp_equation *equation = &poisson->equation;
	for (size_t c = 0; equation->given && c < equation->unknowns; c++)
		if (equation->given[c] && side->b[equation->kept[c]] != 0)
			return NAN;
	return gnp_energy_quotient(&poisson->volumes, poisson->domain.area, values, side->b, equation->alpha, equation->given != NULL);
}

static gnp_status finish_sides(const struct gnp_poisson *poisson, double *b, double *x, size_t count, const int *exponent,
                               struct gnp_pool *pool, struct gnp_task *task, const struct gnp_krylov_report *solved, double *solution,
                               struct gnp_poisson_report *reports, struct gnp_error *error)
{
	const struct gnp_equation *equation = &poisson->equation;
	size_t parts = equation->components.count + 1;
	double *spare = gnp_array_new(equation->rows + 2 * parts, sizeof *spare);
	gnp_status status = spare ? GNP_OK : gnp_error_set(error, GNP_OUT_OF_MEMORY, "solve: no memory for %zu rows", equation->rows);
	for (size_t r = 0; r < count && status == GNP_OK; r++) {
		struct gnp_poisson_report report = {.residual = solved[r].residual, .iterations = solved[r].iterations};
		struct side side = {poisson, b + r * equation->rows, x + r * equation->unknowns, spare + equation->rows,
		                    spare + equation->rows + parts};
		status = settle_constants(&side, pool, task, &report, error);
		if (status == GNP_OK)
			status = measure_misfit(&side, pool, spare, &report, error);
		if (status == GNP_OK)
			status = write_solution(&side, r, count, pool, spare, solution, error);
		if (status == GNP_OK)
			report.energy = energy_of(&side, spare);
		if (status == GNP_OK)
			status = take_power_back(poisson, r, count, exponent[r], solution, &report, error);
		if (status == GNP_OK && reports)
			reports[r] = report;
	}
	free(spare);
	return status;
}

gnp_status gnp_poisson_solve(const struct gnp_poisson *poisson, const double *source, const double *values, size_t count,
                             struct gnp_pool *pool, struct gnp_task *task, double *solution, struct gnp_poisson_report *reports,
                             struct gnp_error *error)
{
	const struct gnp_equation *equation = &poisson->equation;
	size_t entries;
	if (equation->given && !values)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "values: got none, need those of the fixed points");
	bool fits = gnp_size_multiply(equation->rows + equation->unknowns, count, &entries);
	double *b = fits ? gnp_array_new(entries, sizeof *b) : NULL, *x = b ? b + equation->rows * count : NULL;
	struct gnp_krylov_report *solved = gnp_array_new(count, sizeof *solved);
	int *exponent = gnp_array_new(count, sizeof *exponent);
	gnp_status status = b && solved && exponent ? read_sources(poisson, source, values, count, b, error)
	                                : gnp_error_set(error, GNP_OUT_OF_MEMORY, "solve: no memory for %zu right-hand sides", count);
	gnp_task_stage(task, GNP_STAGE_SOLVE, 0);
	for (size_t r = 0; r < count && status == GNP_OK; r++) {
		exponent[r] = exponent_of(b + r * equation->rows, equation->rows);
		multiply_by_power(b + r * equation->rows, equation->rows, 1, -exponent[r]);
	}
	if (status == GNP_OK)
		status = gnp_solver_apply(poisson->solver, b, count, &poisson->krylov, pool, task, x, solved, error);
	if (status == GNP_OK)
		status = finish_sides(poisson, b, x, count, exponent, pool, task, solved, solution, reports, error);
	gnp_task_stage(task, GNP_STAGE_DONE, 0);
	free(b);
	free(solved);
	free(exponent);
	return status;
}
