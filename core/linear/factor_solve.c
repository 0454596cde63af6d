#include "core/linear/factor_solve.h"

#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/linear/factor_parts.h"
#include "core/linear/linalg.h"

enum { RIGHT_SIDES_A_BLOCK = 8 };

/* Solutions of a block of right-hand sides, column-major in elimination order. */
struct solution {
	const struct gnp_factor *factor;
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
	const struct gnp_factor *factor = work->factor;
	const struct gnp_factor_plan *plan = &factor->plan;
	const struct gnp_symbolic *symbolic = &plan->symbolic;
	size_t n = symbolic->count, rows = gnp_factor_plan_rows(plan, s), width = gnp_factor_plan_width(plan, s);
	size_t border = rows - width;
	const double *panel = factor->value + plan->value_start[s];
	double *own = work->x + symbolic->first[s], *carry = work->carry + symbolic->row_start[s] * work->count;
	memset(carry, 0, border * work->count * sizeof *carry);
	for (uint32_t c = plan->child_start[s]; c < plan->child_start[s + 1]; c++) {
		uint32_t child = plan->child[c];
		size_t inner = gnp_factor_plan_width(plan, child), passed = gnp_factor_plan_rows(plan, child) - inner;
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
		exchange(factor->pivot + symbolic->first[s], width, own, n, work->count);
		gnp_linalg_solve_lower(width, work->count, panel, rows, own, n);
	}
	gnp_linalg_subtract_product(border, work->count, width, panel + width, rows, own, n, carry, border);
}

static void backward(const struct solution *work, size_t s)
{
	const struct gnp_factor *factor = work->factor;
	const struct gnp_factor_plan *plan = &factor->plan;
	const struct gnp_symbolic *symbolic = &plan->symbolic;
	size_t n = symbolic->count, rows = gnp_factor_plan_rows(plan, s), width = gnp_factor_plan_width(plan, s);
	size_t border = rows - width;
	const double *panel = factor->value + plan->value_start[s];
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

static gnp_status forward_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                struct gnp_error *error)
{
	const struct solution *work = context;
	(void)scratch;
	(void)error;
	for (size_t t = begin; t < end; t++)
		for (size_t s = work->factor->plan.subtree[2 * t]; s <= work->factor->plan.subtree[2 * t + 1]; s++)
			forward(work, s);
	return GNP_OK;
}

static gnp_status backward_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                 struct gnp_error *error)
{
	const struct solution *work = context;
	(void)scratch;
	(void)error;
	for (size_t t = begin; t < end; t++)
		for (size_t s = (size_t)work->factor->plan.subtree[2 * t + 1] + 1; s-- > work->factor->plan.subtree[2 * t];)
			backward(work, s);
	return GNP_OK;
}

static gnp_status sweep(struct solution *work, struct gnp_pool *pool, struct gnp_error *error)
{
	const struct gnp_factor_plan *plan = &work->factor->plan;
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
	const struct gnp_factor *factor = work->factor;
	size_t n = factor->plan.symbolic.count;
	const uint32_t *order = factor->plan.symbolic.order;
	for (size_t b = 0; b < work->count; b++)
		for (size_t k = 0; k < n; k++)
			work->x[b * n + k] = factor->scale[order[k]] * x[b * n + order[k]];
	gnp_status status = sweep(work, pool, error);
	for (size_t b = 0; b < work->count; b++)
		for (size_t k = 0; k < n; k++)
			x[b * n + order[k]] = (factor->plan.symmetric ? factor->scale[order[k]] : 1) * work->x[b * n + k];
	return status;
}

gnp_status gnp_factor_solve(const struct gnp_factor *factor, double *x, size_t count, struct gnp_pool *pool,
                            struct gnp_task *task, struct gnp_error *error)
{
	size_t n = factor->plan.symbolic.count, rows = factor->plan.symbolic.row_start[factor->plan.symbolic.supernodes];
	size_t block = count < RIGHT_SIDES_A_BLOCK ? count : RIGHT_SIDES_A_BLOCK;
	struct solution work = {.factor = factor, .x = gnp_array_new(n * block, sizeof(double)),
	                        .carry = gnp_array_new(rows * block, sizeof(double))};
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
