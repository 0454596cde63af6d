#include "core/linear/factor.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/linear/factor_front.h"
#include "core/linear/factor_parts.h"
#include "core/linear/linalg.h"

enum { COLUMNS_A_CHUNK = GNP_FACTOR_FRONT_COLUMNS };
/* Rows are scaled to largest entries of 1, symmetric matrices to a diagonal of 1. */
static const double smallest_pivot = 1e-14;

void gnp_factor_free(struct gnp_factor *factor)
{
	if (!factor)
		return;
	gnp_factor_plan_clear(&factor->plan);
	free(factor->value);
	free(factor->pivot);
	free(factor->scale);
	free(factor);
}

size_t gnp_factor_bytes(const struct gnp_factor *factor)
{
	return factor->plan.bytes;
}

struct numeric {
	struct gnp_factor *factor;
	const struct gnp_csr *matrix, *turned; /* and its transpose */
	double **border;                       /* (supernodes) blocks not yet taken in by parents */
	struct gnp_task *task;
};

static struct gnp_factor_front front_of(const struct numeric *work, size_t s)
{
	const struct gnp_factor *factor = work->factor;
	size_t rows = gnp_factor_plan_rows(&factor->plan, s), width = gnp_factor_plan_width(&factor->plan, s);
	double *panel = factor->value + factor->plan.value_start[s];
	return (struct gnp_factor_front){.symmetric = factor->plan.symmetric, .rows = rows, .width = width,
	                                 .border = rows - width, .panel = panel,
	                                 .over = factor->plan.symmetric ? NULL : panel + rows * width,
	                                 .border_block = work->border[s],
	                                 .pivot = factor->pivot + factor->plan.symbolic.first[s]};
}

/* Where a step sits among a supernode's rows, which hold it. */
static size_t place_of(const struct gnp_symbolic *symbolic, size_t s, uint32_t step)
{
	size_t low = symbolic->row_start[s], high = symbolic->row_start[s + 1] - 1;
	if (step < symbolic->first[s + 1])
		return step - symbolic->first[s];
	while (low < high) {
		size_t middle = (low + high) / 2;
		if (symbolic->row[middle] < step)
			low = middle + 1;
		else
			high = middle;
	}
	return low - symbolic->row_start[s];
}

/* Entries on and below the diagonal whose column is a pivot here: as they stand in its row. */
static void add_symmetric_entries(const struct numeric *work, size_t s, struct gnp_factor_front *front)
{
	const struct gnp_factor *factor = work->factor;
	const struct gnp_symbolic *symbolic = &factor->plan.symbolic;
	for (uint32_t k = symbolic->first[s]; k < symbolic->first[s + 1]; k++) {
		size_t i = symbolic->order[k];
		double *column = front->panel + (k - symbolic->first[s]) * front->rows;
		for (size_t e = work->matrix->row_offsets[i]; e < work->matrix->row_offsets[i + 1]; e++) {
			uint32_t j = work->matrix->column[e], step = factor->plan.step[j];
			if (step >= k)
				column[place_of(symbolic, s, step)] += factor->scale[i] * factor->scale[j] * work->matrix->value[e];
		}
	}
}

/* Entries of the matrix whose row or column is a pivot here and the other no earlier one. */
static void add_entries(const struct numeric *work, size_t s, struct gnp_factor_front *front)
{
	const struct gnp_factor *factor = work->factor;
	const struct gnp_symbolic *symbolic = &factor->plan.symbolic;
	uint32_t first = symbolic->first[s], last = symbolic->first[s + 1];
	for (uint32_t k = first; k < last; k++) {
		size_t i = symbolic->order[k], own = k - first;
		for (size_t e = work->matrix->row_offsets[i]; e < work->matrix->row_offsets[i + 1]; e++) {
			uint32_t step = factor->plan.step[work->matrix->column[e]];
			if (step < first)
				continue;
			size_t place = place_of(symbolic, s, step);
			double value = factor->scale[i] * work->matrix->value[e];
			if (place < front->width)
				front->panel[own + place * front->rows] += value;
			else
				front->over[own + (place - front->width) * front->width] += value;
		}
		for (size_t e = work->turned->row_offsets[i]; e < work->turned->row_offsets[i + 1]; e++) {
			uint32_t row = work->turned->column[e], step = factor->plan.step[row];
			if (step >= last)
				front->panel[own * front->rows + place_of(symbolic, s, step)] +=
					factor->scale[row] * work->turned->value[e];
		}
	}
}

