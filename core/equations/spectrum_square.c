/* Eigenpairs of collocation's -Delta, which is nearly symmetric: block Arnoldi iteration (Saad 2011, chapter 6) with
 * (-Delta - sigma)^-1. What is not symmetric in it leaves imaginary parts. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/random.h"
#include "core/equations/pieces.h"
#include "core/equations/spectrum_parts.h"
#include "core/linear/linalg.h"
#include "core/linear/vectors.h"

enum { BLOCK = 8 };

struct arnoldi {
	const struct gnp_poisson *poisson;
	struct gnp_pool *pool;
	struct gnp_task *task;
	size_t n, wanted, capacity; /* points; eigenpairs; vectors there is room for, a multiple of BLOCK */
	const unsigned char *fixed; /* (n) 1: no unknown; NULL: nowhere */
	size_t size;      /* vectors the operator has been applied to */
	double sigma;
	double *weight;   /* (n) area, 0 at points a filter dropped, copies of others and fixed ones */
	double *basis;    /* (capacity + BLOCK, n) orthonormal by the weights */
	double *projected; /* (capacity + BLOCK, capacity) by columns: the operator in the basis */
	double *in, *out; /* (n, BLOCK) */
	double *zeros;    /* (n, BLOCK) given at fixed points; NULL: nothing is */
	double *share;    /* (capacity + BLOCK) */
	/* of the last decomposition, over capacity */
	double *matrix, *vectors; /* (size, size) */
	double *real, *imaginary, *spare; /* (size), (size), (8 size) */
	struct ritz *ritz;    /* (size) those wanted most first */
};

struct ritz {
	double value, imaginary, residual; /* as in struct gnp_spectrum */
	double away; /* how far from what is wanted: the lowest, or those about sigma */
	size_t column, part; /* of vectors; 1: its imaginary part */
};

/* Numbers of the block for that many vectors of n; false where there can be none so large. */
static bool count_entries(size_t n, size_t capacity, size_t *entries)
{
	size_t rows = capacity + BLOCK, long_ones;
	if (!gnp_size_multiply(n, rows + 2 * BLOCK + 1, &long_ones))
		return false;
	*entries = long_ones + rows * capacity + rows + 2 * capacity * capacity + 10 * capacity;
	return true;
}

static bool take(struct arnoldi *work, double **block)
{
	size_t m = work->capacity, rows = m + BLOCK, entries;
	if (!count_entries(work->n, m, &entries))
		return false;
	*block = gnp_array_new(entries, sizeof **block);
	work->ritz = gnp_array_new(m, sizeof *work->ritz);
	if (!*block || !work->ritz)
		return false;
	work->basis = *block;
	work->in = work->basis + rows * work->n;
	work->out = work->in + BLOCK * work->n;
	work->weight = work->out + BLOCK * work->n;
	work->projected = work->weight + work->n;
	work->share = work->projected + rows * m;
	work->matrix = work->share + rows;
	work->vectors = work->matrix + m * m;
	work->real = work->vectors + m * m;
	work->imaginary = work->real + m;
	work->spare = work->imaginary + m;
	return true;
}

/* Takes the first `count` vectors off vector `count`, twice, and makes it a unit vector. h (count + 1): their shares,
 * its length. */
static gnp_status orthogonalise(struct arnoldi *work, size_t count, double *h, struct gnp_error *error)
{
	double *w = work->basis + count * work->n;
	gnp_status status = GNP_OK;
	memset(h, 0, (count + 1) * sizeof *h);
	for (int pass = 0; pass < 2 && status == GNP_OK && count > 0; pass++) {
		status = gnp_vectors_dot(work->basis, count, work->n, work->weight, w, work->pool, work->share, error);
		if (status == GNP_OK)
			status = gnp_vectors_add(work->basis, count, work->n, work->share, -1, work->pool, w, error);
		for (size_t k = 0; k < count; k++)
			h[k] += work->share[k];
	}
	if (status == GNP_OK)
		status = gnp_vectors_norm(work->n, work->weight, w, work->pool, &h[count], error);
	for (size_t i = 0; i < work->n && status == GNP_OK && h[count] > 0; i++)
		w[i] /= h[count];
	return status;
}

