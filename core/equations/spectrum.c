#include "core/equations/spectrum.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/random.h"
#include "core/equations/spectrum_check.h"
#include "core/linear/linalg.h"
#include "core/linear/vectors.h"

enum { COUNT_MAX = 500, BLOCK = 8 };

struct arnoldi {
	const struct gnp_poisson *poisson;
	struct gnp_pool *pool;
	struct gnp_task *task;
	size_t n, wanted, capacity; /* points; eigenpairs; vectors there is room for, a multiple of BLOCK */
	size_t size;      /* vectors the operator has been applied to */
	double sigma;
	double *weight;   /* (n) area, 0 at points a filter dropped */
	double *basis;    /* (capacity + BLOCK, n) orthonormal by the weights */
	double *projected; /* (capacity + BLOCK, capacity) by columns: the operator in the basis */
	double *in, *out; /* (n, BLOCK) */
	double *share;    /* (capacity + BLOCK) */
	/* of the last decomposition, over capacity */
	double *matrix, *vectors; /* (size, size) */
	double *real, *imaginary, *spare; /* (size), (size), (8 size) */
	struct gnp_ritz *ritz;    /* (size) ascending by eigenvalue */
};

struct gnp_ritz {
	double value, imaginary, residual; /* as in struct gnp_spectrum */
	size_t column, part; /* of vectors; 1: its imaginary part */
};

void gnp_spectrum_clear(struct gnp_spectrum *spectrum)
{
	free(spectrum->value);
	free(spectrum->imaginary);
	free(spectrum->vector);
	free(spectrum->residual);
	*spectrum = (struct gnp_spectrum){.count = 0};
}

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
	gnp_status status = GNP_OK;
	gnp_random_seed(&random, 1, 0);
	memset(work->weight, 0, work->n * sizeof *work->weight);
	for (size_t i = 0; i < domain->prepared.count; i++)
		work->weight[domain->prepared.order[i]] = domain->area[i];
	for (size_t k = 0; k < BLOCK && status == GNP_OK; k++) {
		for (size_t i = 0; i < work->n; i++)
			work->basis[k * work->n + i] = gnp_random_normal(&random);
		status = orthogonalise(work, k, work->projected, error); /* these shares are not of the operator and written over */
	}
	return status;
}

/* Applies the operator to the last BLOCK vectors and orthogonalises what comes of them. */
static gnp_status extend(struct arnoldi *work, struct gnp_error *error)
{
	size_t n = work->n, rows = work->capacity + BLOCK;
	for (size_t k = 0; k < BLOCK; k++)
		for (size_t i = 0; i < n; i++)
			work->in[i * BLOCK + k] = work->basis[(work->size + k) * n + i];
	gnp_status status = gnp_poisson_solve(work->poisson, work->in, NULL, BLOCK, work->pool, work->task, work->out, NULL, error);
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

static int by_value(const void *a, const void *b)
{
	const struct gnp_ritz *x = a, *y = b;
	if (x->value != y->value)
		return x->value < y->value ? -1 : 1;
	return (x->column + x->part > y->column + y->part) - (x->column + x->part < y->column + y->part);
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
		work->ritz[k] = (struct gnp_ritz){.value = theta > 0 ? 1 / theta - work->sigma : INFINITY,
		                                  .imaginary = fabs(work->imaginary[k]) / (size * size),
		                                  .residual = residual_of(work, work->vectors + k * m) / size, .column = k - part, .part = part};
	}
	qsort(work->ritz, m, sizeof *work->ritz, by_value);
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
	for (size_t k = 0; k < work->wanted && status == GNP_OK; k++) {
		const struct gnp_ritz *ritz = &work->ritz[k];
		double *vector = out->vector + k * n, length;
		out->value[k] = ritz->value;
		out->imaginary[k] = ritz->imaginary;
		out->residual[k] = ritz->residual;
		memset(vector, 0, n * sizeof *vector);
		status = gnp_vectors_add(work->basis, m, n, work->vectors + (ritz->column + ritz->part) * m, 1, work->pool, vector, error);
		if (status == GNP_OK)
			status = gnp_vectors_norm(n, work->weight, vector, work->pool, &length, error);
		for (size_t i = 0; i < n && status == GNP_OK && length > 0; i++)
			vector[i] /= length;
	}
	return status;
}

