#include "core/linear/lanczos.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/random.h"
#include "core/linear/linalg.h"
#include "core/linear/vectors.h"

enum { BLOCK = GNP_LANCZOS_BLOCK, WAITING = 3 * BLOCK, MORE = 96, RESTARTS = 60, PATIENCE = 3 };
static const double nothing_left = 1e-12; /* of a vector that the basis holds already */

struct basis {
	const struct gnp_lanczos *system;
	size_t rows;       /* vectors there is room for */
	size_t size;       /* those that A has been applied to: the first ones */
	size_t waiting;    /* those after them, BLOCK to WAITING of them */
	size_t products;
	struct gnp_random random;
	double *vector;    /* (rows, n) orthonormal by the masses */
	double *matrix;    /* (rows, rows) of A in the basis, column by column: those of vectors that it has been applied to */
	double *share;     /* (rows, BLOCK) column by column */
	double *ritz;      /* (size, size) vectors in the basis, a column each */
	double *theta;     /* (size) ascending */
	size_t *order;     /* (size) by magnitude, the largest first */
};

size_t gnp_lanczos_vectors(size_t wanted)
{
	return 2 * wanted + MORE;
}

static double *vector_at(const struct basis *basis, size_t k)
{
	return basis->vector + k * basis->system->n;
}

static gnp_status allocate(struct basis *basis, struct gnp_error *error)
{
	size_t rows = basis->rows, n = basis->system->n, entries;
	basis->vector = gnp_size_multiply(rows, n, &entries) ? gnp_array_new(entries, sizeof *basis->vector) : NULL;
	basis->matrix = gnp_array_zero(rows * rows, sizeof *basis->matrix);
	basis->ritz = gnp_array_new(rows * rows, sizeof *basis->ritz);
	basis->share = gnp_array_new(rows * BLOCK, sizeof *basis->share);
	basis->theta = gnp_array_new(rows, sizeof *basis->theta);
	basis->order = gnp_array_new(rows, sizeof *basis->order);
	if (basis->vector && basis->matrix && basis->ritz && basis->share && basis->theta && basis->order)
		return GNP_OK;
	return gnp_error_set(error, GNP_OUT_OF_MEMORY, "eigenvectors: no memory for %zu vectors of %zu", rows, n);
}

static void clear(struct basis *basis)
{
	free(basis->vector);
	free(basis->matrix);
	free(basis->ritz);
	free(basis->share);
	free(basis->theta);
	free(basis->order);
}

/* ---- Orthonormal vectors ---- */

/* Takes the first `count` vectors off those from `at` on, once. basis->share (count, width): their shares. */
static gnp_status take_off(struct basis *basis, size_t count, size_t at, size_t width, struct gnp_error *error)
{
	const struct gnp_lanczos *system = basis->system;
	if (count == 0)
		return GNP_OK;
	gnp_status status = gnp_vectors_block_dot(basis->vector, count, system->n, system->mass, vector_at(basis, at),
	                                          width, system->pool, basis->share, error);
	if (status == GNP_OK)
		status = gnp_vectors_block_subtract(basis->vector, count, system->n, basis->share, width, system->pool,
		                                    vector_at(basis, at), error);
	return status;
}

static gnp_status length_of(const struct basis *basis, size_t k, double *length, struct gnp_error *error)
{
	const struct gnp_lanczos *system = basis->system;
	return gnp_vectors_norm(system->n, system->mass, vector_at(basis, k), system->pool, length, error);
}

static void scale(const struct basis *basis, size_t k, double factor)
{
	double *vector = vector_at(basis, k);
	for (size_t i = 0; i < basis->system->n; i++)
		vector[i] *= factor;
}

