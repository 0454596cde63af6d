#include "weights/train/muon.h"

#include <math.h>
#include <string.h>

#include "core/linear/linalg.h"

static const double SIZE = 0.2; /* root mean square of an entry of Adam's steps, about */

/* What one iteration works with: n the smaller side. */
struct room {
	size_t rows, columns, n;
	float *square, *mix; /* (n, n) */
	float *next;         /* (rows, columns) */
};

/* square = X X^T, or X^T X of a tall matrix. */
static void multiply_self(const struct room *room, const float *x)
{
	bool tall = room->rows > room->columns;
	gnp_linalg_gemm(tall ? GNP_TRANSPOSED : GNP_PLAIN, tall ? GNP_PLAIN : GNP_TRANSPOSED, room->n, room->n,
	                tall ? room->rows : room->columns, 1, x, room->columns, x, room->columns, 0, room->square, room->n);
}

/* X <- a X + (b S + c S S) X, or with the factor on the right. */
static void iterate(const struct room *room, float *x)
{
	static const float A = 3.4445f, B = -4.7750f, C = 2.0315f;
	size_t n = room->n, count = room->rows * room->columns;
	multiply_self(room, x);
	memcpy(room->mix, room->square, n * n * sizeof *x);
	memcpy(room->next, x, count * sizeof *x);
	gnp_linalg_gemm(GNP_PLAIN, GNP_PLAIN, n, n, n, C, room->square, n, room->square, n, B, room->mix, n);
	if (room->rows > room->columns)
		gnp_linalg_gemm(GNP_PLAIN, GNP_PLAIN, room->rows, n, n, 1, x, n, room->mix, n, A, room->next, n);
	else
		gnp_linalg_gemm(GNP_PLAIN, GNP_PLAIN, n, room->columns, n, 1, room->mix, n, x, room->columns, A, room->next,
		                room->columns);
	memcpy(x, room->next, count * sizeof *x);
}

gnp_status gnp_muon_orthogonalize(size_t rows, size_t columns, float *matrix, struct gnp_scratch *scratch,
                                  struct gnp_error *error)
{
	enum { ITERATIONS = 5 };
	size_t count = rows * columns, n = rows < columns ? rows : columns;
	double square = 0;
	struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
	struct room room = {rows,
	                    columns,
	                    n,
	                    gnp_scratch_take(scratch, n, n * sizeof *matrix),
	                    gnp_scratch_take(scratch, n, n * sizeof *matrix),
	                    gnp_scratch_take(scratch, count, sizeof *matrix)};
	if (!room.square || !room.mix || !room.next)
		return gnp_no_memory("muon", count, "entries", error);
	for (size_t i = 0; i < count; i++)
		square += (double)matrix[i] * (double)matrix[i];
	for (size_t i = 0; i < count && square > 0; i++)
		matrix[i] = (float)(matrix[i] / sqrt(square));
	for (int i = 0; i < ITERATIONS; i++)
		iterate(&room, matrix);
	gnp_scratch_release(scratch, mark);
	return GNP_OK;
}

bool gnp_muon_takes(const struct gnp_parameter_row *row)
{
	return row->rank == 2 && row->shape[0] >= GNP_MUON_SIDE && row->shape[1] >= GNP_MUON_SIDE;
}

struct update {
	const struct gnp_layout *layout;
	struct gnp_adam *adam;
	double rate;
	const float *gradient;
	float *parameters;
};

static gnp_status move_matrix(const struct update *update, const struct gnp_parameter_row *row,
                              struct gnp_scratch *scratch, struct gnp_error *error)
{
	const float *moment = update->adam->first + row->offset, *gradient = update->gradient + row->offset;
	float *at = update->parameters + row->offset;
	size_t longer = row->shape[0] > row->shape[1] ? row->shape[0] : row->shape[1];
	float step = (float)(update->rate * SIZE * sqrt((double)longer));
	struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
	float *ahead = gnp_scratch_take(scratch, row->count, sizeof *ahead);
	if (!ahead)
		return gnp_no_memory("muon", row->count, "entries", error);
	for (size_t i = 0; i < row->count; i++)
		ahead[i] = 0.9f * moment[i] + 0.1f * gradient[i];
	gnp_status status = gnp_muon_orthogonalize(row->shape[0], row->shape[1], ahead, scratch, error);
	for (size_t i = 0; i < row->count && status == GNP_OK; i++)
		at[i] -= step * ahead[i];
	gnp_scratch_release(scratch, mark);
	return status;
}

static gnp_status move_rows(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                            struct gnp_error *error)
{
	const struct update *update = context;
	gnp_status status = GNP_OK;
	for (size_t r = begin; r < end && status == GNP_OK; r++) {
		const struct gnp_parameter_row *row = &update->layout->row[r];
		if (gnp_muon_takes(row))
			status = move_matrix(update, row, scratch, error);
		else
			gnp_adam_move(update->adam, update->rate, row->offset, row->count, update->parameters);
	}
	return status;
}

gnp_status gnp_muon_update(const struct gnp_layout *layout, struct gnp_adam *adam, double rate, const float *gradient,
                           float *parameters, struct gnp_pool *pool, struct gnp_error *error)
{
	struct update update = {layout, adam, rate, gradient, parameters};
	gnp_adam_advance(adam, gradient);
	return gnp_pool_run(pool, NULL, layout->rows, 1, move_rows, &update, error);
}