static gnp_status allocate(size_t points, size_t count, struct gnp_spectrum *out, struct gnp_error *error)
{
	size_t entries;
	bool fits = gnp_size_multiply(points, count, &entries);
	*out = (struct gnp_spectrum){.points = points, .count = count, .value = gnp_array_new(count, sizeof(double)),
	                             .imaginary = gnp_array_new(count, sizeof(double)), .residual = gnp_array_new(count, sizeof(double)),
	                             .vector = fits ? gnp_array_new(entries, sizeof(double)) : NULL};
	if (out->value && out->imaginary && out->residual && out->vector)
		return GNP_OK;
	return gnp_error_set(error, GNP_OUT_OF_MEMORY, "spectrum: no memory for %zu eigenvectors of %zu", count, points);
}

/* Pages of the basis that no iteration reaches are never written, so they cost no memory. */
static size_t capacity_of(size_t count, size_t points)
{
	size_t generous = 6 * count + 128, most = points - 2 * BLOCK;
	return (generous < most ? generous : most) / BLOCK * BLOCK;
}

static gnp_status find(const struct gnp_poisson *poisson, double sigma, size_t count, double tolerance,
                       struct gnp_pool *pool, struct gnp_task *task, struct gnp_spectrum *out, struct gnp_error *error)
{
	struct arnoldi work = {.poisson = poisson, .pool = pool, .task = task, .n = gnp_poisson_info(poisson).points, .wanted = count,
	                       .sigma = sigma, .capacity = capacity_of(count, gnp_poisson_info(poisson).points)};
	struct gnp_spectrum spectrum = {.count = 0};
	double *block = NULL;
	gnp_status status = take(&work, &block) ? allocate(work.n, count, &spectrum, error)
	                                        : gnp_error_set(error, GNP_OUT_OF_MEMORY, "spectrum: no memory for %zu vectors of %zu",
	                                                        work.capacity, work.n);
	if (status == GNP_OK)
		status = iterate(&work, tolerance, error);
	if (status == GNP_OK)
		status = write_pairs(&work, &spectrum, error);
	spectrum.solves = work.size;
	free(block);
	free(work.ritz);
	if (status == GNP_OK)
		*out = spectrum;
	else
		gnp_spectrum_clear(&spectrum);
	return status;
}

/* A shift of the size of the first eigenvalue: that of a sphere of the cloud's extent, which scales as the spectrum
 * does. */
static gnp_status choose_shift(const struct gnp_cloud *cloud, double *shift, struct gnp_error *error)
{
	double mean[3] = {0}, square = 0;
	for (size_t i = 0; i < 3 * cloud->count; i++)
		mean[i % 3] += cloud->points[i] / (double)cloud->count;
	for (size_t i = 0; i < 3 * cloud->count; i++)
		square += (cloud->points[i] - mean[i % 3]) * (cloud->points[i] - mean[i % 3]) / (double)cloud->count;
	if (isinf(1 / square))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "points: the mean square of their distance from their middle is %.3g, which has no "
		                     "inverse in double precision: scale them up", square);
	*shift = 1 / square;
	return GNP_OK;
}

gnp_status gnp_spectrum_check(size_t count, size_t points, struct gnp_error *error)
{
	if (count < 1 || count > COUNT_MAX)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "count: got %zu, need 1..%d", count, COUNT_MAX);
	if (points < 4 * count + 96)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "points: got %zu, need at least %zu, 4 count + 96 where count is %zu", points,
		                     4 * count + 96, count);
	return GNP_OK;
}