/* Puts a random unit vector at k, orthogonal to all before it. */
static gnp_status begin_another(struct basis *basis, size_t k, struct gnp_error *error)
{
	double length = 0, *vector = vector_at(basis, k);
	gnp_status status = GNP_OK;
	for (size_t i = 0; i < basis->system->n; i++)
		vector[i] = gnp_random_normal(&basis->random);
	for (int pass = 0; pass < 3 && status == GNP_OK; pass++) {
		status = take_off(basis, k, k, 1, error);
		if (status == GNP_OK)
			status = length_of(basis, k, &length, error);
		if (status == GNP_OK && !(length > 0))
			return gnp_error_set(error, GNP_NO_CONVERGENCE, "eigenvectors: no vector is left beside %zu", k);
		if (status == GNP_OK)
			scale(basis, k, 1 / length);
	}
	return status;
}

/* Makes the BLOCK vectors from `at` on orthonormal, which are orthogonal to those before: what A has made of those from
 * `from` on, whose columns of the matrix get their shares. length (BLOCK): what each had when A had made it. */
static gnp_status normalise_block(struct basis *basis, size_t from, size_t at, const double *length,
                                  struct gnp_error *error)
{
	const struct gnp_lanczos *system = basis->system;
	gnp_status status = GNP_OK;
	for (size_t c = 0; c < BLOCK && status == GNP_OK; c++) {
		double left = 0, *vector = vector_at(basis, at + c), *before = vector_at(basis, at);
		double *column = basis->matrix + (from + c) * basis->rows + at;
		for (int pass = 0; pass < 2 && status == GNP_OK && c > 0; pass++) {
			status = gnp_vectors_block_dot(before, c, system->n, system->mass, vector, 1, system->pool, basis->share,
			                               error);
			if (status == GNP_OK)
				status = gnp_vectors_block_subtract(before, c, system->n, basis->share, 1, system->pool, vector,
				                                    error);
			for (size_t r = 0; r < c; r++)
				column[r] += basis->share[r];
		}
		if (status == GNP_OK)
			status = length_of(basis, at + c, &left, error);
		if (status == GNP_OK && !isfinite(left))
			status = gnp_error_set(error, GNP_NO_CONVERGENCE, "eigenvectors: a product with a vector is not finite");
		if (status != GNP_OK)
			return status;
		if (left > nothing_left * length[c]) {
			column[c] = left;
			scale(basis, at + c, 1 / left);
		} else {
			status = begin_another(basis, at + c, error);
		}
	}
	return status;
}

/* A block of random vectors joins those that wait: a multiple eigenvalue has more vectors than a block finds. */
static gnp_status widen(struct basis *basis, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	for (size_t k = 0; k < BLOCK && status == GNP_OK; k++)
		status = begin_another(basis, basis->size + basis->waiting + k, error);
	basis->waiting += BLOCK;
	return status;
}

static gnp_status start(struct basis *basis, struct gnp_error *error)
{
	const struct gnp_lanczos *system = basis->system;
	gnp_random_seed(&basis->random, 1, 0);
	if (system->known) {
		memcpy(basis->vector, system->known, system->n * sizeof *system->known);
		basis->matrix[0] = system->known_value;
		basis->size = 1;
	}
	return widen(basis, error);
}

/* ---- One block more ---- */

/* Into the matrix's columns of the vectors being applied to, and the rows that mirror them. */
static void add_shares(struct basis *basis)
{
	size_t rows = basis->rows, size = basis->size, count = size + basis->waiting;
	for (size_t c = 0; c < BLOCK; c++)
		for (size_t r = 0; r < count; r++) {
			double share = basis->share[c * count + r], *entry = &basis->matrix[(size + c) * rows + r];
			bool own = r >= size && r < size + BLOCK; /* measured twice, by two vectors of this block */
			*entry += own ? share / 2 : share;
			if (own)
				basis->matrix[r * rows + size + c] += share / 2;
			else if (r < size)
				basis->matrix[r * rows + size + c] = *entry;
		}
}

static void clear_columns(struct basis *basis)
{
	size_t rows = basis->rows;
	for (size_t c = basis->size; c < basis->size + BLOCK; c++) {
		memset(basis->matrix + c * rows, 0, rows * sizeof *basis->matrix);
		for (size_t r = 0; r < basis->size; r++)
			basis->matrix[r * rows + c] = 0;
	}
}

