#include "core/linear/factor_plan.h"

#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/linear/dissection.h"

enum { SHARES = 32 }; /* a subtree has at most this part of all operations */

void gnp_factor_plan_clear(struct gnp_factor_plan *plan)
{
	gnp_symbolic_clear(&plan->symbolic);
	free(plan->step);
	free(plan->parent);
	free(plan->child_start);
	free(plan->child);
	free(plan->place);
	free(plan->value_start);
	free(plan->subtree);
	free(plan->shared);
	*plan = (struct gnp_factor_plan){.subtrees = 0};
}

/* Merges two ascending rows with the diagonal; column may be NULL to count alone. */
static size_t merge_row(const uint32_t *a, size_t a_count, const uint32_t *b, size_t b_count, uint32_t diagonal,
                        uint32_t *column)
{
	size_t i = 0, j = 0, count = 0;
	bool done = false;
	while (i < a_count || j < b_count || !done) {
		uint32_t least = done ? UINT32_MAX : diagonal;
		if (i < a_count && a[i] < least)
			least = a[i];
		if (j < b_count && b[j] < least)
			least = b[j];
		i += i < a_count && a[i] == least;
		j += j < b_count && b[j] == least;
		done |= least == diagonal;
		if (column)
			column[count] = least;
		count++;
	}
	return count;
}

/* The structure of A + A^T + I; it has no values. */
static gnp_status symmetric_pattern(const struct gnp_csr *matrix, struct gnp_csr *out, struct gnp_error *error)
{
	struct gnp_csr turned, pattern = {.rows = matrix->rows, .columns = matrix->rows};
	gnp_status status = gnp_csr_transpose(matrix, &turned, error);
	if (status != GNP_OK)
		return status;
	size_t n = matrix->rows;
	pattern.row_offsets = gnp_array_zero(n + 1, sizeof(size_t));
	for (int pass = 0; pass < 2 && pattern.row_offsets; pass++) {
		for (size_t i = 0; i < n; i++) {
			size_t a = matrix->row_offsets[i], b = turned.row_offsets[i];
			size_t count = merge_row(matrix->column + a, matrix->row_offsets[i + 1] - a, turned.column + b,
			                         turned.row_offsets[i + 1] - b, (uint32_t)i,
			                         pattern.column ? pattern.column + pattern.row_offsets[i] : NULL);
			pattern.row_offsets[i + 1] = pattern.row_offsets[i] + count;
		}
		if (pass == 0 && !(pattern.column = gnp_array_new(pattern.row_offsets[n], sizeof(uint32_t))))
			break;
	}
	gnp_csr_clear(&turned);
	if (!pattern.column) {
		gnp_csr_clear(&pattern);
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "factor: no memory for the pattern of %zu unknowns", n);
	}
	*out = pattern;
	return GNP_OK;
}

/* Which supernode takes in which, and where. */
static void link_fronts(struct gnp_factor_plan *plan, uint32_t *owner)
{
	const struct gnp_symbolic *symbolic = &plan->symbolic;
	for (size_t s = 0; s < symbolic->supernodes; s++)
		for (uint32_t k = symbolic->first[s]; k < symbolic->first[s + 1]; k++)
			owner[k] = (uint32_t)s;
	memset(plan->child_start, 0, (symbolic->supernodes + 1) * sizeof *plan->child_start);
	for (size_t s = 0; s < symbolic->supernodes; s++) {
		size_t border = symbolic->row_start[s] + gnp_factor_plan_width(plan, s), end = symbolic->row_start[s + 1];
		plan->parent[s] = border < end ? owner[symbolic->row[border]] : GNP_FACTOR_NONE;
		if (plan->parent[s] == GNP_FACTOR_NONE)
			continue;
		plan->child_start[plan->parent[s] + 1]++;
		size_t at = symbolic->row_start[plan->parent[s]], place = 0;
		for (size_t r = border; r < end; r++) {
			while (symbolic->row[at + place] != symbolic->row[r])
				place++;
			plan->place[r] = (uint32_t)place;
		}
	}
}

static void list_children(struct gnp_factor_plan *plan, uint32_t *next)
{
	size_t supernodes = plan->symbolic.supernodes;
	for (size_t s = 0; s < supernodes; s++)
		plan->child_start[s + 1] += plan->child_start[s];
	memcpy(next, plan->child_start, supernodes * sizeof *next);
	for (size_t s = 0; s < supernodes; s++)
		if (plan->parent[s] != GNP_FACTOR_NONE)
			plan->child[next[plan->parent[s]]++] = (uint32_t)s;
}

static size_t border_entries(const struct gnp_factor_plan *plan, size_t s)
{
	size_t border = gnp_factor_plan_rows(plan, s) - gnp_factor_plan_width(plan, s);
	return border * border;
}

static double front_operations(const struct gnp_factor_plan *plan, size_t s)
{
	double w = (double)gnp_factor_plan_width(plan, s), b = (double)gnp_factor_plan_rows(plan, s) - w;
	return (2 * w * w * w / 3 + 2 * w * w * b + 2 * w * b * b) / (plan->symmetric ? 2 : 1);
}

