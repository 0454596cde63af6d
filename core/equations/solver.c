#include "core/equations/solver.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/cells/volume.h"
#include "core/linear/factor_solve.h"
#include "core/linear/vectors.h"

enum { DIRECT_MAX = 250000, RESTART = 60 };
static const double refine_above = 1e-9; /* relative residuals of a direct solution that a step of refinement is worth */

struct gnp_solver {
	const struct gnp_equation *equation;
	int kind;
	struct gnp_factor *factor; /* direct: of the system or its normal equations; iterative: of the finite-volume form */
	double *mass;      /* (unknowns) iterative: area, 1 at given points */
	double *squares;   /* (rows) direct, square, with given points: what squares of residuals weigh; NULL: all the same */
};

void gnp_solver_free(struct gnp_solver *solver)
{
	if (!solver)
		return;
	gnp_factor_free(solver->factor);
	free(solver->mass);
	free(solver->squares);
	free(solver);
}

size_t gnp_solver_bytes(const struct gnp_solver *solver)
{
	return sizeof *solver + gnp_factor_bytes(solver->factor) + (solver->mass ? solver->equation->unknowns * sizeof(double) : 0);
}

int gnp_solver_kind(const struct gnp_solver *solver)
{
	return solver->kind;
}

static bool is_square(const struct gnp_equation *equation)
{
	return equation->system != GNP_SYSTEM_LEAST_SQUARES;
}

static gnp_status too_large(const struct gnp_factor_plan *plan, size_t memory_limit, struct gnp_error *error)
{
	return gnp_error_set(error, GNP_TOO_LARGE, "memory: the factor of %zu unknowns needs %.2f GB, the limit is %.2f GB",
	                     plan->symbolic.count, 1e-9 * (double)plan->peak_bytes, 1e-9 * (double)memory_limit);
}

gnp_status gnp_solver_factor(const struct gnp_csr *matrix, bool symmetric, const double *points, size_t memory_limit,
                             struct gnp_pool *pool, struct gnp_task *task, bool *fits, struct gnp_factor **out,
                             struct gnp_error *error)
{
	struct gnp_factor_plan plan;
	gnp_task_stage(task, GNP_STAGE_FACTOR, 0);
	gnp_status status = gnp_factor_plan_make(matrix, symmetric, points, pool, task, &plan, error);
	if (status != GNP_OK)
		return status;
	bool allowed = memory_limit == 0 || plan.peak_bytes <= memory_limit;
	if (fits)
		*fits = allowed;
	if (!allowed) {
		status = fits ? GNP_OK : too_large(&plan, memory_limit, error);
		gnp_factor_plan_clear(&plan);
		return status;
	}
	gnp_task_stage(task, GNP_STAGE_FACTOR, plan.symbolic.supernodes);
	return gnp_factor_make_take(matrix, &plan, pool, task, out, error);
}

static double *kept_points(const struct gnp_equation *equation, const double *points)
{
	double *kept = gnp_array_new(equation->unknowns, 3 * sizeof *kept);
	for (size_t c = 0; kept && c < equation->unknowns; c++)
		memcpy(kept + 3 * c, points + 3 * (size_t)equation->kept[c], 3 * sizeof *kept);
	return kept;
}

/* Rows of given points are of another unit than the others, which have one over a length squared: for a residual that
 * does not depend on the unit of length they weigh as much as the largest number of those. */
static gnp_status weigh_rows(struct gnp_solver *solver, struct gnp_error *error)
{
	const struct gnp_equation *equation = solver->equation;
	const struct gnp_csr *matrix = &equation->matrix;
	double largest = 0;
	if (!is_square(equation) || !equation->given)
		return GNP_OK;
	solver->squares = gnp_array_new(equation->rows, sizeof *solver->squares);
	if (!solver->squares)
		return gnp_no_memory("factor", equation->rows, "rows", error);
	for (size_t i = 0; i < equation->rows; i++)
		for (size_t e = matrix->row_offsets[i]; e < matrix->row_offsets[i + 1] && !equation->given[i]; e++)
			largest = fmax(largest, fabs(matrix->value[e]));
	for (size_t i = 0; i < equation->rows; i++)
		solver->squares[i] = equation->given[i] && largest > 0 ? largest * largest : 1;
	return GNP_OK;
}

