#include "weights/validate/pde/pde_form.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/random.h"
#include "core/base/vector.h"
#include "core/linear/components.h"
#include "core/linear/factor_solve.h"
#include "core/linear/linalg.h"
#include "core/linear/vectors.h"

enum { BLOCK = 8, BLOCKS_BETWEEN = 3 };
static const double residual_most = 1e-6;

void gnp_pde_form_clear(struct gnp_pde_form *form)
{
	gnp_csr_clear(&form->stiffness);
	free(form->mass);
	*form = (struct gnp_pde_form){.mass = NULL};
}

/* S + diag(added), factored. */
static gnp_status factor(const struct gnp_pde_form *form, const double *added, struct gnp_pool *pool,
                         struct gnp_task *task, struct gnp_factor **out, struct gnp_error *error)
{
	const struct gnp_csr *s = &form->stiffness;
	struct gnp_csr matrix;
	struct gnp_factor_plan plan;
	size_t entries = s->row_offsets[s->rows];
	gnp_status status = gnp_csr_allocate(s->rows, s->rows, entries, &matrix, error);
	if (status != GNP_OK)
		return status;
	memcpy(matrix.row_offsets, s->row_offsets, (s->rows + 1) * sizeof *s->row_offsets);
	memcpy(matrix.column, s->column, entries * sizeof *s->column);
	for (size_t i = 0; i < s->rows; i++)
		for (size_t e = s->row_offsets[i]; e < s->row_offsets[i + 1]; e++)
			matrix.value[e] = s->value[e] + (s->column[e] == i ? added[i] : 0);
	status = gnp_factor_plan_make(&matrix, true, form->points, pool, task, &plan, error);
	if (status == GNP_OK)
		status = gnp_factor_make_take(&matrix, &plan, pool, task, out, error);
	gnp_csr_clear(&matrix);
	return status;
}

/* ---- Eigenvalues ---- */

struct lanczos {
	const struct gnp_pde_form *form;
	struct gnp_pool *pool;
	struct gnp_task *task;
	struct gnp_factor *factor;
	double sigma;
	size_t n, wanted, capacity, size;                    /* size: vectors the operator has been applied to */
	double *basis;                                       /* (capacity + BLOCK, n) orthonormal by M */
	double *projected;                                   /* (capacity, capacity) the operator in the basis */
	double *share;                                       /* (capacity + BLOCK) */
	double *matrix, *vectors, *real, *imaginary, *spare; /* of the last decomposition */
	size_t *order;                                       /* (capacity) its columns, lowest eigenvalue first */
	double *x, *y;                                       /* (n) */
};

static bool take(struct lanczos *work, double **block)
{
	size_t n = work->n, m = work->capacity, rows = m + BLOCK, entries;
	if (!gnp_size_multiply(n, rows + 2, &entries))
		return false;
	*block = gnp_array_new(entries + 3 * m * m + rows + 10 * m, sizeof **block);
	work->order = gnp_array_new(m, sizeof *work->order);
	if (!*block || !work->order)
		return false;
	work->basis = *block;
	work->x = work->basis + rows * n;
	work->y = work->x + n;
	work->projected = work->y + n;
	work->share = work->projected + m * m;
	work->matrix = work->share + rows;
	work->vectors = work->matrix + m * m;
	work->real = work->vectors + m * m;
	work->imaginary = work->real + m;
	work->spare = work->imaginary + m;
	return true;
}

/* Vector `count` of the basis without the vectors before it, of unit length. */
static gnp_status orthogonalise(struct lanczos *work, size_t count, struct gnp_error *error)
{
	const double *mass = work->form->mass;
	double *w = work->basis + count * work->n, length = 0;
	gnp_status status = GNP_OK;
	for (int pass = 0; pass < 2 && status == GNP_OK && count > 0; pass++) {
		status = gnp_vectors_dot(work->basis, count, work->n, mass, w, work->pool, work->share, error);
		if (status == GNP_OK)
			status = gnp_vectors_add(work->basis, count, work->n, work->share, -1, work->pool, w, error);
	}
	if (status == GNP_OK)
		status = gnp_vectors_norm(work->n, mass, w, work->pool, &length, error);
	for (size_t i = 0; i < work->n && status == GNP_OK && length > 0; i++)
		w[i] /= length;
	return status;
}

