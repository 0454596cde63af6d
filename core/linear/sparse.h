/* Symbolic analysis of sparse factors (the one SuiteSparse user: CHOLMOD's supernodal analysis). */
#ifndef GNP_CORE_SPARSE_H
#define GNP_CORE_SPARSE_H

#include "core/linear/csr.h"

/* What a factor of a matrix of symmetric structure looks like: supernodes are runs of eliminated unknowns whose
 * columns share their rows. Freed by gnp_symbolic_clear. */
struct gnp_symbolic {
	size_t count;         /* n */
	uint32_t *order;      /* (n) the k-th unknown eliminated */
	size_t supernodes;
	uint32_t *first;      /* (supernodes + 1) the first elimination step of each */
	size_t *row_start;    /* (supernodes + 1) */
	uint32_t *row;        /* (row_start[supernodes]) steps of a supernode's rows, ascending; its own come first */
};

/* pattern (n, n): symmetric in structure, values not read, n < 2^31. order (n): the elimination order wanted; it
 * is refined within what causes no more fill. GNP_OUT_OF_MEMORY. On failure *out is
 * unchanged. Nearly O(entries); some 12 bytes an entry and 200 an unknown while it runs, 32 an unknown stay. */
gnp_status gnp_sparse_analyse(const struct gnp_csr *pattern, const uint32_t *order, struct gnp_symbolic *out,
                              struct gnp_error *error);
void gnp_symbolic_clear(struct gnp_symbolic *symbolic);

#endif
