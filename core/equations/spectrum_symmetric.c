/* Eigenpairs of the symmetric operator: S v = lambda M v with the stiffness S and the masses M of the weak form.
 *
 * Pieces of the cloud that nothing connects are solved one by one, so that an eigenvalue comes once for every piece
 * that has it: small ones as dense matrices, large ones by Lanczos iteration on (S - sigma M)^-1 M. A value is the
 * quotient of its vector's energy and square, which are sums of nothing below 0. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/equations/pencil.h"
#include "core/equations/pieces.h"
#include "core/equations/spectrum_parts.h"
#include "core/linear/lanczos.h"
#include "core/linear/linalg.h"
#include "core/operators/interpolation.h"

enum { BESIDE = 4 * GNP_LANCZOS_BLOCK };

/* One pair that a piece has, and where its vector is. */
struct candidate {
	double value, residual;
	double away;      /* from what is asked for */
	size_t vector;    /* its beginning among the numbers of all */
	uint32_t piece;
};

struct work {
	const struct gnp_spectrum_task *asked;
	const struct gnp_domain *domain;
	const struct gnp_stiffness *volumes;
	struct gnp_pieces pieces;
	struct candidate *candidate; /* (candidates) */
	double *vector;       /* all of theirs, each over its piece */
	size_t candidates, numbers, solves;
};

static void clear(struct work *work)
{
	gnp_pieces_clear(&work->pieces);
	free(work->candidate);
	free(work->vector);
}

static size_t size_of(const struct work *work, size_t piece)
{
	return gnp_pieces_size(&work->pieces, piece);
}

/* Pairs that are taken of a piece. */
static size_t share_of(const struct work *work, size_t piece)
{
	size_t size = size_of(work, piece), wanted = work->asked->wanted.count;
	return size < wanted ? size : wanted;
}

static bool is_dense(const struct work *work, size_t piece)
{
	return size_of(work, piece) < gnp_lanczos_vectors(share_of(work, piece)) + BESIDE;
}

static gnp_status check_free(const struct work *work, struct gnp_error *error)
{
	size_t free_points = work->pieces.start[work->pieces.count], wanted = work->asked->wanted.count;
	if (free_points >= wanted)
		return GNP_OK;
	return gnp_error_set(error, GNP_INVALID_ARGUMENT,
	                     "points: got %zu that take part and are not fixed, need at least %zu, as many as count",
	                     free_points, wanted);
}

/* Room for the pairs of all pieces. */
static gnp_status make_room(struct work *work, struct gnp_error *error)
{
	size_t pairs = 0, numbers = 0;
	for (size_t p = 0; p < work->pieces.count; p++) {
		pairs += share_of(work, p);
		numbers += share_of(work, p) * size_of(work, p);
	}
	work->candidate = gnp_array_new(pairs, sizeof *work->candidate);
	work->vector = gnp_array_new(numbers, sizeof *work->vector);
	return work->candidate && work->vector ? GNP_OK : gnp_no_memory("spectrum", pairs, "eigenvectors", error);
}

/* ---- The pairs of a piece ---- */

static double mass_of(const struct work *work, size_t piece, size_t k)
{
	return work->domain->area[gnp_pieces_point(&work->pieces, piece, k)];
}

/* v^T S v / v^T M v. */
static double quotient(const struct work *work, size_t piece, const double *vector)
{
	const struct gnp_stiffness *s = work->volumes;
	double energy = 0, square = 0;
	for (size_t k = 0; k < size_of(work, piece); k++) {
		size_t i = gnp_pieces_point(&work->pieces, piece, k);
		for (size_t e = s->start[i]; e < s->start[i + 1]; e++) {
			bool inside = work->pieces.free[s->column[e]]; /* 0 at points that are given */
			double difference = vector[k] - (inside ? vector[work->pieces.local[s->column[e]]] : 0);
			energy += (inside ? 0.5 : 1) * s->value[e] * difference * difference;
		}
		square += work->domain->area[i] * vector[k] * vector[k];
	}
	return energy / square;
}

/* Notes the pair whose vector is the next one. */
static void add_candidate(struct work *work, size_t piece, double residual)
{
	double value = quotient(work, piece, work->vector + work->numbers);
	work->candidate[work->candidates++] = (struct candidate){
		.value = value, .residual = residual, .away = fabs(value - work->asked->wanted.shift), .vector = work->numbers,
		.piece = (uint32_t)piece};
	work->numbers += size_of(work, piece);
}

