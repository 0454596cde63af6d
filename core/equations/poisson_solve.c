/* Solves a prepared equation (gnp_poisson_solve of poisson.h): right-hand sides in, solutions with a zero mean in every
 * part of the cloud, values at points without an unknown, and a report of how well each came out. */
#include "core/equations/poisson.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/equations/poisson_parts.h"
#include "core/operators/energy.h"

static const double mean_explained = 1e-3; /* by discretisation, of the root mean square of f */

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
		double constant = side->constant[gnp_equation_part(equation, c)];
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
		size_t part = gnp_equation_part(equation, c);
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

static gnp_status settle_constants(struct side *side, struct gnp_pool *pool, struct gnp_task *task,
                                   struct gnp_poisson_report *report, struct gnp_error *error)
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
		side->x[c] -= side->constant[gnp_equation_part(equation, c)];
	return GNP_OK;
}

/* Of the equation itself, without pins and rows of given points. left (rows): spare. */
static gnp_status measure_misfit(const struct side *side, struct gnp_pool *pool, double *left,
                                 struct gnp_poisson_report *report, struct gnp_error *error)
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

static gnp_status write_solution(const struct side *side, size_t column, size_t count, struct gnp_pool *pool,
                                 double *values, double *solution, struct gnp_error *error)
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
	if (status == GNP_OK)
		status = write_dropped(poisson, column, count, pool, values, solution, error);
	gnp_copies_spread(&poisson->domain.copies, solution, count, column);
	return status;
}

/* Where several points lie at one place, what is given at one of them is given there. b (rows): of column r. */
static gnp_status read_copies(const struct gnp_copies *copies, const double *values, size_t r, size_t count, double *b,
                              struct gnp_error *error)
{
	for (size_t k = 0; k < copies->count; k++) {
		const struct gnp_copy *copy = &copies->copy[k];
		double value = values[copy->index * count + r], first = values[copy->original * count + r];
		if (!copy->fixed || copy->row == GNP_COPY_OUTSIDE)
			continue;
		if (copy->original_fixed && value != first)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT,
			                     "values: got %g at point %u and %g at point %u, which lies at the same place", first,
			                     copy->original, value, copy->index);
		b[copy->row] = value;
	}
	return GNP_OK;
}

/* b (count, rows) in curve order; rows of fixed points hold their values. */
static gnp_status read_sources(const struct gnp_poisson *poisson, const double *source, const double *values,
                               size_t count, double *b, struct gnp_error *error)
{
	const struct gnp_equation *equation = &poisson->equation;
	const uint32_t *order = poisson->domain.prepared.order;
	const struct gnp_copies *copies = &poisson->domain.copies;
	gnp_status status = GNP_OK;
	for (size_t i = 0; i < equation->rows; i++)
		for (size_t r = 0; r < count; r++)
			b[r * equation->rows + i] = source[order[i] * count + r];
	for (size_t r = 0; r < count; r++)
		gnp_copies_average(copies, source, count, r, b + r * equation->rows);
	for (size_t c = 0; equation->given && c < equation->unknowns; c++)
		for (size_t r = 0; equation->given[c] && r < count; r++)
			b[r * equation->rows + equation->kept[c]] = values[order[equation->kept[c]] * count + r];
	for (size_t r = 0; r < count && equation->given && status == GNP_OK; r++)
		status = read_copies(copies, values, r, count, b + r * equation->rows, error);
	if (status != GNP_OK)
		return status;
	for (size_t i = 0; i < equation->rows; i++)
		for (size_t r = 0; r < count; r++)
			if (!isfinite(b[r * equation->rows + i]))
				return gnp_error_set(error, GNP_INVALID_ARGUMENT, "source: value %zu of point %u is %g", r, order[i],
				                     b[r * equation->rows + i]);
	return GNP_OK;
}

/* The power of two that brings the largest of a side's numbers to 0.5..1. Squares of what is divided by it neither
 * overflow nor vanish, and dividing changes no digit. */
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
static gnp_status take_power_back(const struct gnp_poisson *poisson, size_t column, size_t count, int exponent,
                                  double *solution, struct gnp_poisson_report *report, struct gnp_error *error)
{
	size_t points = poisson->domain.cloud_count;
	report->mean = ldexp(report->mean, exponent);
	multiply_by_power(solution + column, points, count, exponent);
	for (size_t i = 0; i < points; i++)
		if (!isfinite(solution[i * count + column]))
			return gnp_error_set(error, GNP_NO_CONVERGENCE,
			                     "solution: value %zu of point %zu is %g: the numbers of the source or the points are "
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

/* All right-hand sides, as the solver leaves them. */
struct sides {
	size_t count;
	double *b, *x;                          /* (count, rows), (count, unknowns) */
	const int *exponent;                    /* (count) of the powers of two that were taken out */
	const struct gnp_krylov_report *solved; /* (count) */
};

static gnp_status finish_sides(const struct gnp_poisson *poisson, const struct sides *sides, struct gnp_pool *pool,
                               struct gnp_task *task, double *solution, struct gnp_poisson_report *reports,
                               struct gnp_error *error)
{
	const struct gnp_krylov_report *solved = sides->solved;
	const struct gnp_equation *equation = &poisson->equation;
	size_t parts = equation->components.count + 1;
	double *spare = gnp_array_new(equation->rows + 2 * parts, sizeof *spare);
	gnp_status status = spare ? GNP_OK : gnp_error_set(error, GNP_OUT_OF_MEMORY, "solve: no memory for %zu rows", equation->rows);
	for (size_t r = 0; r < sides->count && status == GNP_OK; r++) {
		struct gnp_poisson_report report = {.residual = solved[r].residual, .iterations = solved[r].iterations};
		struct side side = {poisson, sides->b + r * equation->rows, sides->x + r * equation->unknowns,
		                    spare + equation->rows, spare + equation->rows + parts};
		status = settle_constants(&side, pool, task, &report, error);
		if (status == GNP_OK)
			status = measure_misfit(&side, pool, spare, &report, error);
		if (status == GNP_OK)
			status = write_solution(&side, r, sides->count, pool, spare, solution, error);
		if (status == GNP_OK)
			report.energy = energy_of(&side, spare);
		if (status == GNP_OK)
			status = take_power_back(poisson, r, sides->count, sides->exponent[r], solution, &report, error);
		if (status == GNP_OK && reports)
			reports[r] = report;
	}
	free(spare);
	return status;
}

gnp_status gnp_poisson_solve(const struct gnp_poisson *poisson, const double *source, const double *values,
                             size_t count, struct gnp_pool *pool, struct gnp_task *task, double *solution,
                             struct gnp_poisson_report *reports, struct gnp_error *error)
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
		status = finish_sides(poisson, &(struct sides){count, b, x, exponent, solved}, pool, task, solution, reports,
		                      error);
	gnp_task_stage(task, GNP_STAGE_DONE, 0);
	free(b);
	free(solved);
	free(exponent);
	return status;
}