static gnp_status open_front(struct numeric *work, size_t s, struct gnp_factor_front *front, struct gnp_error *error)
{
	const struct gnp_factor_plan *plan = &work->factor->plan;
	size_t border = gnp_factor_plan_rows(plan, s) - gnp_factor_plan_width(plan, s);
	gnp_status status = gnp_task_check(work->task, error);
	if (status != GNP_OK)
		return status;
	work->border[s] = gnp_array_zero(border * border, sizeof(double));
	if (!work->border[s])
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "factor: no memory for a front of %zu rows",
		                     gnp_factor_plan_rows(plan, s));
	*front = front_of(work, s);
	memset(front->panel, 0, (plan->value_start[s + 1] - plan->value_start[s]) * sizeof(double));
	if (front->symmetric)
		add_symmetric_entries(work, s, front);
	else
		add_entries(work, s, front);
	return GNP_OK;
}

static void drop_child(struct numeric *work, uint32_t child)
{
	free(work->border[child]);
	work->border[child] = NULL;
}

static gnp_status pivot_front(const struct numeric *work, size_t s, struct gnp_factor_front *front,
                              struct gnp_error *error)
{
	const struct gnp_symbolic *symbolic = &work->factor->plan.symbolic;
	size_t done = gnp_factor_front_pivot(front, smallest_pivot);
	if (done < front->width)
		return gnp_error_set(error, GNP_SINGULAR,
		                     "system: no pivot above %g at step %zu of %zu, the matrix is singular or not finite",
		                     smallest_pivot, symbolic->first[s] + done + 1, symbolic->count);
	return GNP_OK;
}

static gnp_status make_front(struct numeric *work, size_t s, struct gnp_error *error)
{
	const struct gnp_factor_plan *plan = &work->factor->plan;
	struct gnp_factor_front front;
	gnp_status status = open_front(work, s, &front, error);
	if (status != GNP_OK)
		return status;
	for (uint32_t c = plan->child_start[s]; c < plan->child_start[s + 1]; c++) {
		uint32_t child = plan->child[c];
		size_t width = gnp_factor_plan_width(plan, child), border = gnp_factor_plan_rows(plan, child) - width;
		gnp_factor_front_add(&front, work->border[child], border,
		                     plan->place + plan->symbolic.row_start[child] + width, 0, border);
		drop_child(work, child);
	}
	status = pivot_front(work, s, &front, error);
	if (status != GNP_OK)
		return status;
	gnp_factor_front_rows(&front, 0, front.border);
	gnp_factor_front_columns(&front, 0, front.border);
	gnp_task_advance(work->task, 1);
	return GNP_OK;
}

static gnp_status subtrees_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                 struct gnp_error *error)
{
	struct numeric *work = context;
	const struct gnp_factor_plan *plan = &work->factor->plan;
	gnp_status status = GNP_OK;
	(void)scratch;
	for (size_t t = begin; t < end; t++)
		for (size_t s = plan->subtree[2 * t]; s <= plan->subtree[2 * t + 1] && status == GNP_OK; s++)
			status = make_front(work, s, error);
	return status;
}

/* A front above the subtrees, cut up for all workers. */
struct shared_front {
	struct gnp_factor_front front;
	const double *block; /* of the child being added */
	const uint32_t *place;
	size_t border;
};

static gnp_status add_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                            struct gnp_error *error)
{
	struct shared_front *shared = context;
	(void)scratch;
	(void)error;
	gnp_factor_front_add(&shared->front, shared->block, shared->border, shared->place, begin, end);
	return GNP_OK;
}

static gnp_status rows_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                             struct gnp_error *error)
{
	struct shared_front *shared = context;
	(void)scratch;
	(void)error;
	gnp_factor_front_rows(&shared->front, begin, end);
	return GNP_OK;
}

static gnp_status columns_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                struct gnp_error *error)
{
	struct shared_front *shared = context;
	(void)scratch;
	(void)error;
	gnp_factor_front_columns(&shared->front, begin, end);
	return GNP_OK;
}

