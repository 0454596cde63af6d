/* GMRES and CGLS on systems small enough to know the solution of. */
#include "core/linear/krylov.h"

#include <math.h>

#include "core/linear/csr.h"
#include "tests/unit/test.h"

enum { ROWS = 900, UNKNOWNS = 600 };

static struct gnp_pool *pools[2]; /* of 1 and of 3 workers */

static gnp_status apply_matrix(const void *context, const double *x, double *y, struct gnp_pool *pool,
                               struct gnp_task *task, struct gnp_error *error)
{
	return gnp_csr_multiply(context, x, y, pool, task, error);
}

/* Divides by a diagonal, the context. */
static gnp_status apply_diagonal(const void *context, const double *x, double *y, struct gnp_pool *pool,
                                 struct gnp_task *task, struct gnp_error *error)
{
	const double *diagonal = context;
	(void)pool, (void)task, (void)error;
	for (size_t i = 0; i < UNKNOWNS; i++)
		y[i] = x[i] / diagonal[i];
	return GNP_OK;
}

/* (rows, UNKNOWNS): three entries a row, unsymmetric, the largest in column i mod UNKNOWNS. */
static struct gnp_csr make_matrix(size_t rows)
{
	struct gnp_csr matrix;
	CHECK(gnp_csr_allocate(rows, UNKNOWNS, 3 * rows, &matrix, NULL) == GNP_OK);
	for (size_t i = 0, at = 0; i < rows; i++) {
		size_t own = i % UNKNOWNS, first = own == 0 ? 0 : own == UNKNOWNS - 1 ? own - 2 : own - 1;
		for (size_t j = first; j < first + 3; j++) {
			matrix.column[at] = (uint32_t)j;
			matrix.value[at++] = j == own ? 4 + (double)(i % 7) : j < own ? -1 : 1.5;
		}
		matrix.row_offsets[i + 1] = at;
	}
	return matrix;
}

static void fill_diagonal(const struct gnp_csr *matrix, bool squares, double *diagonal)
{
	memset(diagonal, 0, UNKNOWNS * sizeof *diagonal);
	for (size_t i = 0; i < matrix->rows; i++)
		for (size_t e = matrix->row_offsets[i]; e < matrix->row_offsets[i + 1]; e++) {
			if (squares)
				diagonal[matrix->column[e]] += matrix->value[e] * matrix->value[e];
			else if (matrix->column[e] == i)
				diagonal[i] = matrix->value[e];
		}
}

struct problem {
	struct gnp_csr matrix, transpose;
	double diagonal[UNKNOWNS], want[UNKNOWNS], x[2][UNKNOWNS], b[ROWS];
	struct gnp_krylov_system system;
};

static struct problem *make_problem(size_t rows)
{
	struct problem *problem = calloc(1, sizeof *problem);
	problem->matrix = make_matrix(rows);
	CHECK(gnp_csr_transpose(&problem->matrix, &problem->transpose, NULL) == GNP_OK);
	fill_diagonal(&problem->matrix, rows != UNKNOWNS, problem->diagonal);
	for (size_t i = 0; i < UNKNOWNS; i++)
		problem->want[i] = sin(0.1 * (double)i);
	CHECK(gnp_csr_multiply(&problem->matrix, problem->want, problem->b, pools[0], NULL, NULL) == GNP_OK);
	problem->system = (struct gnp_krylov_system){
		.rows = rows, .n = UNKNOWNS, .matrix = {apply_matrix, &problem->matrix},
		.transpose = {apply_matrix, &problem->transpose}, .inverse = {apply_diagonal, problem->diagonal}};
	return problem;
}

static void free_problem(struct problem *problem)
{
	gnp_csr_clear(&problem->matrix);
	gnp_csr_clear(&problem->transpose);
	free(problem);
}

typedef gnp_status (*solve_fn)(const struct gnp_krylov_system *system, const double *b,
                               const struct gnp_krylov_options *options, double *x, struct gnp_krylov_report *report,
                               struct gnp_error *error);

static void check_solution(solve_fn solve, size_t rows)
{
	const struct gnp_krylov_options options = {.tolerance = 1e-12, .iterations = 200, .restart = 12};
	struct problem *problem = make_problem(rows);
	struct gnp_krylov_report report;
	double worst = 0;
	for (int p = 0; p < 2; p++) {
		problem->system.pool = pools[p];
		CHECK(solve(&problem->system, problem->b, &options, problem->x[p], &report, NULL) == GNP_OK);
		CHECK(report.residual <= 1e-12 && report.iterations > 3 && report.iterations < 100);
	}
	for (size_t i = 0; i < UNKNOWNS; i++)
		worst = fmax(worst, fabs(problem->x[0][i] - problem->want[i]));
	CHECK_AT_MOST(worst, 1e-11);
	CHECK(memcmp(problem->x[0], problem->x[1], sizeof problem->x[0]) == 0);
	free_problem(problem);
}

static void solutions_are_found_by_any_number_of_workers(void)
{
	check_solution(gnp_krylov_gmres, UNKNOWNS);
	check_solution(gnp_krylov_cgls, UNKNOWNS);
	check_solution(gnp_krylov_cgls, ROWS);
}

static void check_stops(solve_fn solve, size_t rows, const char *text)
{
	const struct gnp_krylov_options options = {.tolerance = 1e-12, .iterations = 3, .restart = 12};
	struct problem *problem = make_problem(rows);
	struct gnp_krylov_report report;
	struct gnp_error error = {0};
	problem->system.pool = pools[0];
	CHECK(solve(&problem->system, problem->b, &options, problem->x[0], &report, &error) == GNP_NO_CONVERGENCE);
	CHECK(report.iterations == 3 && report.residual > 1e-12 && report.residual < 0.5);
	CHECK_CONTAINS(error.text, text);
	CHECK_CONTAINS(error.text, "after 3 iterations, need at most 1e-12");
	struct gnp_task task;
	gnp_task_init(&task);
	gnp_task_cancel(&task);
	problem->system.task = &task;
	CHECK(solve(&problem->system, problem->b, &options, problem->x[1], &report, NULL) == GNP_CANCELLED);
	memset(problem->b, 0, sizeof problem->b);
	memset(problem->x[1], 0, sizeof problem->x[1]);
	problem->system.task = NULL;
	CHECK(solve(&problem->system, problem->b, &options, problem->x[1], &report, NULL) == GNP_OK);
	CHECK(report.iterations == 0 && report.residual == 0);
	free_problem(problem);
}

static void what_does_not_come_to_an_end_is_said(void)
{
	check_stops(gnp_krylov_gmres, UNKNOWNS, "gmres: residual ");
	check_stops(gnp_krylov_cgls, ROWS, "conjugate gradients: residual ");
}

int main(int argc, char **argv)
{
	static const struct test tests[] = {TEST(solutions_are_found_by_any_number_of_workers),
	                                    TEST(what_does_not_come_to_an_end_is_said)};
	for (unsigned p = 0; p < 2; p++)
		CHECK(gnp_pool_create(1 + 2 * p, &pools[p], NULL) == GNP_OK);
	int failed = RUN_TESTS(tests);
	for (unsigned p = 0; p < 2; p++)
		gnp_pool_free(pools[p]);
	return failed;
}
