/* What a sparse factor (factor.h) will take, known before any of it is made: elimination order, supernodes, memory,
 * operations. */
#ifndef GNP_CORE_FACTOR_PLAN_H
#define GNP_CORE_FACTOR_PLAN_H

#include <stdbool.h>

#include "core/linear/sparse.h"

#define GNP_FACTOR_NONE UINT32_MAX

/* Owned; freed by gnp_factor_plan_clear. A supernode's front has its own `width` pivots and `border` rows and
 * columns that wait for later ones. */
struct gnp_factor_plan {
	bool symmetric;        /* and positive definite: half of everything */
	struct gnp_symbolic symbolic;
	uint32_t *step;        /* (n) inverse of the order */
	uint32_t *parent;      /* (supernodes) whose front takes in this one's border; GNP_FACTOR_NONE at roots */
	uint32_t *child_start; /* (supernodes + 1) */
	uint32_t *child;       /* children ascending */
	uint32_t *place;       /* as symbolic.row: where a border row sits in the parent's front; own rows unset */
	size_t *value_start;   /* (supernodes + 1) in the factor's values */
	size_t subtrees;       /* sets of supernodes that depend on nothing else, for workers to take */
	uint32_t *subtree;     /* (subtrees, 2) first and last supernode of each, ascending */
	unsigned char *shared; /* (supernodes) 1: above the subtrees */
	double operations;     /* floating-point, of the factor */
	size_t bytes;          /* of the factor */
	size_t peak_bytes;     /* while it is made by as many workers as the plan was made for */
};

/* matrix (n, n) need not be symmetric in structure, unless the caller says that it is symmetric and positive
 * definite. points (n, 3): where the unknowns are (dissection.h).
 * O(entries log n); with 13 entries a row some 410 bytes an unknown while it runs, of which 50 stay. */
gnp_status gnp_factor_plan_make(const struct gnp_csr *matrix, bool symmetric, const double *points,
                                struct gnp_pool *pool, struct gnp_task *task, struct gnp_factor_plan *out,
                                struct gnp_error *error);
void gnp_factor_plan_clear(struct gnp_factor_plan *plan);

static inline size_t gnp_factor_plan_width(const struct gnp_factor_plan *plan, size_t s)
{
	return plan->symbolic.first[s + 1] - plan->symbolic.first[s];
}

static inline size_t gnp_factor_plan_rows(const struct gnp_factor_plan *plan, size_t s)
{
	return plan->symbolic.row_start[s + 1] - plan->symbolic.row_start[s];
}

#endif