/* Applies A to the first of the waiting vectors, which join the others; what is new in what it makes of them waits
 * instead. */
static gnp_status extend(struct basis *basis, struct gnp_error *error)
{
	const struct gnp_lanczos *system = basis->system;
	size_t at = basis->size + basis->waiting;
	double length[BLOCK];
	gnp_status status = gnp_task_check(system->task, error);
	if (status == GNP_OK)
		status = system->apply(system->context, vector_at(basis, basis->size), vector_at(basis, at), system->pool,
		                       system->task, error);
	for (size_t c = 0; c < BLOCK && status == GNP_OK; c++)
		status = length_of(basis, at + c, &length[c], error);
	clear_columns(basis);
	for (int pass = 0; pass < 2 && status == GNP_OK; pass++) {
		status = take_off(basis, at, at, BLOCK, error);
		if (status == GNP_OK)
			add_shares(basis);
	}
	if (status == GNP_OK)
		status = normalise_block(basis, basis->size, at, length, error);
	basis->size += BLOCK;
	basis->products += BLOCK;
	return status;
}

/* ---- Pairs ---- */

/* Both ends of the ascending thetas are where magnitudes are largest: of equal ones, the positive is first. */
static void sort_by_magnitude(struct basis *basis)
{
	size_t low = 0, high = basis->size;
	for (size_t k = 0; k < basis->size; k++)
		basis->order[k] = fabs(basis->theta[low]) > fabs(basis->theta[high - 1]) ? low++ : --high;
}

static gnp_status find_pairs(struct basis *basis, struct gnp_error *error)
{
	size_t size = basis->size;
	for (size_t c = 0; c < size; c++)
		memcpy(basis->ritz + c * size, basis->matrix + c * basis->rows, size * sizeof *basis->ritz);
	int info = gnp_linalg_eigen_symmetric(size, basis->ritz, basis->theta);
	if (info < 0)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "eigenvectors: no memory for a matrix of %zu rows", size);
	if (info > 0)
		return gnp_error_set(error, GNP_NO_CONVERGENCE, "eigenvectors: those of a matrix of %zu rows were not found",
		                     size);
	sort_by_magnitude(basis);
	return GNP_OK;
}

/* Of what A makes of the k-th largest pair's vector, the share of a waiting one. */
static double coupling_of(const struct basis *basis, size_t k, size_t waiting)
{
	const double *ritz = basis->ritz + basis->order[k] * basis->size;
	double sum = 0;
	for (size_t c = 0; c < basis->size; c++)
		sum += basis->matrix[c * basis->rows + basis->size + waiting] * ritz[c];
	return sum;
}

/* Of the k-th largest pair, relative: what A makes of its vector outside of the basis. */
static double residual_of(const struct basis *basis, size_t k)
{
	double square = 0, theta = fabs(basis->theta[basis->order[k]]);
	for (size_t w = 0; w < basis->waiting; w++)
		square += coupling_of(basis, k, w) * coupling_of(basis, k, w);
	return theta > 0 ? sqrt(square) / theta : INFINITY;
}

/* The ritz vectors of the `count` largest, side by side at the beginning of the block that they are taken from. */
static double *gather(const struct basis *basis, size_t count)
{
	size_t size = basis->size;
	double *gathered = gnp_array_new(size * count, sizeof *gathered);
	for (size_t k = 0; gathered && k < count; k++)
		memcpy(gathered + k * size, basis->ritz + basis->order[k] * size, size * sizeof *gathered);
	return gathered;
}

static gnp_status combine(const struct basis *basis, size_t count, double *vector, struct gnp_error *error)
{
	const struct gnp_lanczos *system = basis->system;
	double *shares = gather(basis, count);
	gnp_status status = shares ? gnp_vectors_combine(basis->vector, basis->size, system->n, shares, count, system->pool,
	                                                 vector, error)
	                           : gnp_no_memory("eigenvectors", count, "vectors", error);
	free(shares);
	return status;
}