static gnp_status make_direct(struct gnp_solver *solver, const struct gnp_domain *domain, size_t memory_limit,
                              struct gnp_pool *pool, struct gnp_task *task, bool *fits, struct gnp_error *error)
{
	const struct gnp_equation *equation = solver->equation;
	double *points = kept_points(equation, domain->prepared.points);
	if (!points)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "factor: no memory for %zu unknowns", equation->unknowns);
	bool square = is_square(equation);
	gnp_status status = gnp_solver_factor(square ? &equation->matrix : &equation->normal, !square, points, memory_limit,
	                                      pool, task, fits, &solver->factor, error);
	free(points);
	solver->kind = GNP_SOLVER_DIRECT;
	return status == GNP_OK ? weigh_rows(solver, error) : status;
}

/* The kept points of a domain on their own. */
static gnp_status prepare_kept(const struct gnp_equation *equation, const struct gnp_prepared *prepared,
                               struct gnp_prepared *out, struct gnp_error *error)
{
	*out = (struct gnp_prepared){.count = equation->unknowns, .points = kept_points(equation, prepared->points),
	                             .normals = kept_points(equation, prepared->normals)};
	if (!out->points || !out->normals)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "factor: no memory for %zu unknowns", equation->unknowns);
	return gnp_neighbors_build(out->points, out->count, &out->neighbors, error);
}

/* What the finite-volume form has on its diagonal besides: alpha times the area, and the equation's pins. */
static void add_diagonal(const struct gnp_equation *equation, const struct gnp_stiffness *stiffness, const double *mass,
                         double *added)
{
	for (size_t i = 0; i < equation->unknowns; i++)
		added[i] = equation->alpha * mass[i];
	for (size_t k = 0; k < equation->components.count; k++) {
		uint32_t anchor = equation->components.anchor[k];
		added[anchor] += is_square(equation) ? equation->pin[k] * mass[anchor] : stiffness->diagonal[anchor];
	}
	for (size_t i = 0; i < equation->unknowns; i++) /* a cell without edges */
		if (!(stiffness->diagonal[i] + added[i] > 0))
			added[i] = 1;
}

static gnp_status make_iterative(struct gnp_solver *solver, const struct gnp_domain *domain, size_t memory_limit,
                                 struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error)
{
	const struct gnp_equation *equation = solver->equation;
	struct gnp_prepared kept = {.count = 0};
	struct gnp_stiffness stiffness = {.count = 0};
	struct gnp_csr matrix = {.rows = 0};
	double *added = gnp_array_new(equation->unknowns, sizeof *added);
	solver->kind = GNP_SOLVER_ITERATIVE;
	solver->mass = gnp_array_new(equation->unknowns, sizeof *solver->mass);
	gnp_status status = added && solver->mass ? prepare_kept(equation, &domain->prepared, &kept, error)
	                                          : gnp_error_set(error, GNP_OUT_OF_MEMORY, "factor: no memory for %zu unknowns", equation->unknowns);
	if (status == GNP_OK)
		status = gnp_volume_stiffness(&kept, pool, task, &stiffness, error);
	for (size_t i = 0; i < equation->unknowns && status == GNP_OK; i++)
		solver->mass[i] = equation->given && equation->given[i] ? 1 : domain->area[equation->kept[i]];
	if (status == GNP_OK) {
		add_diagonal(equation, &stiffness, solver->mass, added);
		status = gnp_volume_matrix(&stiffness, added, equation->given, &matrix, error);
	}
	if (status == GNP_OK)
		status = gnp_solver_factor(&matrix, !equation->given, kept.points, memory_limit, pool, task, NULL,
		                           &solver->factor, error);
	gnp_prepared_clear(&kept);
	gnp_stiffness_clear(&stiffness);
	gnp_csr_clear(&matrix);
	free(added);
	return status;
}

gnp_status gnp_solver_create(struct gnp_equation *equation, const struct gnp_domain *domain, int kind,
                             size_t memory_limit, struct gnp_pool *pool, struct gnp_task *task, struct gnp_solver **out,
                             struct gnp_error *error)
{
	struct gnp_solver *solver = gnp_array_zero(1, sizeof *solver);
	bool fits = true, may_change = kind == GNP_SOLVER_AUTO;
	if (!solver)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "factor: no memory for a solver");
	solver->equation = equation;
	if (kind == GNP_SOLVER_AUTO)
		kind = equation->unknowns <= DIRECT_MAX ? GNP_SOLVER_DIRECT : GNP_SOLVER_ITERATIVE;
	gnp_status status = GNP_OK;
	if (kind == GNP_SOLVER_DIRECT)
		status = make_direct(solver, domain, memory_limit, pool, task, may_change ? &fits : NULL, error);
	if (status == GNP_OK && (kind == GNP_SOLVER_ITERATIVE || !fits))
		status = make_iterative(solver, domain, memory_limit, pool, task, error);
	gnp_csr_clear(&equation->normal);
	if (status == GNP_OK)
		*out = solver;
	else
		gnp_solver_free(solver);
	return status;
}