static gnp_status start(struct lanczos *work, struct gnp_error *error)
{
	struct gnp_random random;
	gnp_status status = GNP_OK;
	gnp_random_seed(&random, 2, 0);
	for (size_t k = 0; k < BLOCK && status == GNP_OK; k++) {
		for (size_t i = 0; i < work->n; i++)
			work->basis[k * work->n + i] = gnp_random_normal(&random);
		status = orthogonalise(work, k, error);
	}
	return status;
}

/* Applies the operator to the last BLOCK vectors: what it makes of them in the basis, and BLOCK more vectors. */
static gnp_status extend(struct lanczos *work, struct gnp_error *error)
{
	size_t n = work->n, m = work->capacity, from = work->size;
	double *next = work->basis + (from + BLOCK) * n;
	for (size_t k = 0; k < BLOCK; k++)
		for (size_t i = 0; i < n; i++)
			next[k * n + i] = work->form->mass[i] * work->basis[(from + k) * n + i];
	gnp_status status = gnp_factor_solve(work->factor, next, BLOCK, work->pool, work->task, error);
	for (size_t k = 0; k < BLOCK && status == GNP_OK; k++) {
		status = gnp_vectors_dot(work->basis, from + BLOCK, n, work->form->mass, next + k * n, work->pool,
		                         work->share, error);
		for (size_t j = 0; j < from + BLOCK && status == GNP_OK; j++)
			work->projected[(from + k) * m + j] = work->projected[j * m + from + k] = work->share[j];
	}
	work->size += BLOCK;
	for (size_t k = 0; k < BLOCK && status == GNP_OK; k++)
		status = orthogonalise(work, work->size + k, error);
	return status;
}

static gnp_status decompose(struct lanczos *work, struct gnp_error *error)
{
	size_t m = work->size;
	for (size_t k = 0; k < m; k++)
		memcpy(work->matrix + k * m, work->projected + k * work->capacity, m * sizeof(double));
	if (gnp_linalg_eigen(m, work->matrix, work->real, work->imaginary, work->vectors, work->spare) != 0)
		return gnp_error_set(error, GNP_NO_CONVERGENCE, "eigenvalues of a matrix of %zu rows were not found", m);
	for (size_t k = 0; k < m; k++) {
		size_t at = k;
		for (; at > 0 && work->real[work->order[at - 1]] < work->real[k]; at--)
			work->order[at] = work->order[at - 1];
		work->order[at] = k;
	}
	return GNP_OK;
}

/* The eigenvector of a column, its Rayleigh quotient and its residual. */
static gnp_status judge(struct lanczos *work, size_t column, double *value, double *residual, struct gnp_error *error)
{
	const double *mass = work->form->mass;
	double above = 0, below = 0, square = 0;
	memset(work->x, 0, work->n * sizeof *work->x);
	gnp_status status = gnp_vectors_add(work->basis, work->size, work->n, work->vectors + column * work->size, 1,
	                                    work->pool, work->x, error);
	if (status == GNP_OK)
		status = gnp_csr_multiply(&work->form->stiffness, work->x, work->y, work->pool, work->task, error);
	for (size_t i = 0; i < work->n && status == GNP_OK; i++) {
		above += work->x[i] * work->y[i];
		below += work->x[i] * work->x[i] * mass[i];
	}
	*value = above / below;
	for (size_t i = 0; i < work->n && status == GNP_OK; i++)
		square += pow(work->y[i] - *value * mass[i] * work->x[i], 2) / mass[i];
	*residual = sqrt(square / below) / (fabs(*value) + work->sigma);
	return status;
}

static gnp_status iterate(struct lanczos *work, double *value, struct gnp_error *error)
{
	double worst = INFINITY;
	gnp_status status = start(work, error);
	for (size_t block = 1; status == GNP_OK && work->size < work->capacity; block++) {
		status = extend(work, error);
		if (status != GNP_OK || work->size < work->wanted + BLOCK || block % BLOCKS_BETWEEN != 0)
			continue;
		worst = 0;
		status = decompose(work, error);
		for (size_t k = 0; k < work->wanted && status == GNP_OK; k++) {
			double residual;
			status = judge(work, work->order[k], &value[k], &residual, error);
			worst = fmax(worst, residual);
		}
		if (status == GNP_OK && worst <= residual_most)
			return GNP_OK;
	}
	return status == GNP_OK ? gnp_error_set(error, GNP_NO_CONVERGENCE,
	                                        "eigenvalues: residual %.3g with %zu vectors, need at most %g", worst,
	                                        work->size, residual_most)
	                        : status;
}

