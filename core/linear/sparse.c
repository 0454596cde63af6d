#include "core/linear/sparse.h"

#include <stdlib.h>
#include <string.h>
#include <suitesparse/cholmod.h>

#include "core/base/memory.h"

void gnp_symbolic_clear(struct gnp_symbolic *symbolic)
{
	free(symbolic->order);
	free(symbolic->first);
	free(symbolic->row_start);
	free(symbolic->row);
	*symbolic = (struct gnp_symbolic){.count = 0};
}

/* The upper triangle by columns, as CHOLMOD takes a symmetric matrix: a column is a row here. */
static cholmod_sparse *upper_pattern(const struct gnp_csr *pattern, cholmod_common *common)
{
	size_t n = pattern->rows, at = 0;
	cholmod_sparse *upper = cholmod_l_allocate_sparse(n, n, pattern->row_offsets[n] / 2 + n, true, true, 1,
	                                                  CHOLMOD_PATTERN, common);
	if (!upper)
		return NULL;
	SuiteSparse_long *start = upper->p, *row = upper->i;
	for (size_t j = 0; j < n; j++) {
		start[j] = (SuiteSparse_long)at;
		for (size_t e = pattern->row_offsets[j]; e < pattern->row_offsets[j + 1] && pattern->column[e] <= j; e++)
			row[at++] = (SuiteSparse_long)pattern->column[e];
	}
	start[n] = (SuiteSparse_long)at;
	return upper;
}

static cholmod_factor *analyse(const struct gnp_csr *pattern, const uint32_t *order, cholmod_common *common)
{
	cholmod_factor *factor = NULL;
	SuiteSparse_long *given = gnp_array_new(pattern->rows, sizeof *given);
	cholmod_sparse *upper = given ? upper_pattern(pattern, common) : NULL;
	if (upper) {
		for (size_t k = 0; k < pattern->rows; k++)
			given[k] = (SuiteSparse_long)order[k];
		factor = cholmod_l_analyze_p(upper, given, NULL, 0, common);
	}
	cholmod_l_free_sparse(&upper, common);
	free(given);
	return factor;
}

static gnp_status copy(const cholmod_factor *factor, struct gnp_symbolic *symbolic)
{
	const SuiteSparse_long *order = factor->Perm, *first = factor->super, *start = factor->pi, *row = factor->s;
	symbolic->count = factor->n;
	symbolic->supernodes = factor->nsuper;
	symbolic->order = gnp_array_new(factor->n, sizeof *symbolic->order);
	symbolic->first = gnp_array_new(factor->nsuper + 1, sizeof *symbolic->first);
	symbolic->row_start = gnp_array_new(factor->nsuper + 1, sizeof *symbolic->row_start);
	symbolic->row = gnp_array_new(factor->ssize, sizeof *symbolic->row);
	if (!symbolic->order || !symbolic->first || !symbolic->row_start || !symbolic->row)
		return GNP_OUT_OF_MEMORY;
	for (size_t k = 0; k < factor->n; k++)
		symbolic->order[k] = (uint32_t)order[k];
	for (size_t s = 0; s <= factor->nsuper; s++) {
		symbolic->first[s] = (uint32_t)first[s];
		symbolic->row_start[s] = (size_t)start[s];
	}
	for (size_t r = 0; r < symbolic->row_start[factor->nsuper]; r++)
		symbolic->row[r] = (uint32_t)row[r];
	return GNP_OK;
}

gnp_status gnp_sparse_analyse(const struct gnp_csr *pattern, const uint32_t *order, struct gnp_symbolic *out,
                              struct gnp_error *error)
{
	struct gnp_symbolic symbolic = {.count = 0};
	cholmod_common common;
	cholmod_l_start(&common);
	common.print = 0;
	common.nmethods = 1;
	common.method[0].ordering = CHOLMOD_GIVEN;
	common.postorder = true;
	common.supernodal = CHOLMOD_SUPERNODAL;
	cholmod_factor *factor = analyse(pattern, order, &common);
	gnp_status status = factor ? copy(factor, &symbolic) : GNP_OUT_OF_MEMORY;
	cholmod_l_free_factor(&factor, &common);
	cholmod_l_finish(&common);
	if (status != GNP_OK) {
		gnp_symbolic_clear(&symbolic);
		return gnp_error_set(error, status, "factor: no memory to analyse %zu unknowns", pattern->rows);
	}
	*out = symbolic;
	return GNP_OK;
}
