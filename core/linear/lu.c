#include "core/linear/lu.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/linear/linalg.h"
#include "core/linear/lu_front.h"

enum { COLUMNS_A_CHUNK = GNP_LU_FRONT_COLUMNS, RIGHT_SIDES_A_BLOCK = 8 };
static const double smallest_pivot = 1e-14; /* rows are scaled to largest entries of 1, symmetric matrices to a diagonal of 1 */

struct gnp_lu {
	struct gnp_lu_plan plan;
	double *value;   /* panel and, unless symmetric, U12 of each supernode, from plan.value_start[s] */
	uint32_t *pivot; /* (n) within each front */
	double *scale;   /* (n) factor of each row of the matrix, and of each column where symmetric */
};

void gnp_lu_free(struct gnp_lu *lu)
{
	if (!lu)
		return;
	gnp_lu_plan_clear(&lu->plan);
	free(lu->value);
	free(lu->pivot);
	free(lu->scale);
	free(lu);
}

size_t gnp_lu_bytes(const struct gnp_lu *lu)
{
	return lu->plan.bytes;
}

struct numeric {
	struct gnp_lu *lu;
	const struct gnp_csr *matrix, *turned; /* and its transpose */
	double **border;                       /* (supernodes) blocks not yet taken in by parents */
	struct gnp_task *task;
};

static struct gnp_lu_front front_of(const struct numeric *work, size_t s)
{
	const struct gnp_lu *lu = work->lu;
	size_t rows = gnp_lu_plan_rows(&lu->plan, s), width = gnp_lu_plan_width(&lu->plan, s);
	double *panel = lu->value + lu->plan.value_start[s];
	return (struct gnp_lu_front){.symmetric = lu->plan.symmetric, .rows = rows, .width = width, .border = rows - width, .panel = panel,
	                             .over = lu->plan.symmetric ? NULL : panel + rows * width,
	                             .border_block = work->border[s], .pivot = lu->pivot + lu->plan.symbolic.first[s]};
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
static void add_symmetric_entries(const struct numeric *work, size_t s, struct gnp_lu_front *front)
{
	const struct gnp_lu *lu = work->lu;
	const struct gnp_symbolic *symbolic = &lu->plan.symbolic;
	for (uint32_t k = symbolic->first[s]; k < symbolic->first[s + 1]; k++) {
		size_t i = symbolic->order[k];
		double *column = front->panel + (k - symbolic->first[s]) * front->rows;
		for (size_t e = work->matrix->row_offsets[i]; e < work->matrix->row_offsets[i + 1]; e++) {
			uint32_t j = work->matrix->column[e], step = lu->plan.step[j];
			if (step >= k)
				column[place_of(symbolic, s, step)] += lu->scale[i] * lu->scale[j] * work->matrix->value[e];
		}
	}
}

/* Entries of the matrix whose row or column is a pivot here and the other no earlier one. */
static void add_entries(const struct numeric *work, size_t s, struct gnp_lu_front *front)
{
	const struct gnp_lu *lu = work->lu;
	const struct gnp_symbolic *symbolic = &lu->plan.symbolic;
	uint32_t first = symbolic->first[s], last = symbolic->first[s + 1];
	for (uint32_t k = first; k < last; k++) {
		size_t i = symbolic->order[k], own = k - first;
		for (size_t e = work->matrix->row_offsets[i]; e < work->matrix->row_offsets[i + 1]; e++) {
			uint32_t step = lu->plan.step[work->matrix->column[e]];
			if (step < first)
				continue;
			size_t place = place_of(symbolic, s, step);
			double value = lu->scale[i] * work->matrix->value[e];
			if (place < front->width)
				front->panel[own + place * front->rows] += value;
			else
				front->over[own + (place - front->width) * front->width] += value;
		}
		for (size_t e = work->turned->row_offsets[i]; e < work->turned->row_offsets[i + 1]; e++) {
			uint32_t row = work->turned->column[e], step = lu->plan.step[row];
			if (step >= last)
				front->panel[place_of(symbolic, s, step) + own * front->rows] += lu->scale[row] * work->turned->value[e];
		}
	}
}

static gnp_status open_front(struct numeric *work, size_t s, struct gnp_lu_front *front, struct gnp_error *error)
{
	const struct gnp_lu_plan *plan = &work->lu->plan;
	size_t border = gnp_lu_plan_rows(plan, s) - gnp_lu_plan_width(plan, s);
	gnp_status status = gnp_task_check(work->task, error);
	if (status != GNP_OK)
		return status;
	work->border[s] = gnp_array_zero(border * border, sizeof(double));
	if (!work->border[s])
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "factor: no memory for a front of %zu rows", gnp_lu_plan_rows(plan, s));
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

static gnp_status pivot_front(const struct numeric *work, size_t s, struct gnp_lu_front *front, struct gnp_error *error)
{
	const struct gnp_symbolic *symbolic = &work->lu->plan.symbolic;
	size_t done = gnp_lu_front_pivot(front, smallest_pivot);
	if (done < front->width)
		return gnp_error_set(error, GNP_SINGULAR, "system: no pivot above %g at step %zu of %zu, the matrix is singular or not finite",
		                     smallest_pivot, symbolic->first[s] + done + 1, symbolic->count);
	return GNP_OK;
}

static gnp_status make_front(struct numeric *work, size_t s, struct gnp_error *error)
{
	const struct gnp_lu_plan *plan = &work->lu->plan;
	struct gnp_lu_front front;
	gnp_status status = open_front(work, s, &front, error);
	if (status != GNP_OK)
		return status;
	for (uint32_t c = plan->child_start[s]; c < plan->child_start[s + 1]; c++) {
		uint32_t child = plan->child[c];
		size_t width = gnp_lu_plan_width(plan, child), border = gnp_lu_plan_rows(plan, child) - width;
		gnp_lu_front_add(&front, work->border[child], border, plan->place + plan->symbolic.row_start[child] + width, 0, border);
		drop_child(work, child);
	}
	status = pivot_front(work, s, &front, error);
	if (status != GNP_OK)
		return status;
	gnp_lu_front_rows(&front, 0, front.border);
	gnp_lu_front_columns(&front, 0, front.border);
	gnp_task_advance(work->task, 1);
	return GNP_OK;
}

static gnp_status subtrees_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	struct numeric *work = context;
	const struct gnp_lu_plan *plan = &work->lu->plan;
	gnp_status status = GNP_OK;
	(void)scratch;
	for (size_t t = begin; t < end; t++)
		for (size_t s = plan->subtree[2 * t]; s <= plan->subtree[2 * t + 1] && status == GNP_OK; s++)
			status = make_front(work, s, error);
	return status;
}