static gnp_status apply_matrix(const void *context, const double *x, double *y, struct gnp_pool *pool,
                               struct gnp_task *task, struct gnp_error *error)
{
	(void)task;
	return gnp_csr_multiply(context, x, y, pool, NULL, error);
}

/* y = S^-1 M x: the finite-volume form of the inverse. */
static gnp_status apply_volumes(const void *context, const double *x, double *y, struct gnp_pool *pool,
                                struct gnp_task *task, struct gnp_error *error)
{
	const struct gnp_solver *solver = context;
	for (size_t i = 0; i < solver->equation->unknowns; i++)
		y[i] = solver->mass[i] * x[i];
	return gnp_factor_solve(solver->factor, y, 1, pool, task, error);
}

/* y = S^-1 M^2 S^-1 x, that of the normal equations. */
static gnp_status apply_volumes_twice(const void *context, const double *x, double *y, struct gnp_pool *pool,
                                      struct gnp_task *task, struct gnp_error *error)
{
	const struct gnp_solver *solver = context;
	size_t n = solver->equation->unknowns;
	memcpy(y, x, n * sizeof *y);
	gnp_status status = gnp_factor_solve(solver->factor, y, 1, pool, task, error);
	for (size_t i = 0; i < n; i++)
		y[i] *= solver->mass[i] * solver->mass[i];
	return status == GNP_OK ? gnp_factor_solve(solver->factor, y, 1, pool, task, error) : status;
}

/* Given values are no unknowns of least squares: b (rows) less what they contribute; x holds them and is zero
 * elsewhere. */
static gnp_status without_given(const struct gnp_equation *equation, const double *b, struct gnp_pool *pool, double *x,
                                double *left, struct gnp_error *error)
{
	memset(x, 0, equation->unknowns * sizeof *x);
	for (size_t c = 0; equation->given && c < equation->unknowns; c++)
		if (equation->given[c])
			x[c] = b[equation->kept[c]];
	gnp_status status = gnp_csr_multiply(&equation->matrix, x, left, pool, NULL, error);
	for (size_t i = 0; i < equation->rows && status == GNP_OK; i++)
		left[i] = b[i] - left[i];
	return status;
}

/* One right-hand side by CGLS: the correction of the given values. */
static gnp_status iterate_least_squares(const struct gnp_solver *solver, const double *b,
                                        const struct gnp_krylov_options *options, struct gnp_pool *pool,
                                        struct gnp_task *task, double *x, struct gnp_krylov_report *report,
                                        struct gnp_error *error)
{
	const struct gnp_equation *equation = solver->equation;
	const struct gnp_krylov_system system = {.rows = equation->rows, .n = equation->unknowns,
	                                         .matrix = {apply_matrix, &equation->matrix},
	                                         .transpose = {apply_matrix, &equation->transpose},
	                                         .inverse = {apply_volumes_twice, solver}, .pool = pool, .task = task};
	double *left = gnp_array_new(equation->rows, sizeof *left), *change = gnp_array_zero(equation->unknowns, sizeof *change);
	gnp_status status = left && change ? without_given(equation, b, pool, x, left, error)
	                                   : gnp_error_set(error, GNP_OUT_OF_MEMORY, "solve: no memory for %zu rows", equation->rows);
	if (status == GNP_OK)
		status = gnp_krylov_cgls(&system, left, options, change, report, error);
	for (size_t c = 0; change && c < equation->unknowns; c++)
		x[c] += change[c];
	free(left);
	free(change);
	return status;
}

static gnp_status iterate(const struct gnp_solver *solver, const double *b, const struct gnp_krylov_options *options,
                          struct gnp_pool *pool, struct gnp_task *task, double *x, struct gnp_krylov_report *report,
                          struct gnp_error *error)
{
	const struct gnp_equation *equation = solver->equation;
	struct gnp_krylov_options wanted = *options;
	wanted.restart = RESTART;
	if (!is_square(equation))
		return iterate_least_squares(solver, b, &wanted, pool, task, x, report, error);
	memset(x, 0, equation->unknowns * sizeof *x);
	const struct gnp_krylov_system system = {.rows = equation->rows, .n = equation->unknowns,
	                                         .matrix = {apply_matrix, &equation->matrix},
	                                         .inverse = {apply_volumes, solver}, .pool = pool, .task = task};
	return gnp_krylov_gmres(&system, b, &wanted, x, report, error);
}