/* Subtrees are runs of supernodes in their postorder. peak: of each subtree while one worker makes it, in entries. */
static void choose_subtrees(struct gnp_factor_plan *plan, double *below, size_t *peak, size_t *largest_peak)
{
	size_t supernodes = plan->symbolic.supernodes;
	for (size_t s = 0; s < supernodes; s++) {
		size_t live = 0, most = 0;
		below[s] = front_operations(plan, s);
		for (uint32_t c = plan->child_start[s]; c < plan->child_start[s + 1]; c++) {
			uint32_t child = plan->child[c];
			below[s] += below[child];
			most = live + peak[child] > most ? live + peak[child] : most;
			live += border_entries(plan, child);
		}
		live += border_entries(plan, s);
		peak[s] = live > most ? live : most;
		plan->operations += front_operations(plan, s);
	}
	uint32_t begin = 0;
	for (size_t s = 0; s < supernodes; s++) {
		plan->shared[s] = below[s] > plan->operations / SHARES;
		bool top = plan->parent[s] == GNP_FACTOR_NONE || below[plan->parent[s]] > plan->operations / SHARES;
		if (!plan->shared[s] && top) {
			plan->subtree[2 * plan->subtrees] = begin;
			plan->subtree[2 * plan->subtrees++ + 1] = (uint32_t)s;
			*largest_peak = peak[s] > *largest_peak ? peak[s] : *largest_peak;
		}
		if (plan->shared[s] || top)
			begin = (uint32_t)s + 1;
	}
}

static void measure(struct gnp_factor_plan *plan, unsigned workers, size_t largest_peak)
{
	size_t live = 0, most = 0, n = plan->symbolic.count;
	for (size_t t = 0; t < plan->subtrees; t++)
		live += border_entries(plan, plan->subtree[2 * t + 1]);
	most = live + workers * largest_peak;
	for (size_t s = 0; s < plan->symbolic.supernodes; s++) {
		if (!plan->shared[s])
			continue;
		live += border_entries(plan, s);
		most = live > most ? live : most;
		for (uint32_t c = plan->child_start[s]; c < plan->child_start[s + 1]; c++)
			live -= border_entries(plan, plan->child[c]);
	}
	size_t rows = plan->symbolic.row_start[plan->symbolic.supernodes];
	plan->bytes = plan->value_start[plan->symbolic.supernodes] * sizeof(double) + 2 * rows * sizeof(uint32_t) +
	              n * (3 * sizeof(uint32_t) + sizeof(double)) + plan->symbolic.supernodes * 48;
	plan->peak_bytes = plan->bytes + most * sizeof(double);
}

static gnp_status lay_out(struct gnp_factor_plan *plan, unsigned workers, struct gnp_error *error)
{
	size_t n = plan->symbolic.count, supernodes = plan->symbolic.supernodes, largest_peak = 0;
	plan->step = gnp_array_new(n, sizeof *plan->step);
	plan->parent = gnp_array_new(supernodes, sizeof *plan->parent);
	plan->child_start = gnp_array_new(supernodes + 1, sizeof *plan->child_start);
	plan->child = gnp_array_new(supernodes, sizeof *plan->child);
	plan->place = gnp_array_new(plan->symbolic.row_start[supernodes], sizeof *plan->place);
	plan->value_start = gnp_array_new(supernodes + 1, sizeof *plan->value_start);
	plan->subtree = gnp_array_new(supernodes, 2 * sizeof *plan->subtree);
	plan->shared = gnp_array_new(supernodes, 1);
	uint32_t *spare = gnp_array_new(n + 1, sizeof *spare);
	double *below = gnp_array_new(supernodes, sizeof *below);
	size_t *peak = gnp_array_new(supernodes, sizeof *peak);
	bool room = plan->step && plan->parent && plan->child_start && plan->child && plan->place && plan->value_start &&
	            plan->subtree && plan->shared && spare && below && peak;
	if (room) {
		for (size_t k = 0; k < n; k++)
			plan->step[plan->symbolic.order[k]] = (uint32_t)k;
		plan->value_start[0] = 0;
		for (size_t s = 0; s < supernodes; s++) {
			size_t w = gnp_factor_plan_width(plan, s), rows = gnp_factor_plan_rows(plan, s);
			plan->value_start[s + 1] = plan->value_start[s] + w * (plan->symmetric ? rows : 2 * rows - w);
		}
		link_fronts(plan, spare);
		list_children(plan, spare);
		choose_subtrees(plan, below, peak, &largest_peak);
		measure(plan, workers, largest_peak);
	}
	free(spare);
	free(below);
	free(peak);
	return room ? GNP_OK : gnp_error_set(error, GNP_OUT_OF_MEMORY, "factor: no memory to plan %zu unknowns", n);
}

gnp_status gnp_factor_plan_make(const struct gnp_csr *matrix, bool symmetric, const double *points,
                                struct gnp_pool *pool, struct gnp_task *task, struct gnp_factor_plan *out,
                                struct gnp_error *error)
{
	struct gnp_factor_plan plan = {.symmetric = symmetric};
	struct gnp_csr pattern;
	gnp_status status = symmetric_pattern(matrix, &pattern, error);
	if (status != GNP_OK)
		return status;
	uint32_t *order = gnp_array_new(matrix->rows, sizeof *order);
	if (order)
		status = gnp_dissection_order(&pattern, points, pool, task, order, error);
	else
		status = gnp_error_set(error, GNP_OUT_OF_MEMORY, "factor: no memory to order %zu unknowns", matrix->rows);
	if (status == GNP_OK)
		status = gnp_sparse_analyse(&pattern, order, &plan.symbolic, error);
	free(order);
	gnp_csr_clear(&pattern);
	if (status == GNP_OK)
		status = lay_out(&plan, gnp_pool_workers(pool), error);
	if (status == GNP_OK)
		*out = plan;
	else
		gnp_factor_plan_clear(&plan);
	return status;
}
