#include "core/linear/krylov.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/linear/vectors.h"

struct gmres {
	size_t n, restart;
	struct gnp_linear matrix, inverse;
	struct gnp_pool *pool;
	struct gnp_task *task;
	double *basis;      /* (restart + 1, n) orthonormal */
	double *hessenberg; /* (restart + 1, restart) by columns of restart + 1, rotated to triangular as it grows */
	double *cosine, *sine, *rhs, *share; /* (restart + 1) */
	double *direction;  /* (n) */
};

static bool gmres_take(struct gmres *work, double **block)
{
	size_t m = work->restart + 1, entries;
	if (!gnp_size_multiply(work->n, m + 1, &entries))
		return false;
	*block = gnp_array_new(entries + m * m + 4 * m, sizeof **block);
	if (!*block)
		return false;
	work->basis = *block;
	work->direction = work->basis + m * work->n;
	work->hessenberg = work->direction + work->n;
	work->cosine = work->hessenberg + m * m;
	work->sine = work->cosine + m;
	work->rhs = work->sine + m;
	work->share = work->rhs + m;
	return true;
}

/* residual = b - A x. */
static gnp_status residual_of(struct gnp_linear matrix, size_t rows, const double *b, const double *x, struct gnp_pool *pool,
                              struct gnp_task *task, double *residual, double *norm, struct gnp_error *error)
{
	gnp_status status = matrix.apply(matrix.context, x, residual, pool, task, error);
	if (status != GNP_OK)
		return status;
	for (size_t i = 0; i < rows; i++)
		residual[i] = b[i] - residual[i];
	return gnp_vectors_norm(rows, NULL, residual, pool, norm, error);
}

/* Classical Gram-Schmidt, twice. h (k + 2): shares of the k + 1 vectors so far, and the length left. */
static gnp_status orthogonalise(struct gmres *work, size_t k, double *h, struct gnp_error *error)
{
	double *w = work->basis + (k + 1) * work->n;
	memset(h, 0, (k + 2) * sizeof *h);
	gnp_status status = GNP_OK;
	for (int pass = 0; pass < 2 && status == GNP_OK; pass++) {
		status = gnp_vectors_dot(work->basis, k + 1, work->n, NULL, w, work->pool, work->share, error);
		if (status == GNP_OK)
			status = gnp_vectors_add(work->basis, k + 1, work->n, work->share, -1, work->pool, w, error);
		for (size_t j = 0; j <= k; j++)
			h[j] += work->share[j];
	}
	if (status == GNP_OK)
		status = gnp_vectors_norm(work->n, NULL, w, work->pool, &h[k + 1], error);
	for (size_t i = 0; i < work->n && status == GNP_OK && h[k + 1] > 0; i++)
		w[i] /= h[k + 1];
	return status;
}

/* Givens rotations keep the Hessenberg matrix triangular; the last entry of rhs is the residual. */
static void rotate(struct gmres *work, size_t k, double *h)
{
	for (size_t j = 0; j < k; j++) {
		double upper = work->cosine[j] * h[j] + work->sine[j] * h[j + 1];
		h[j + 1] = work->cosine[j] * h[j + 1] - work->sine[j] * h[j];
		h[j] = upper;
	}
	double length = hypot(h[k], h[k + 1]);
	work->cosine[k] = length > 0 ? h[k] / length : 1;
	work->sine[k] = length > 0 ? h[k + 1] / length : 0;
	h[k] = length;
	work->rhs[k + 1] = -work->sine[k] * work->rhs[k];
	work->rhs[k] *= work->cosine[k];
}

/* x += inverse (basis y), y from the triangle. */
static gnp_status correct(struct gmres *work, size_t steps, double *x, struct gnp_error *error)
{
	size_t m = work->restart + 1;
	for (size_t k = steps; k-- > 0;) {
		double sum = work->rhs[k];
		for (size_t j = k + 1; j < steps; j++)
			sum -= work->hessenberg[j * m + k] * work->share[j];
		work->share[k] = work->hessenberg[k * m + k] != 0 ? sum / work->hessenberg[k * m + k] : 0;
	}
	double *sum = work->basis + work->restart * work->n; /* a share of nothing: the last vector has none */
	memset(work->direction, 0, work->n * sizeof(double));
	gnp_status status = gnp_vectors_add(work->basis, steps, work->n, work->share, 1, work->pool, work->direction, error);
	if (status == GNP_OK)
		status = work->inverse.apply(work->inverse.context, work->direction, sum, work->pool, work->task, error);
	for (size_t i = 0; i < work->n && status == GNP_OK; i++)
		x[i] += sum[i];
	return status;
}