/* correction (unknowns): of the residual left (rows), relative sizes of it in report. */
static gnp_status residual_of(const struct gnp_solver *solver, const double *b, const double *x, struct gnp_pool *pool,
                              double *left, double *correction, struct gnp_krylov_report *report,
                              struct gnp_error *error)
{
	const struct gnp_equation *equation = solver->equation;
	double size, norm;
	gnp_status status = gnp_csr_multiply(&equation->matrix, x, left, pool, NULL, error);
	for (size_t i = 0; i < equation->rows && status == GNP_OK; i++)
		left[i] = b[i] - left[i];
	if (is_square(equation)) {
		memcpy(correction, left, equation->rows * sizeof *left);
		status = status == GNP_OK ? gnp_vectors_norm(equation->rows, solver->squares, b, pool, &size, error) : status;
	} else {
		status = status == GNP_OK ? gnp_csr_multiply(&equation->transpose, b, correction, pool, NULL, error) : status;
		status = status == GNP_OK ? gnp_vectors_norm(equation->unknowns, NULL, correction, pool, &size, error) : status;
		status = status == GNP_OK ? gnp_csr_multiply(&equation->transpose, left, correction, pool, NULL, error) : status;
	}
	if (status == GNP_OK)
		status = gnp_vectors_norm(equation->unknowns, solver->squares, correction, pool, &norm, error);
	if (status == GNP_OK)
		report->residual = size > 0 ? norm / size : norm;
	return status;
}

/* Checks a direct solution, and refines it once where that is worth it. */
static gnp_status check(const struct gnp_solver *solver, const double *b, struct gnp_pool *pool, struct gnp_task *task,
                        double *x, struct gnp_krylov_report *report, struct gnp_error *error)
{
	const struct gnp_equation *equation = solver->equation;
	double *left = gnp_array_new(equation->rows + equation->unknowns, sizeof *left), *correction = left ? left + equation->rows : NULL;
	gnp_status status = left ? residual_of(solver, b, x, pool, left, correction, report, error)
	                         : gnp_error_set(error, GNP_OUT_OF_MEMORY, "solve: no memory for %zu rows", equation->rows);
	report->iterations = 1;
	if (status == GNP_OK && report->residual > refine_above) {
		status = gnp_factor_solve(solver->factor, correction, 1, pool, task, error);
		for (size_t c = 0; c < equation->unknowns && status == GNP_OK; c++)
			x[c] += correction[c];
		report->iterations = 2;
		if (status == GNP_OK)
			status = residual_of(solver, b, x, pool, left, correction, report, error);
	}
	free(left);
	return status;
}

static gnp_status solve_directly(const struct gnp_solver *solver, const double *b, size_t count, struct gnp_pool *pool,
                                 struct gnp_task *task, double *x, struct gnp_krylov_report *report, struct gnp_error *error)
{
	const struct gnp_equation *equation = solver->equation;
	size_t rows = equation->rows, n = equation->unknowns;
	double *left = gnp_array_new(rows, sizeof *left), *given = gnp_array_new(n, sizeof *given);
	gnp_status status = left && given ? GNP_OK : gnp_error_set(error, GNP_OUT_OF_MEMORY, "solve: no memory for %zu rows", rows);
	for (size_t r = 0; r < count && status == GNP_OK && !is_square(equation); r++) {
		status = without_given(equation, b + r * rows, pool, given, left, error);
		if (status == GNP_OK)
			status = gnp_csr_multiply(&equation->transpose, left, x + r * n, pool, NULL, error);
		for (size_t c = 0; equation->given && c < n; c++)
			if (equation->given[c])
				x[r * n + c] = given[c];
	}
	if (is_square(equation) && status == GNP_OK)
		memcpy(x, b, count * n * sizeof *x);
	if (status == GNP_OK)
		status = gnp_factor_solve(solver->factor, x, count, pool, task, error);
	for (size_t r = 0; r < count && status == GNP_OK; r++)
		status = check(solver, b + r * rows, pool, task, x + r * n, &report[r], error);
	free(left);
	free(given);
	return status;
}

gnp_status gnp_solver_apply(const struct gnp_solver *solver, const double *b, size_t count,
                            const struct gnp_krylov_options *options, struct gnp_pool *pool, struct gnp_task *task,
                            double *x, struct gnp_krylov_report *report, struct gnp_error *error)
{
	const struct gnp_equation *equation = solver->equation;
	if (solver->kind == GNP_SOLVER_DIRECT)
		return solve_directly(solver, b, count, pool, task, x, report, error);
	gnp_status status = GNP_OK;
	for (size_t r = 0; r < count && status == GNP_OK; r++)
		status = iterate(solver, b + r * equation->rows, options, pool, task, x + r * equation->unknowns, &report[r], error);
	return status;
}