static gnp_status start(struct arnoldi *work, struct gnp_error *error)
{
	const struct gnp_domain *domain = gnp_poisson_domain(work->poisson);
	struct gnp_random random;
	unsigned char *free_there = gnp_array_new(domain->prepared.count, 1);
	gnp_status status = free_there ? GNP_OK : gnp_no_memory("spectrum", domain->prepared.count, "points", error);
	if (status != GNP_OK)
		return status;
	gnp_pieces_mark_free(domain, work->fixed, free_there);
	gnp_random_seed(&random, 1, 0);
	memset(work->weight, 0, work->n * sizeof *work->weight);
	for (size_t i = 0; i < domain->prepared.count; i++)
		work->weight[domain->prepared.order[i]] = free_there[i] ? domain->area[i] : 0;
	for (size_t k = 0; k < BLOCK && status == GNP_OK; k++) {
		for (size_t i = 0; i < work->n; i++)
			work->basis[k * work->n + i] = gnp_random_normal(&random) * !(work->fixed && work->fixed[i]);
		status = orthogonalise(work, k, work->projected, error); /* shares that are written over */
	}
	free(free_there);
	return status;
}

/* Applies the operator to the last BLOCK vectors and orthogonalises what comes of them. */
static gnp_status extend(struct arnoldi *work, struct gnp_error *error)
{
	size_t n = work->n, rows = work->capacity + BLOCK;
	for (size_t k = 0; k < BLOCK; k++)
		for (size_t i = 0; i < n; i++)
			work->in[i * BLOCK + k] = work->basis[(work->size + k) * n + i];
	gnp_status status = gnp_poisson_solve(work->poisson, work->in, work->zeros, BLOCK, work->pool, work->task,
	                                      work->out, NULL, error);
	for (size_t k = 0; k < BLOCK && status == GNP_OK; k++) {
		double *h = work->projected + (work->size + k) * rows;
		memset(h, 0, rows * sizeof *h);
		for (size_t i = 0; i < n; i++)
			work->basis[(work->size + BLOCK + k) * n + i] = work->out[i * BLOCK + k];
		status = orthogonalise(work, work->size + BLOCK + k, h, error);
	}
	work->size += BLOCK;
	return status;
}

static int by_place(const struct ritz *x, const struct ritz *y)
{
	return (x->column + x->part > y->column + y->part) - (x->column + x->part < y->column + y->part);
}

static int by_distance(const void *a, const void *b)
{
	const struct ritz *x = a, *y = b;
	return x->away != y->away ? (x->away < y->away ? -1 : 1) : by_place(x, y);
}

static int by_value(const void *a, const void *b)
{
	const struct ritz *x = a, *y = b;
	return x->value != y->value ? (x->value < y->value ? -1 : 1) : by_place(x, y);
}

/* Below sigma, where that is below 0, there is nothing to be found. */
static struct ritz ritz_of(double theta, double sigma)
{
	double inverse = theta != 0 ? 1 / theta : INFINITY;
	if (sigma > 0)
		return (struct ritz){.value = inverse + sigma, .away = fabs(inverse)};
	double value = theta > 0 ? inverse + sigma : INFINITY;
	return (struct ritz){.value = value, .away = value};
}

/* What the operator maps vector y of the basis to, outside of the basis. */
static double residual_of(const struct arnoldi *work, const double *y)
{
	size_t rows = work->capacity + BLOCK;
	double square = 0;
	for (size_t r = work->size; r < work->size + BLOCK; r++) {
		double sum = 0;
		for (size_t k = work->size - BLOCK; k < work->size; k++)
			sum += work->projected[k * rows + r] * y[k];
		square += sum * sum;
	}
	return sqrt(square);
}

static gnp_status decompose(struct arnoldi *work, struct gnp_error *error)
{
	size_t m = work->size, rows = work->capacity + BLOCK;
	for (size_t k = 0; k < m; k++)
		memcpy(work->matrix + k * m, work->projected + k * rows, m * sizeof(double));
	if (gnp_linalg_eigen(m, work->matrix, work->real, work->imaginary, work->vectors, work->spare) != 0)
		return gnp_error_set(error, GNP_NO_CONVERGENCE,
		                     "spectrum: the eigenvalues of a matrix of %zu rows were not found", m);
	for (size_t k = 0; k < m; k++) {
		double theta = work->real[k], size = fmax(fabs(theta), 1e-300);
		size_t part = work->imaginary[k] < 0; /* pairs come with the positive one first */
		work->ritz[k] = ritz_of(theta, work->sigma);
		work->ritz[k].imaginary = fabs(work->imaginary[k]) / (size * size);
		work->ritz[k].residual = residual_of(work, work->vectors + k * m) / size;
		work->ritz[k].column = k - part;
		work->ritz[k].part = part;
	}
	qsort(work->ritz, m, sizeof *work->ritz, by_distance);
	return GNP_OK;
}