/* Whether nothing but rounding was left of the newest vector: the solution lies in what there is. The column h (k
 * + 2), which the basis makes as long as that vector was, is the measure, so that neither the unit of b nor that
 * of A decides. */
static bool is_spanned(const double *h, size_t k)
{
	double square = 0;
	for (size_t j = 0; j <= k + 1; j++)
		square += h[j] * h[j];
	return !(h[k + 1] > 1e-14 * sqrt(square));
}

/* One cycle from the residual in the first basis vector, of length `norm`. */
static gnp_status cycle(struct gmres *work, double norm, double target, size_t most, double *x, size_t *steps, struct gnp_error *error)
{
	size_t m = work->restart + 1, k = 0;
	gnp_status status = GNP_OK;
	for (size_t i = 0; i < work->n; i++)
		work->basis[i] /= norm;
	work->rhs[0] = norm;
	while (k < work->restart && k < most) {
		double *h = work->hessenberg + k * m;
		status = gnp_task_check(work->task, error);
		if (status == GNP_OK)
			status = work->inverse.apply(work->inverse.context, work->basis + k * work->n, work->direction, work->pool, work->task, error);
		if (status == GNP_OK)
			status = work->matrix.apply(work->matrix.context, work->direction, work->basis + (k + 1) * work->n, work->pool, work->task,
			                            error);
		if (status == GNP_OK)
			status = orthogonalise(work, k, h, error);
		if (status != GNP_OK)
			break;
		bool spanned = is_spanned(h, k);
		rotate(work, k++, h);
		if (spanned || fabs(work->rhs[k]) <= target)
			break;
	}
	*steps = k;
	return status == GNP_OK ? correct(work, k, x, error) : status;
}

static gnp_status did_not_converge(const char *method, const struct gnp_krylov_report *report, double tolerance, struct gnp_error *error)
{
	return gnp_error_set(error, GNP_NO_CONVERGENCE, "%s: residual %.3g after %zu iterations, need at most %g", method, report->residual,
	                     report->iterations, tolerance);
}

gnp_status gnp_gmres(size_t n, struct gnp_linear matrix, struct gnp_linear inverse, const double *b,
                     const struct gnp_krylov_options *options, struct gnp_pool *pool, struct gnp_task *task, double *x,
                     struct gnp_krylov_report *report, struct gnp_error *error)
{
	struct gmres work = {.n = n, .restart = options->restart, .matrix = matrix, .inverse = inverse, .pool = pool, .task = task};
	double *block = NULL, size, norm, before = INFINITY;
	*report = (struct gnp_krylov_report){.residual = 0};
	if (!gmres_take(&work, &block))
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "gmres: no memory for %zu vectors of %zu", options->restart + 2, n);
	gnp_status status = gnp_vectors_norm(n, NULL, b, pool, &size, error);
	while (status == GNP_OK) {
		size_t steps;
		status = residual_of(matrix, n, b, x, pool, task, work.basis, &norm, error);
		report->residual = size > 0 ? norm / size : norm;
		if (status != GNP_OK || report->residual <= options->tolerance)
			break;
		if (report->iterations >= options->iterations || !(norm < before)) {
			status = did_not_converge("gmres", report, options->tolerance, error);
			break;
		}
		before = norm;
		status = cycle(&work, norm, 0.5 * options->tolerance * size, options->iterations - report->iterations, x, &steps, error);
		report->iterations += steps;
	}
	free(block);
	return status;
}

struct cgls {
	double *residual;            /* (rows) b - A x */
	double *image;               /* (rows) A p */
	double *gradient, *z, *p;    /* (n) A^T r, its preconditioned form, the direction */
};

