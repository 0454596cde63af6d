/* What a factor is made of: for factor.c, which makes it, and factor_solve.c, which solves by it. Opaque to all
 * others. */
#ifndef GNP_CORE_FACTOR_PARTS_H
#define GNP_CORE_FACTOR_PARTS_H

#include "core/linear/factor.h"

struct gnp_factor {
	struct gnp_factor_plan plan;
	double *value;   /* panel and, unless symmetric, U12 of each supernode, from plan.value_start[s] */
	uint32_t *pivot; /* (n) within each front */
	double *scale;   /* (n) factor of each row of the matrix, and of each column where symmetric */
};

#endif