static bool converged(const struct arnoldi *work, double tolerance, double *worst)
{
	*worst = work->size < work->wanted + BLOCK ? INFINITY : 0;
	for (size_t k = 0; k < work->wanted && k < work->size; k++)
		*worst = fmax(*worst, work->ritz[k].residual);
	return *worst <= tolerance;
}

static gnp_status iterate(struct arnoldi *work, double tolerance, struct gnp_error *error)
{
	double worst = INFINITY;
	gnp_status status = start(work, error);
	while (status == GNP_OK && work->size < work->capacity) {
		status = extend(work, error);
		if (status == GNP_OK && work->size >= work->wanted + BLOCK)
			status = decompose(work, error);
		if (status == GNP_OK && work->size >= work->wanted + BLOCK && converged(work, tolerance, &worst))
			return GNP_OK;
	}
	if (status == GNP_OK)
		status = gnp_error_set(error, GNP_NO_CONVERGENCE,
		                       "spectrum: residual %.3g with %zu vectors, need at most %g", worst, work->size,
		                       tolerance);
	return status;
}

static gnp_status write_pairs(struct arnoldi *work, struct gnp_spectrum *out, struct gnp_error *error)
{
	size_t m = work->size, n = work->n;
	gnp_status status = GNP_OK;
	qsort(work->ritz, work->wanted, sizeof *work->ritz, by_value);
	for (size_t k = 0; k < work->wanted && status == GNP_OK; k++) {
		const struct ritz *ritz = &work->ritz[k];
		double *vector = out->vector + k * n, length;
		out->value[k] = ritz->value;
		out->imaginary[k] = ritz->imaginary;
		out->residual[k] = ritz->residual;
		memset(vector, 0, n * sizeof *vector);
		status = gnp_vectors_add(work->basis, m, n, work->vectors + (ritz->column + ritz->part) * m, 1, work->pool,
		                         vector, error);
		if (status == GNP_OK)
			status = gnp_vectors_norm(n, work->weight, vector, work->pool, &length, error);
		for (size_t i = 0; i < n && status == GNP_OK && length > 0; i++)
			vector[i] /= length;
	}
	return status;
}

/* Pages of the basis that no iteration reaches are never written, so they cost no memory. */
static size_t capacity_of(size_t count, size_t points)
{
	size_t generous = 6 * count + 128, most = points - 2 * BLOCK;
	return (generous < most ? generous : most) / BLOCK * BLOCK;
}

gnp_status gnp_spectrum_square(const struct gnp_spectrum_task *asked, const struct gnp_poisson *poisson,
                               struct gnp_spectrum *out, struct gnp_error *error)
{
	size_t n = out->points, count = out->count;
	struct arnoldi work = {.poisson = poisson, .pool = asked->pool, .task = asked->task, .n = n, .wanted = count,
	                       .fixed = asked->fixed, .sigma = asked->sigma,
	                       .capacity = capacity_of(count, asked->free_points),
	                       .zeros = asked->fixed ? gnp_array_zero(n, BLOCK * sizeof(double)) : NULL};
	double *block = NULL;
	bool room = take(&work, &block) && (work.zeros || !asked->fixed);
	gnp_status status = room ? GNP_OK : gnp_error_set(error, GNP_OUT_OF_MEMORY,
	                                                  "spectrum: no memory for %zu vectors of %zu", work.capacity, n);
	if (status == GNP_OK)
		status = iterate(&work, asked->wanted.tolerance, error);
	if (status == GNP_OK)
		status = write_pairs(&work, out, error);
	out->solves = work.size;
	free(block);
	free(work.ritz);
	free(work.zeros);
	return status;
}

size_t gnp_spectrum_square_memory(size_t points, size_t count)
{
	size_t capacity = points > 2 * BLOCK ? capacity_of(count, points) : 0, entries = 0;
	bool fits = capacity && count_entries(points, capacity, &entries) && entries < SIZE_MAX / sizeof(double) / 2;
	return fits ? entries * sizeof(double) + capacity * sizeof(struct ritz) : SIZE_MAX;
}