static gnp_status make_shared_front(struct numeric *work, size_t s, struct gnp_pool *pool, struct gnp_error *error)
{
	const struct gnp_factor_plan *plan = &work->factor->plan;
	struct shared_front shared;
	gnp_status status = open_front(work, s, &shared.front, error);
	for (uint32_t c = plan->child_start[s]; c < plan->child_start[s + 1] && status == GNP_OK; c++) {
		uint32_t child = plan->child[c];
		size_t width = gnp_factor_plan_width(plan, child);
		shared.border = gnp_factor_plan_rows(plan, child) - width;
		shared.block = work->border[child];
		shared.place = plan->place + plan->symbolic.row_start[child] + width;
		status = gnp_pool_run(pool, NULL, shared.border, COLUMNS_A_CHUNK, add_chunk, &shared, error);
		drop_child(work, child);
	}
	if (status == GNP_OK)
		status = pivot_front(work, s, &shared.front, error);
	if (status == GNP_OK)
		status = gnp_pool_run(pool, NULL, shared.front.border, COLUMNS_A_CHUNK, rows_chunk, &shared, error);
	if (status == GNP_OK)
		status = gnp_pool_run(pool, NULL, shared.front.border, COLUMNS_A_CHUNK, columns_chunk, &shared, error);
	gnp_task_advance(work->task, 1);
	return status;
}

static gnp_status eliminate(struct numeric *work, struct gnp_pool *pool, struct gnp_error *error)
{
	const struct gnp_factor_plan *plan = &work->factor->plan;
	gnp_status status = gnp_pool_run(pool, NULL, plan->subtrees, 1, subtrees_chunk, work, error);
	for (size_t s = 0; s < plan->symbolic.supernodes && status == GNP_OK; s++)
		if (plan->shared[s])
			status = make_shared_front(work, s, pool, error);
	for (size_t s = 0; s < plan->symbolic.supernodes; s++)
		free(work->border[s]);
	return status;
}

/* To a diagonal of 1. */
static void scale_symmetric(const struct gnp_csr *matrix, double *scale)
{
	for (size_t i = 0; i < matrix->rows; i++) {
		double diagonal = 0;
		for (size_t e = matrix->row_offsets[i]; e < matrix->row_offsets[i + 1]; e++)
			diagonal += matrix->column[e] == i ? matrix->value[e] : 0;
		scale[i] = diagonal > 0 ? 1 / sqrt(diagonal) : 1;
	}
}

/* Each row by its largest entry. */
static void scale_rows(const struct gnp_csr *matrix, double *scale)
{
	for (size_t i = 0; i < matrix->rows; i++) {
		double largest = 0;
		for (size_t e = matrix->row_offsets[i]; e < matrix->row_offsets[i + 1]; e++)
			largest = fmax(largest, fabs(matrix->value[e]));
		scale[i] = largest > 0 ? 1 / largest : 1;
	}
}

gnp_status gnp_factor_make_take(const struct gnp_csr *matrix, struct gnp_factor_plan *plan, struct gnp_pool *pool,
                                struct gnp_task *task, struct gnp_factor **out, struct gnp_error *error)
{
	size_t n = matrix->rows, supernodes = plan->symbolic.supernodes;
	struct gnp_csr turned = {.rows = 0};
	struct gnp_factor *factor = gnp_array_zero(1, sizeof *factor);
	double **border = gnp_array_zero(supernodes, sizeof *border);
	gnp_status status = plan->symmetric ? GNP_OK : gnp_csr_transpose(matrix, &turned, error);
	if (!factor) {
		gnp_factor_plan_clear(plan);
	} else {
		factor->plan = *plan;
		*plan = (struct gnp_factor_plan){.subtrees = 0};
		factor->value = gnp_array_new(factor->plan.value_start[supernodes], sizeof *factor->value);
		factor->pivot = gnp_array_new(n, sizeof *factor->pivot);
		factor->scale = gnp_array_new(n, sizeof *factor->scale);
	}
	if (status == GNP_OK && (!factor || !border || !factor->value || !factor->pivot || !factor->scale))
		status = gnp_error_set(error, GNP_OUT_OF_MEMORY, "factor: no memory for %zu unknowns", n);
	if (status == GNP_OK) {
		struct numeric work = {factor, matrix, &turned, border, task};
		if (factor->plan.symmetric)
			scale_symmetric(matrix, factor->scale);
		else
			scale_rows(matrix, factor->scale);
		status = eliminate(&work, pool, error);
	}
	gnp_csr_clear(&turned);
	free(border);
	if (status == GNP_OK)
		*out = factor;
	else
		gnp_factor_free(factor);
	return status;
}