/* M^-1/2 S M^-1/2 of a piece, (size, size). Returns whether nothing of it is next to a fixed point. */
static bool fill_dense(const struct work *work, size_t piece, double *matrix)
{
	const struct gnp_stiffness *s = work->volumes;
	size_t size = size_of(work, piece);
	bool floats = true;
	memset(matrix, 0, size * size * sizeof *matrix);
	for (size_t k = 0; k < size; k++) {
		size_t i = gnp_pieces_point(&work->pieces, piece, k);
		matrix[k * size + k] = s->diagonal[i] / mass_of(work, piece, k);
		for (size_t e = s->start[i]; e < s->start[i + 1]; e++) {
			if (!work->pieces.free[s->column[e]]) {
				floats = false;
				continue;
			}
			size_t other = work->pieces.local[s->column[e]];
			matrix[k * size + other] = -s->value[e] / sqrt(mass_of(work, piece, k) * mass_of(work, piece, other));
		}
	}
	return floats;
}

/* The pair that is known: a constant, of length 1 with M^1/2 before it. */
static void set_constant(const struct work *work, size_t piece, double *vector)
{
	double all = 0;
	for (size_t k = 0; k < size_of(work, piece); k++)
		all += mass_of(work, piece, k);
	for (size_t k = 0; k < size_of(work, piece); k++)
		vector[k] = sqrt(mass_of(work, piece, k)) / sqrt(all);
}

/* spare: a matrix and a vector of the piece. */
static gnp_status solve_dense(struct work *work, size_t piece, double *spare, struct gnp_error *error)
{
	size_t size = size_of(work, piece), share = share_of(work, piece), first = 0;
	double *matrix = spare, *value = spare + size * size, shift = work->asked->wanted.shift;
	bool floats = fill_dense(work, piece, matrix);
	int info = gnp_linalg_eigen_symmetric(size, matrix, value);
	if (info != 0)
		return gnp_error_set(error, info < 0 ? GNP_OUT_OF_MEMORY : GNP_NO_CONVERGENCE,
		                     "spectrum: the eigenvalues of a matrix of %zu rows were not found", size);
	if (floats)
		set_constant(work, piece, matrix);
	while (first + share < size && fabs(value[first + share] - shift) < fabs(value[first] - shift))
		first++;
	for (size_t k = first; k < first + share; k++) {
		for (size_t i = 0; i < size; i++)
			work->vector[work->numbers + i] = matrix[k * size + i] / sqrt(mass_of(work, piece, i));
		add_candidate(work, piece, 0);
		if (floats && k == 0)
			work->candidate[work->candidates - 1].value = 0;
	}
	return GNP_OK;
}

/* ---- Large pieces ---- */

/* Unit length to the last digit, after a sum of many vectors; where it is the constant, that itself. Returns whether it
 * is. */
static bool normalise(const struct gnp_pencil *pencil, double *vector)
{
	double square = 0, along = 0;
	for (size_t i = 0; i < pencil->matrix.rows; i++) {
		square += pencil->mass[i] * vector[i] * vector[i];
		along += pencil->mass[i] * vector[i] * pencil->constant[i];
	}
	bool constant = pencil->floats && fabs(along) > 0.9 * sqrt(square);
	for (size_t i = 0; i < pencil->matrix.rows; i++)
		vector[i] = constant ? pencil->constant[i] : vector[i] / sqrt(square);
	return constant;
}

static gnp_status iterate(struct work *work, size_t piece, const struct gnp_pencil *pencil, struct gnp_error *error)
{
	const struct gnp_spectrum_task *asked = work->asked;
	size_t share = share_of(work, piece), size = size_of(work, piece), products = 0;
	double *vector = work->vector + work->numbers;
	const struct gnp_lanczos system = {
		.n = size, .wanted = share, .mass = pencil->mass, .apply = gnp_pencil_apply, .context = pencil,
		.known = pencil->floats ? pencil->constant : NULL, .known_value = -1 / pencil->sigma,
		.tolerance = asked->wanted.tolerance, .pool = asked->pool, .task = asked->task};
	double *theta = gnp_array_new(share, 2 * sizeof *theta), *residual = theta ? theta + share : NULL;
	gnp_status status = theta ? gnp_lanczos_find(&system, theta, vector, residual, &products, error)
	                          : gnp_no_memory("spectrum", share, "eigenvalues", error);
	work->solves += products;
	for (size_t k = 0; k < share && status == GNP_OK; k++) {
		bool constant = normalise(pencil, vector + k * size);
		add_candidate(work, piece, residual[k]);
		if (constant)
			work->candidate[work->candidates - 1].value = 0;
	}
	free(theta);
	return status;
}

static gnp_status solve_large(struct work *work, size_t piece, struct gnp_error *error)
{
	const struct gnp_spectrum_task *asked = work->asked;
	struct gnp_pencil pencil;
	gnp_status status = gnp_pencil_make(&work->pieces, piece, work->domain, work->volumes, asked->sigma,
	                                    asked->memory_limit, asked->pool, asked->task, &pencil, error);
	gnp_task_stage(asked->task, GNP_STAGE_SOLVE, 0);
	if (status == GNP_OK)
		status = iterate(work, piece, &pencil, error);
	gnp_pencil_clear(&pencil);
	return status;
}