/* One over the points' mean square from their middle: of the size of the first eigenvalue. */
static double choose_shift(const struct gnp_pde_form *form)
{
	size_t n = form->stiffness.rows;
	double mean[3] = {0}, square = 0;
	for (size_t i = 0; i < 3 * n; i++)
		mean[i % 3] += form->points[i] / (double)n;
	for (size_t i = 0; i < 3 * n; i++)
		square += (form->points[i] - mean[i % 3]) * (form->points[i] - mean[i % 3]) / (double)n;
	return 1 / square;
}

gnp_status gnp_pde_form_lowest(const struct gnp_pde_form *form, size_t count, struct gnp_pool *pool,
                               struct gnp_task *task, double *value, struct gnp_error *error)
{
	size_t n = form->stiffness.rows, generous = (6 * count + 128) / BLOCK * BLOCK, most = n / BLOCK * BLOCK;
	struct lanczos work = {.form = form,
	                       .pool = pool,
	                       .task = task,
	                       .sigma = choose_shift(form),
	                       .n = n,
	                       .wanted = count,
	                       .capacity = generous < most ? generous : most - BLOCK};
	double *block = NULL, *added = gnp_array_new(n, sizeof *added);
	if (n < count + 4 * BLOCK) {
		free(added);
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "eigenvalues: got %zu unknowns, need at least %zu for %zu",
		                     n, count + 4 * BLOCK, count);
	}
	gnp_status status = take(&work, &block) && added ? GNP_OK : gnp_no_memory("eigenvalues", n, "unknowns", error);
	for (size_t i = 0; i < n && status == GNP_OK; i++)
		added[i] = work.sigma * form->mass[i];
	if (status == GNP_OK)
		status = factor(form, added, pool, task, &work.factor, error);
	if (status == GNP_OK)
		status = iterate(&work, value, error);
	gnp_factor_free(work.factor);
	free(work.order);
	free(block);
	free(added);
	return status;
}

/* ---- Poisson ---- */

/* Takes the mean by M off x on each part. sums: spare (2, parts). */
static void centre(const struct gnp_pde_form *form, const struct gnp_components *parts, double *sums, double *x)
{
	memset(sums, 0, 2 * parts->count * sizeof *sums);
	for (size_t i = 0; i < parts->unknowns; i++) {
		sums[2 * parts->label[i]] += form->mass[i];
		sums[2 * parts->label[i] + 1] += form->mass[i] * x[i];
	}
	for (size_t i = 0; i < parts->unknowns; i++)
		x[i] -= sums[2 * parts->label[i] + 1] / sums[2 * parts->label[i]];
}

/* With a stiffer diagonal at one unknown of each part, where u is zero then: as right-hand sides sum to zero. */
gnp_status gnp_pde_form_solve(const struct gnp_pde_form *form, const double *source, struct gnp_pool *pool,
                              struct gnp_task *task, double *solution, struct gnp_error *error)
{
	const struct gnp_csr *s = &form->stiffness;
	struct gnp_components parts;
	struct gnp_factor *made = NULL;
	gnp_status status = gnp_components_find(s, NULL, &parts, error);
	if (status != GNP_OK)
		return status;
	double *added = gnp_array_zero(s->rows, sizeof *added), *sums = gnp_array_new(parts.count, 2 * sizeof *sums);
	if (!added || !sums)
		status = gnp_no_memory("solution", s->rows, "unknowns", error);
	for (size_t c = 0; c < parts.count && status == GNP_OK; c++)
		for (size_t e = s->row_offsets[parts.anchor[c]]; e < s->row_offsets[parts.anchor[c] + 1]; e++)
			added[parts.anchor[c]] += s->column[e] == parts.anchor[c] ? s->value[e] : 0;
	if (status == GNP_OK)
		status = factor(form, added, pool, task, &made, error);
	if (status == GNP_OK) {
		memcpy(solution, source, s->rows * sizeof *solution);
		centre(form, &parts, sums, solution);
		for (size_t i = 0; i < s->rows; i++)
			solution[i] *= form->mass[i];
		status = gnp_factor_solve(made, solution, 1, pool, task, error);
	}
	if (status == GNP_OK)
		centre(form, &parts, sums, solution);
	gnp_factor_free(made);
	gnp_components_clear(&parts);
	free(added);
	free(sums);
	return status;
}