static gnp_status dot(size_t n, const double *a, const double *b, struct gnp_pool *pool, double *sum, struct gnp_error *error)
{
	return gnp_vectors_dot(a, 1, n, NULL, b, pool, sum, error);
}

static gnp_status cgls_step(size_t rows, size_t n, struct gnp_linear matrix, struct gnp_linear transpose, struct gnp_linear inverse,
                            struct gnp_pool *pool, struct gnp_task *task, double *x, double *gamma, struct cgls *work,
                            struct gnp_error *error)
{
	double curvature, next;
	gnp_status status = matrix.apply(matrix.context, work->p, work->image, pool, task, error);
	if (status == GNP_OK)
		status = dot(rows, work->image, work->image, pool, &curvature, error);
	if (status != GNP_OK)
		return status;
	double length = curvature > 0 ? *gamma / curvature : 0;
	for (size_t i = 0; i < n; i++)
		x[i] += length * work->p[i];
	for (size_t i = 0; i < rows; i++)
		work->residual[i] -= length * work->image[i];
	status = transpose.apply(transpose.context, work->residual, work->gradient, pool, task, error);
	if (status == GNP_OK)
		status = inverse.apply(inverse.context, work->gradient, work->z, pool, task, error);
	if (status == GNP_OK)
		status = dot(n, work->gradient, work->z, pool, &next, error);
	if (status != GNP_OK)
		return status;
	double turn = *gamma > 0 ? next / *gamma : 0;
	for (size_t i = 0; i < n; i++)
		work->p[i] = work->z[i] + turn * work->p[i];
	*gamma = next;
	return GNP_OK;
}

static gnp_status cgls_run(size_t rows, size_t n, struct gnp_linear matrix, struct gnp_linear transpose, struct gnp_linear inverse,
                           const double *b, const struct gnp_krylov_options *options, struct gnp_pool *pool, struct gnp_task *task,
                           double *x, struct cgls *work, struct gnp_krylov_report *report, struct gnp_error *error)
{
	double size, norm, gamma;
	gnp_status status = transpose.apply(transpose.context, b, work->gradient, pool, task, error);
	if (status == GNP_OK)
		status = gnp_vectors_norm(n, NULL, work->gradient, pool, &size, error);
	if (status == GNP_OK)
		status = residual_of(matrix, rows, b, x, pool, task, work->residual, &norm, error);
	if (status == GNP_OK)
		status = transpose.apply(transpose.context, work->residual, work->gradient, pool, task, error);
	if (status == GNP_OK)
		status = inverse.apply(inverse.context, work->gradient, work->p, pool, task, error);
	if (status == GNP_OK)
		status = dot(n, work->gradient, work->p, pool, &gamma, error);
	while (status == GNP_OK) {
		status = gnp_vectors_norm(n, NULL, work->gradient, pool, &norm, error);
		report->residual = size > 0 ? norm / size : norm;
		if (status != GNP_OK || report->residual <= options->tolerance)
			break;
		if (report->iterations >= options->iterations)
			return did_not_converge("conjugate gradients", report, options->tolerance, error);
		status = gnp_task_check(task, error);
		if (status == GNP_OK)
			status = cgls_step(rows, n, matrix, transpose, inverse, pool, task, x, &gamma, work, error);
		report->iterations++;
	}
	return status;
}

gnp_status gnp_cgls(size_t rows, size_t n, struct gnp_linear matrix, struct gnp_linear transpose, struct gnp_linear inverse,
                    const double *b, const struct gnp_krylov_options *options, struct gnp_pool *pool, struct gnp_task *task,
                    double *x, struct gnp_krylov_report *report, struct gnp_error *error)
{
	double *block = gnp_array_new(2 * rows + 3 * n, sizeof *block);
	*report = (struct gnp_krylov_report){.residual = 0};
	if (!block)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "conjugate gradients: no memory for vectors of %zu", n);
	struct cgls work = {block, block + rows, block + 2 * rows, block + 2 * rows + n, block + 2 * rows + 2 * n};
	gnp_status status = cgls_run(rows, n, matrix, transpose, inverse, b, options, pool, task, x, &work, report, error);
	free(block);
	return status;
}
