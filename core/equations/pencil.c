#include "core/equations/pencil.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/select.h"
#include "core/equations/solver.h"
#include "core/linear/factor_solve.h"
#include "core/linear/lanczos.h"

enum { BLOCK = GNP_LANCZOS_BLOCK };

struct making {
	const struct gnp_pieces *pieces;
	size_t piece, size; /* points of it */
	const struct gnp_domain *domain;
	const struct gnp_stiffness *volumes;
};

void gnp_pencil_clear(struct gnp_pencil *pencil)
{
	gnp_csr_clear(&pencil->matrix);
	gnp_factor_free(pencil->factor);
	free(pencil->mass);
	free(pencil->points);
	free(pencil->constant);
	free(pencil->left);
	*pencil = (struct gnp_pencil){.factor = NULL};
}

static gnp_status allocate(const struct making *making, double sigma, struct gnp_pencil *out, struct gnp_error *error)
{
	size_t size = making->size, entries = size;
	for (size_t k = 0; k < size; k++) {
		size_t i = gnp_pieces_point(making->pieces, making->piece, k);
		entries += making->volumes->start[i + 1] - making->volumes->start[i];
	}
	gnp_status status = gnp_csr_allocate(size, size, entries, &out->matrix, error);
	if (status != GNP_OK)
		return status;
	out->mass = gnp_array_new(size, sizeof *out->mass);
	out->points = gnp_array_new(size, 3 * sizeof *out->points);
	out->constant = gnp_array_new(size, sizeof *out->constant);
	out->left = sigma > 0 ? gnp_array_new(size, BLOCK * sizeof *out->left) : NULL;
	bool room = out->mass && out->points && out->constant && (out->left || sigma <= 0);
	return room ? GNP_OK : gnp_no_memory("spectrum", size, "points", error);
}

/* Below 0 it may be no nearer to 0 than a share of what a closed surface of so many points has for its first
 * eigenvalue: points far from all others have one that is far less, beside whose inverse the rest would be lost. Above
 * all eigenvalues, of which twice the largest entry is a bound, it need not be. spare: numbers for each point. */
static double choose_sigma(const struct making *making, const double *mass, double sigma, double *spare)
{
	static const double share = 1e-4, pi = 3.14159265358979323846;
	double most = 0;
	for (size_t k = 0; k < making->size; k++)
		most = fmax(most, making->volumes->diagonal[gnp_pieces_point(making->pieces, making->piece, k)] / mass[k]);
	if (sigma > 0)
		return fmin(sigma, 2.1 * most);
	memcpy(spare, mass, making->size * sizeof *spare);
	return fmin(sigma, -share * 4 * pi / ((double)making->size * gnp_median(spare, making->size)));
}

static void copy_points(const struct making *making, double sigma, struct gnp_pencil *out)
{
	double all = 0;
	for (size_t k = 0; k < making->size; k++) {
		size_t i = gnp_pieces_point(making->pieces, making->piece, k);
		out->mass[k] = making->domain->area[i];
		memcpy(out->points + 3 * k, making->domain->prepared.points + 3 * i, 3 * sizeof *out->points);
		all += out->mass[k];
	}
	out->sigma = choose_sigma(making, out->mass, sigma, out->constant);
	for (size_t k = 0; k < making->size; k++)
		out->constant[k] = 1 / sqrt(all);
}

static void write_row(const struct making *making, size_t k, struct gnp_pencil *out)
{
	const struct gnp_stiffness *s = making->volumes;
	struct gnp_csr *matrix = &out->matrix;
	size_t i = gnp_pieces_point(making->pieces, making->piece, k), at = matrix->row_offsets[k];
	size_t e = s->start[i], end = s->start[i + 1];
	for (bool own = false; e < end || !own;) {
		if (!own && (e == end || s->column[e] > i)) {
			matrix->column[at] = (uint32_t)k;
			matrix->value[at++] = s->diagonal[i] - out->sigma * out->mass[k];
			own = true;
			continue;
		}
		if (making->pieces->free[s->column[e]]) {
			matrix->column[at] = making->pieces->local[s->column[e]];
			matrix->value[at++] = -s->value[e];
		} else {
			out->floats = false;
		}
		e++;
	}
	matrix->row_offsets[k + 1] = at;
}

gnp_status gnp_pencil_make(const struct gnp_pieces *pieces, size_t piece, const struct gnp_domain *domain,
                           const struct gnp_stiffness *volumes, double sigma, size_t memory_limit,
                           struct gnp_pool *pool, struct gnp_task *task, struct gnp_pencil *out,
                           struct gnp_error *error)
{
	const struct making making = {pieces, piece, gnp_pieces_size(pieces, piece), domain, volumes};
	*out = (struct gnp_pencil){.floats = true};
	gnp_status status = allocate(&making, sigma, out, error);
	if (status != GNP_OK)
		return status;
	copy_points(&making, sigma, out);
	for (size_t k = 0; k < making.size; k++)
		write_row(&making, k, out);
	return gnp_solver_factor(&out->matrix, sigma <= 0, out->points, memory_limit, pool, task, NULL, &out->factor,
	                         error);
}

/* An indefinite factor has not the accuracy of a definite one: a step of refinement. */
static gnp_status refine(const struct gnp_pencil *pencil, const double *x, double *y, struct gnp_pool *pool,
                         struct gnp_task *task, struct gnp_error *error)
{
	size_t n = pencil->matrix.rows;
	gnp_status status = GNP_OK;
	for (size_t c = 0; c < BLOCK && status == GNP_OK; c++) {
		double *left = pencil->left + c * n;
		status = gnp_csr_multiply(&pencil->matrix, y + c * n, left, pool, NULL, error);
		for (size_t i = 0; i < n; i++)
			left[i] = pencil->mass[i] * x[c * n + i] - left[i];
	}
	if (status == GNP_OK)
		status = gnp_factor_solve(pencil->factor, pencil->left, BLOCK, pool, task, error);
	for (size_t i = 0; i < BLOCK * n && status == GNP_OK; i++)
		y[i] += pencil->left[i];
	return status;
}

gnp_status gnp_pencil_apply(const void *pencil, const double *x, double *y, struct gnp_pool *pool,
                            struct gnp_task *task, struct gnp_error *error)
{
	const struct gnp_pencil *with = pencil;
	size_t n = with->matrix.rows;
	for (size_t c = 0; c < BLOCK; c++)
		for (size_t i = 0; i < n; i++)
			y[c * n + i] = with->mass[i] * x[c * n + i];
	gnp_status status = gnp_factor_solve(with->factor, y, BLOCK, pool, task, error);
	return status == GNP_OK && with->left ? refine(with, x, y, pool, task, error) : status;
}