/* Of an operator that is made. doubts: what is found against the pairs. */
static gnp_status run_with(const struct gnp_poisson *poisson, double shift, size_t count, double tolerance,
                           struct gnp_pool *pool, struct gnp_task *task, struct gnp_spectrum *spectrum,
                           struct gnp_warnings *doubts, struct gnp_error *error)
{
	const struct gnp_poisson_info info = gnp_poisson_info(poisson);
	gnp_status status = find(poisson, shift, count, tolerance, pool, task, spectrum, error);
	if (status == GNP_OK)
		status = gnp_spectrum_believe(spectrum, poisson, shift, doubts, error);
	if (status == GNP_OK)
		spectrum->surface = gnp_domain_facts(gnp_poisson_domain(poisson));
	spectrum->system = info.system;
	spectrum->why = info.why;
	return status;
}

/* Where pairs of a collocation that was chosen are doubted, those of the symmetric operator are found instead. */
static gnp_status run_on(const struct gnp_cloud *cloud, const struct gnp_poisson_options *options, size_t count,
                         double tolerance, struct gnp_pool *pool, struct gnp_task *task, struct gnp_spectrum *spectrum,
                         struct gnp_error *error)
{
	struct gnp_poisson_options wanted = *options;
	struct gnp_poisson *poisson = NULL;
	struct gnp_warnings doubts = {0}, *warnings = gnp_task_warnings(task), before = warnings ? *warnings : doubts;
	struct gnp_error own = {0};
	gnp_status status = gnp_poisson_prepare(cloud, options, pool, task, &poisson, error);
	if (status != GNP_OK)
		return status;
	status = run_with(poisson, options->screening, count, tolerance, pool, task, spectrum, &doubts, &own);
	bool chosen = options->laplacian.system == GNP_SYSTEM_AUTO && gnp_poisson_info(poisson).system == GNP_SYSTEM_SQUARE;
	bool doubted = status == GNP_NO_CONVERGENCE || (status == GNP_OK && gnp_warnings_count(&doubts) > 0);
	gnp_poisson_release(poisson);
	if (!chosen || !doubted) {
		gnp_warnings_merge(warnings, &doubts);
		return status == GNP_OK ? GNP_OK : gnp_error_set(error, status, "%s", own.text);
	}
	gnp_spectrum_clear(spectrum);
	if (warnings)
		*warnings = before;
	wanted.laplacian.system = GNP_SYSTEM_SYMMETRIC;
	status = gnp_poisson_prepare(cloud, &wanted, pool, task, &poisson, error);
	if (status != GNP_OK)
		return status;
	status = run_with(poisson, options->screening, count, tolerance, pool, task, spectrum, warnings, error);
	spectrum->why = "collocation has eigenvalues that it does not confirm";
	gnp_poisson_release(poisson);
	return status;
}

gnp_status gnp_spectrum_run(const struct gnp_cloud *cloud, const struct gnp_poisson_options *options, size_t count,
                            double tolerance, struct gnp_pool *pool, struct gnp_task *task, struct gnp_spectrum *out,
                            struct gnp_error *error)
{
	struct gnp_poisson_options screened = *options;
	struct gnp_spectrum spectrum = {.count = 0};
	gnp_status status = gnp_spectrum_check(count, cloud->count, error);
	if (status != GNP_OK)
		return status;
	if (!(tolerance >= 1e-12 && tolerance <= 0.1))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "tolerance: got %g, need 1e-12..0.1", tolerance);
	status = gnp_cloud_check(cloud, 12, error);
	if (status == GNP_OK)
		status = choose_shift(cloud, &screened.screening, error);
	if (status != GNP_OK)
		return status;
	screened.fixed = NULL;
	status = run_on(cloud, &screened, count, tolerance, pool, task, &spectrum, error);
	if (status == GNP_OK)
		*out = spectrum;
	else
		gnp_spectrum_clear(&spectrum);
	return status;
}

size_t gnp_spectrum_memory(size_t points, size_t count)
{
	size_t capacity = capacity_of(count, points), entries = 0;
	bool fits = points > 2 * BLOCK && count_entries(points, capacity, &entries) && entries < SIZE_MAX / sizeof(double) / 2;
	return fits ? (entries + count * (points + 3)) * sizeof(double) + capacity * sizeof(struct gnp_ritz) : SIZE_MAX;
}