static gnp_status solve_pieces(struct work *work, struct gnp_error *error)
{
	size_t largest = 0;
	for (size_t p = 0; p < work->pieces.count; p++)
		if (is_dense(work, p) && size_of(work, p) > largest)
			largest = size_of(work, p);
	double *spare = gnp_array_new(largest * largest + largest, sizeof *spare);
	gnp_status status = spare ? GNP_OK : gnp_no_memory("spectrum", largest, "points", error);
	for (size_t p = 0; p < work->pieces.count && status == GNP_OK; p++) {
		status = gnp_task_check(work->asked->task, error);
		if (status == GNP_OK)
			status = is_dense(work, p) ? solve_dense(work, p, spare, error) : solve_large(work, p, error);
	}
	free(spare);
	return status;
}

/* ---- The pairs of the cloud ---- */

static int by_place(const struct candidate *a, const struct candidate *b)
{
	return (a->vector > b->vector) - (a->vector < b->vector);
}

static int by_distance(const void *a, const void *b)
{
	const struct candidate *x = a, *y = b;
	return x->away != y->away ? (x->away < y->away ? -1 : 1) : by_place(x, y);
}

static int by_value(const void *a, const void *b)
{
	const struct candidate *x = a, *y = b;
	return x->value != y->value ? (x->value < y->value ? -1 : 1) : by_place(x, y);
}

/* values: spare, over the domain's points. outside: at points that a filter dropped, from those. */
static gnp_status write_vector(const struct work *work, const struct candidate *from, const struct gnp_csr *outside,
                               double *values, double *there, double *vector, struct gnp_error *error)
{
	const struct gnp_domain *domain = work->domain;
	const double *own = work->vector + from->vector;
	gnp_status status = GNP_OK;
	memset(values, 0, work->pieces.points * sizeof *values);
	for (size_t k = 0; k < size_of(work, from->piece); k++)
		values[gnp_pieces_point(&work->pieces, from->piece, k)] = own[k];
	if (domain->dropped)
		status = gnp_csr_multiply(outside, values, there, work->asked->pool, NULL, error);
	for (size_t i = 0; i < work->pieces.points; i++)
		vector[domain->prepared.order[i]] = values[i];
	for (size_t i = 0; i < domain->dropped; i++)
		vector[domain->dropped_index[i]] = there[i];
	gnp_copies_spread(&domain->copies, vector, 1, 0);
	return status;
}

static gnp_status write_pairs(struct work *work, struct gnp_spectrum *out, struct gnp_error *error)
{
	const struct gnp_domain *domain = work->domain;
	struct gnp_csr outside = {.rows = 0};
	double *values = gnp_array_new(work->pieces.points + domain->dropped, sizeof *values);
	double *there = values ? values + work->pieces.points : NULL;
	gnp_status status = values ? GNP_OK : gnp_no_memory("spectrum", work->pieces.points, "points", error);
	if (status == GNP_OK && domain->dropped)
		status = gnp_interpolation_make(&domain->prepared, domain->dropped_points, domain->dropped, work->asked->degree,
		                                work->asked->pool, work->asked->task, &outside, error);
	qsort(work->candidate, work->candidates, sizeof *work->candidate, by_distance);
	qsort(work->candidate, out->count, sizeof *work->candidate, by_value);
	for (size_t k = 0; k < out->count && status == GNP_OK; k++) {
		out->value[k] = work->candidate[k].value;
		out->imaginary[k] = 0;
		out->residual[k] = work->candidate[k].residual;
		status = write_vector(work, &work->candidate[k], &outside, values, there, out->vector + k * out->points, error);
	}
	gnp_csr_clear(&outside);
	free(values);
	return status;
}

gnp_status gnp_spectrum_symmetric(const struct gnp_spectrum_task *asked, const struct gnp_domain *domain,
                                  const struct gnp_stiffness *volumes, struct gnp_spectrum *out,
                                  struct gnp_error *error)
{
	struct work work = {.asked = asked, .domain = domain, .volumes = volumes};
	gnp_status status = gnp_pieces_find(domain, volumes, asked->fixed, &work.pieces, error);
	if (status == GNP_OK)
		status = check_free(&work, error);
	if (status == GNP_OK)
		status = make_room(&work, error);
	if (status == GNP_OK)
		status = solve_pieces(&work, error);
	if (status == GNP_OK)
		status = write_pairs(&work, out, error);
	out->solves = work.solves;
	clear(&work);
	return status;
}

size_t gnp_spectrum_symmetric_memory(size_t points, size_t count)
{
	size_t vectors = gnp_lanczos_vectors(count), basis;
	size_t small = 3 * vectors * vectors + (vectors + BESIDE) * (vectors + BESIDE);
	size_t rows = vectors + count + 2 * GNP_LANCZOS_BLOCK; /* with the pairs */
	bool fits = gnp_size_multiply(points, rows, &basis) && basis < SIZE_MAX / sizeof(double) / 2;
	return fits ? (basis + small) * sizeof(double) + points * 64 : SIZE_MAX;
}
