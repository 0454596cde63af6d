#include "core/linear/krylov.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/linear/vectors.h"

struct gmres {
	const struct gnp_krylov_system *system;
	size_t n, restart;
	struct gnp_pool *pool;
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

static gnp_status apply(const struct gnp_krylov_system *system, struct gnp_krylov_map map, const double *x, double *y,
                        struct gnp_error *error)
{
	return map.apply(map.context, x, y, system->pool, system->task, error);
}

/* residual = b - A x. */
static gnp_status residual_of(const struct gnp_krylov_system *system, const double *b, const double *x,
                              double *residual, double *norm, struct gnp_error *error)
{
	gnp_status status = apply(system, system->matrix, x, residual, error);
	if (status != GNP_OK)
		return status;
	for (size_t i = 0; i < system->rows; i++)
		residual[i] = b[i] - residual[i];
	return gnp_vectors_norm(system->rows, NULL, residual, system->pool, norm, error);
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
	gnp_status status = gnp_vectors_add(work->basis, steps, work->n, work->share, 1, work->pool, work->direction,
	                                    error);
	if (status == GNP_OK)
		status = apply(work->system, work->system->inverse, work->direction, sum, error);
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
static gnp_status cycle(struct gmres *work, double norm, double target, size_t most, double *x, size_t *steps,
                        struct gnp_error *error)
{
	const struct gnp_krylov_system *system = work->system;
	size_t m = work->restart + 1, k = 0;
	gnp_status status = GNP_OK;
	for (size_t i = 0; i < work->n; i++)
		work->basis[i] /= norm;
	work->rhs[0] = norm;
	while (k < work->restart && k < most) {
		double *h = work->hessenberg + k * m;
		status = gnp_task_check(system->task, error);
		if (status == GNP_OK)
			status = apply(system, system->inverse, work->basis + k * work->n, work->direction, error);
		if (status == GNP_OK)
			status = apply(system, system->matrix, work->direction, work->basis + (k + 1) * work->n, error);
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

static gnp_status did_not_converge(const char *method, const struct gnp_krylov_report *report, double tolerance,
                                   struct gnp_error *error)
{
	return gnp_error_set(error, GNP_NO_CONVERGENCE, "%s: residual %.3g after %zu iterations, need at most %g", method,
	                     report->residual, report->iterations, tolerance);
}

gnp_status gnp_krylov_gmres(const struct gnp_krylov_system *system, const double *b,
                            const struct gnp_krylov_options *options, double *x, struct gnp_krylov_report *report,
                            struct gnp_error *error)
{
	struct gmres work = {.system = system, .n = system->n, .restart = options->restart, .pool = system->pool};
	double *block = NULL, size, norm, before = INFINITY;
	*report = (struct gnp_krylov_report){.residual = 0};
	if (!gmres_take(&work, &block))
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "gmres: no memory for %zu vectors of %zu", options->restart + 2,
		                     system->n);
	gnp_status status = gnp_vectors_norm(system->n, NULL, b, system->pool, &size, error);
	while (status == GNP_OK) {
		size_t steps, left = options->iterations - report->iterations;
		status = residual_of(system, b, x, work.basis, &norm, error);
		if (status != GNP_OK)
			break;
		report->residual = size > 0 ? norm / size : norm;
		if (report->residual <= options->tolerance)
			break;
		if (report->iterations >= options->iterations || !(norm < before)) {
			status = did_not_converge("gmres", report, options->tolerance, error);
			break;
		}
		before = norm;
		status = cycle(&work, norm, 0.5 * options->tolerance * size, left, x, &steps, error);
		report->iterations += steps;
	}
	free(block);
	return status;
}

struct cgls {
	const struct gnp_krylov_system *system;
	double *residual;         /* (rows) b - A x */
	double *image;            /* (rows) A p */
	double *gradient, *z, *p; /* (n) A^T r, its preconditioned form, the direction */
	double gamma;             /* gradient . z */
};

static gnp_status dot(size_t n, const double *a, const double *b, struct gnp_pool *pool, double *sum,
                      struct gnp_error *error)
{
	return gnp_vectors_dot(a, 1, n, NULL, b, pool, sum, error);
}

/* The gradient of the residual, its preconditioned form and the product of the two. */
static gnp_status turn_residual(struct cgls *work, double *z, double *gamma, struct gnp_error *error)
{
	const struct gnp_krylov_system *system = work->system;
	gnp_status status = apply(system, system->transpose, work->residual, work->gradient, error);
	if (status == GNP_OK)
		status = apply(system, system->inverse, work->gradient, z, error);
	return status == GNP_OK ? dot(system->n, work->gradient, z, system->pool, gamma, error) : status;
}

static gnp_status cgls_step(struct cgls *work, double *x, struct gnp_error *error)
{
	const struct gnp_krylov_system *system = work->system;
	double curvature, next;
	gnp_status status = apply(system, system->matrix, work->p, work->image, error);
	if (status == GNP_OK)
		status = dot(system->rows, work->image, work->image, system->pool, &curvature, error);
	if (status != GNP_OK)
		return status;
	double length = curvature > 0 ? work->gamma / curvature : 0;
	for (size_t i = 0; i < system->n; i++)
		x[i] += length * work->p[i];
	for (size_t i = 0; i < system->rows; i++)
		work->residual[i] -= length * work->image[i];
	status = turn_residual(work, work->z, &next, error);
	if (status != GNP_OK)
		return status;
	double turn = work->gamma > 0 ? next / work->gamma : 0;
	for (size_t i = 0; i < system->n; i++)
		work->p[i] = work->z[i] + turn * work->p[i];
	work->gamma = next;
	return GNP_OK;
}

/* size: of A^T b, which the gradient is measured by. */
static gnp_status cgls_begin(struct cgls *work, const double *b, const double *x, double *size, struct gnp_error *error)
{
	const struct gnp_krylov_system *system = work->system;
	double norm;
	gnp_status status = apply(system, system->transpose, b, work->gradient, error);
	if (status == GNP_OK)
		status = gnp_vectors_norm(system->n, NULL, work->gradient, system->pool, size, error);
	if (status == GNP_OK)
		status = residual_of(system, b, x, work->residual, &norm, error);
	return status == GNP_OK ? turn_residual(work, work->p, &work->gamma, error) : status;
}

static gnp_status cgls_run(struct cgls *work, const double *b, const struct gnp_krylov_options *options, double *x,
                           struct gnp_krylov_report *report, struct gnp_error *error)
{
	const struct gnp_krylov_system *system = work->system;
	double size, norm;
	gnp_status status = cgls_begin(work, b, x, &size, error);
	while (status == GNP_OK) {
		status = gnp_vectors_norm(system->n, NULL, work->gradient, system->pool, &norm, error);
		if (status != GNP_OK)
			break;
		report->residual = size > 0 ? norm / size : norm;
		if (report->residual <= options->tolerance)
			break;
		if (report->iterations >= options->iterations)
			return did_not_converge("conjugate gradients", report, options->tolerance, error);
		status = gnp_task_check(system->task, error);
		if (status == GNP_OK)
			status = cgls_step(work, x, error);
		report->iterations++;
	}
	return status;
}

gnp_status gnp_krylov_cgls(const struct gnp_krylov_system *system, const double *b,
                           const struct gnp_krylov_options *options, double *x, struct gnp_krylov_report *report,
                           struct gnp_error *error)
{
	size_t rows = system->rows, n = system->n;
	double *block = gnp_array_new(2 * rows + 3 * n, sizeof *block);
	*report = (struct gnp_krylov_report){.residual = 0};
	if (!block)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "conjugate gradients: no memory for vectors of %zu", n);
	struct cgls work = {.system = system, .residual = block, .image = block + rows, .gradient = block + 2 * rows,
	                    .z = block + 2 * rows + n, .p = block + 2 * rows + 2 * n};
	gnp_status status = cgls_run(&work, b, options, x, report, error);
	free(block);
	return status;
}