/* The basis becomes its best vectors, with those that wait. */
static gnp_status restart(struct basis *basis, struct gnp_error *error)
{
	size_t wanted = basis->system->wanted, n = basis->system->n, rows = basis->rows, waiting = basis->waiting;
	size_t kept = wanted + (rows - WAITING - BLOCK - wanted) / 2, size = basis->size;
	double *coupling = gnp_array_new(kept * waiting, sizeof *coupling);
	gnp_status status = coupling ? GNP_OK : gnp_no_memory("eigenvectors", kept, "vectors", error);
	for (size_t k = 0; k < kept && status == GNP_OK; k++)
		for (size_t w = 0; w < waiting; w++)
			coupling[k * waiting + w] = coupling_of(basis, k, w);
	if (status == GNP_OK)
		status = combine(basis, kept, basis->vector, error);
	if (status == GNP_OK) {
		memmove(vector_at(basis, kept), vector_at(basis, size), waiting * n * sizeof *basis->vector);
		memset(basis->matrix, 0, rows * rows * sizeof *basis->matrix);
		for (size_t k = 0; k < kept; k++) {
			basis->matrix[k * rows + k] = basis->theta[basis->order[k]];
			memcpy(basis->matrix + k * rows + kept, coupling + k * waiting, waiting * sizeof *coupling);
		}
		basis->size = kept;
	}
	free(coupling);
	return status;
}

static double worst_residual(const struct basis *basis)
{
	double worst = 0;
	for (size_t k = 0; k < basis->system->wanted; k++)
		worst = fmax(worst, residual_of(basis, k));
	return worst;
}

/* Whether there is no room for what A makes of a block more. */
static bool is_full(const struct basis *basis)
{
	return basis->size + basis->waiting + BLOCK > basis->rows;
}

static gnp_status iterate(struct basis *basis, struct gnp_error *error)
{
	size_t wanted = basis->system->wanted, between = wanted / 4 > BLOCK ? wanted / 4 : BLOCK;
	size_t look = wanted + BLOCK; /* at the pairs, when there are so many vectors */
	double worst = INFINITY;
	gnp_status status = start(basis, error);
	for (int restarts = 0; status == GNP_OK && restarts <= RESTARTS;) {
		status = extend(basis, error);
		if (status != GNP_OK || (basis->size < look && !is_full(basis)))
			continue;
		status = find_pairs(basis, error);
		worst = status == GNP_OK ? worst_residual(basis) : INFINITY;
		if (status != GNP_OK || worst <= basis->system->tolerance)
			return status;
		if (is_full(basis)) {
			status = restart(basis, error);
			if (status == GNP_OK && ++restarts % PATIENCE == 0 && basis->waiting < WAITING)
				status = widen(basis, error);
		}
		look = basis->size + between;
	}
	return status != GNP_OK ? status : gnp_error_set(error, GNP_NO_CONVERGENCE,
	                                                 "eigenvectors: residual %.3g after %zu products, need at most %g",
	                                                 worst, basis->products, basis->system->tolerance);
}

gnp_status gnp_lanczos_find(const struct gnp_lanczos *system, double *theta, double *vector, double *residual,
                            size_t *products, struct gnp_error *error)
{
	struct basis basis = {.system = system, .rows = gnp_lanczos_vectors(system->wanted)};
	gnp_status status = allocate(&basis, error);
	if (status == GNP_OK)
		status = iterate(&basis, error);
	for (size_t k = 0; k < system->wanted && status == GNP_OK; k++) {
		theta[k] = basis.theta[basis.order[k]];
		residual[k] = residual_of(&basis, k);
	}
	if (status == GNP_OK)
		status = combine(&basis, system->wanted, vector, error);
	*products = basis.products;
	clear(&basis);
	return status;
}