/* A front above the subtrees, cut up for all workers. */
struct shared_front {
	struct gnp_lu_front front;
	const double *block; /* of the child being added */
	const uint32_t *place;
	size_t border;
};

static gnp_status add_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	struct shared_front *shared = context;
	(void)scratch;
	(void)error;
	gnp_lu_front_add(&shared->front, shared->block, shared->border, shared->place, begin, end);
	return GNP_OK;
}

static gnp_status rows_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	struct shared_front *shared = context;
	(void)scratch;
	(void)error;
	gnp_lu_front_rows(&shared->front, begin, end);
	return GNP_OK;
}

static gnp_status columns_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	struct shared_front *shared = context;
	(void)scratch;
	(void)error;
	gnp_lu_front_columns(&shared->front, begin, end);
	return GNP_OK;
}

static gnp_status make_shared_front(struct numeric *work, size_t s, struct gnp_pool *pool, struct gnp_error *error)
{
	const struct gnp_lu_plan *plan = &work->lu->plan;
	struct shared_front shared;
	gnp_status status = open_front(work, s, &shared.front, error);
	for (uint32_t c = plan->child_start[s]; c < plan->child_start[s + 1] && status == GNP_OK; c++) {
		uint32_t child = plan->child[c];
		size_t width = gnp_lu_plan_width(plan, child);
		shared.border = gnp_lu_plan_rows(plan, child) - width;
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

static gnp_status factor(struct numeric *work, struct gnp_pool *pool, struct gnp_error *error)
{
	const struct gnp_lu_plan *plan = &work->lu->plan;
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

gnp_status gnp_lu_factor_take(const struct gnp_csr *matrix, struct gnp_lu_plan *plan, struct gnp_pool *pool, struct gnp_task *task,
                              struct gnp_lu **out, struct gnp_error *error)
{
	size_t n = matrix->rows, supernodes = plan->symbolic.supernodes;
	struct gnp_csr turned = {.rows = 0};
	struct gnp_lu *lu = gnp_array_zero(1, sizeof *lu);
	double **border = gnp_array_zero(supernodes, sizeof *border);
	gnp_status status = plan->symmetric ? GNP_OK : gnp_csr_transpose(matrix, &turned, error);
	if (!lu) {
		gnp_lu_plan_clear(plan);
	} else {
		lu->plan = *plan;
		*plan = (struct gnp_lu_plan){.subtrees = 0};
		lu->value = gnp_array_new(lu->plan.value_start[supernodes], sizeof *lu->value);
		lu->pivot = gnp_array_new(n, sizeof *lu->pivot);
		lu->scale = gnp_array_new(n, sizeof *lu->scale);
	}
	if (status == GNP_OK && (!lu || !border || !lu->value || !lu->pivot || !lu->scale))
		status = gnp_error_set(error, GNP_OUT_OF_MEMORY, "factor: no memory for %zu unknowns", n);
	if (status == GNP_OK) {
		struct numeric work = {lu, matrix, &turned, border, task};
		if (lu->plan.symmetric)
			scale_symmetric(matrix, lu->scale);
		else
			scale_rows(matrix, lu->scale);
		status = factor(&work, pool, error);
	}
	gnp_csr_clear(&turned);
	free(border);
	if (status == GNP_OK)
		*out = lu;
	else
		gnp_lu_free(lu);
	return status;
}

/* Solutions of a block of right-hand sides, column-major in elimination order. */
struct solution {
	const struct gnp_lu *lu;
	size_t count;
	double *x;     /* (n, count) */
	double *carry; /* (row_start[supernodes], count): at a supernode's rows what its border passes on */
};

static void exchange(const uint32_t *pivot, size_t width, double *x, size_t leading, size_t count)
{
	for (size_t c = 0; c < count; c++, x += leading)
		for (size_t k = 0; k < width; k++) {
			double kept = x[k];
			x[k] = x[pivot[k]];
			x[pivot[k]] = kept;
		}
}

/* Rows of the front: own ones in x, border ones in the carry, which takes in the children's. */
static void forward(const struct solution *work, size_t s)
{
	const struct gnp_lu *lu = work->lu;
	const struct gnp_lu_plan *plan = &lu->plan;
	const struct gnp_symbolic *symbolic = &plan->symbolic;
	size_t n = symbolic->count, rows = gnp_lu_plan_rows(plan, s), width = gnp_lu_plan_width(plan, s), border = rows - width;
	const double *panel = lu->value + plan->value_start[s];
	double *own = work->x + symbolic->first[s], *carry = work->carry + symbolic->row_start[s] * work->count;
	memset(carry, 0, border * work->count * sizeof *carry);
	for (uint32_t c = plan->child_start[s]; c < plan->child_start[s + 1]; c++) {
		uint32_t child = plan->child[c];
		size_t inner = gnp_lu_plan_width(plan, child), passed = gnp_lu_plan_rows(plan, child) - inner;
		const uint32_t *place = plan->place + symbolic->row_start[child] + inner;
		const double *from = work->carry + symbolic->row_start[child] * work->count;
		for (size_t b = 0; b < work->count; b++)
			for (size_t i = 0; i < passed; i++) {
				double *to = place[i] < width ? own + b * n + place[i] : carry + b * border + place[i] - width;
				*to += from[b * passed + i];
			}
	}
	if (plan->symmetric) {
		gnp_linalg_solve_cholesky(GNP_PLAIN, width, work->count, panel, rows, own, n);
	} else {
		exchange(lu->pivot + symbolic->first[s], width, own, n, work->count);
		gnp_linalg_solve_lower(width, work->count, panel, rows, own, n);
	}
	gnp_linalg_subtract_product(border, work->count, width, panel + width, rows, own, n, carry, border);
}

static void backward(const struct solution *work, size_t s)
{
	const struct gnp_lu *lu = work->lu;
	const struct gnp_lu_plan *plan = &lu->plan;
	const struct gnp_symbolic *symbolic = &plan->symbolic;
	size_t n = symbolic->count, rows = gnp_lu_plan_rows(plan, s), width = gnp_lu_plan_width(plan, s), border = rows - width;
	const double *panel = lu->value + plan->value_start[s];
	double *own = work->x + symbolic->first[s], *later = work->carry + symbolic->row_start[s] * work->count;
	for (size_t b = 0; b < work->count; b++)
		for (size_t i = 0; i < border; i++)
			later[b * border + i] = work->x[b * n + symbolic->row[symbolic->row_start[s] + width + i]];
	if (plan->symmetric) {
		gnp_linalg_subtract_transposed_product(width, work->count, border, panel + width, rows, later, border, own, n);
		gnp_linalg_solve_cholesky(GNP_TRANSPOSED, width, work->count, panel, rows, own, n);
	} else {
		gnp_linalg_subtract_product(width, work->count, border, panel + rows * width, width, later, border, own, n);
		gnp_linalg_solve_upper(width, work->count, panel, rows, own, n);
	}
}

static gnp_status forward_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	const struct solution *work = context;
	(void)scratch;
	(void)error;
	for (size_t t = begin; t < end; t++)
		for (size_t s = work->lu->plan.subtree[2 * t]; s <= work->lu->plan.subtree[2 * t + 1]; s++)
			forward(work, s);
	return GNP_OK;
}

static gnp_status backward_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	const struct solution *work = context;
	(void)scratch;
	(void)error;
	for (size_t t = begin; t < end; t++)
		for (size_t s = (size_t)work->lu->plan.subtree[2 * t + 1] + 1; s-- > work->lu->plan.subtree[2 * t];)
			backward(work, s);
	return GNP_OK;
}

static gnp_status sweep(struct solution *work, struct gnp_pool *pool, struct gnp_error *error)
{
	const struct gnp_lu_plan *plan = &work->lu->plan;
	gnp_status status = gnp_pool_run(pool, NULL, plan->subtrees, 1, forward_chunk, work, error);
	if (status != GNP_OK)
		return status;
	for (size_t s = 0; s < plan->symbolic.supernodes; s++)
		if (plan->shared[s])
			forward(work, s);
	for (size_t s = plan->symbolic.supernodes; s-- > 0;)
		if (plan->shared[s])
			backward(work, s);
	return gnp_pool_run(pool, NULL, plan->subtrees, 1, backward_chunk, work, error);
}

static gnp_status solve_block(struct solution *work, double *x, struct gnp_pool *pool, struct gnp_error *error)
{
	const struct gnp_lu *lu = work->lu;
	size_t n = lu->plan.symbolic.count;
	const uint32_t *order = lu->plan.symbolic.order;
	for (size_t b = 0; b < work->count; b++)
		for (size_t k = 0; k < n; k++)
			work->x[b * n + k] = lu->scale[order[k]] * x[b * n + order[k]];
	gnp_status status = sweep(work, pool, error);
	for (size_t b = 0; b < work->count; b++)
		for (size_t k = 0; k < n; k++)
			x[b * n + order[k]] = (lu->plan.symmetric ? lu->scale[order[k]] : 1) * work->x[b * n + k];
	return status;
}

gnp_status gnp_lu_solve(const struct gnp_lu *lu, double *x, size_t count, struct gnp_pool *pool, struct gnp_task *task,
                        struct gnp_error *error)
{
	size_t n = lu->plan.symbolic.count, rows = lu->plan.symbolic.row_start[lu->plan.symbolic.supernodes];
	size_t block = count < RIGHT_SIDES_A_BLOCK ? count : RIGHT_SIDES_A_BLOCK;
	struct solution work = {.lu = lu, .x = gnp_array_new(n * block, sizeof(double)), .carry = gnp_array_new(rows * block, sizeof(double))};
	gnp_status status = GNP_OK;
	if (!work.x || !work.carry)
		status = gnp_error_set(error, GNP_OUT_OF_MEMORY, "solve: no memory for %zu right-hand sides", block);
	for (size_t begin = 0; begin < count && status == GNP_OK; begin += block) {
		work.count = count - begin < block ? count - begin : block;
		status = gnp_task_check(task, error);
		if (status == GNP_OK)
			status = solve_block(&work, x + begin * n, pool, error);
	}
	free(work.x);
	free(work.carry);
	return status;
}
