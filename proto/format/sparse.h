/* The sparse matrix among the tensors of an answer: what the formats that hold one write.
 *
 * By rows are row_offsets and columns, with values, or with stiffness, which is symmetric and comes before values where
 * both are there. A list mass alone is the diagonal of one. */
#ifndef GNP_PROTO_SPARSE_H
#define GNP_PROTO_SPARSE_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/status.h"
#include "proto/tensor/tensor.h"

/* Tensors that were checked to fit together; borrowed. */
struct gnp_sparse {
	const int64_t *offsets, *columns; /* (rows + 1), (entries); NULL: the matrix is a diagonal */
	const double *values;             /* (entries) */
	const int64_t *kept;              /* (width) the row of each column; NULL: all rows */
	size_t rows, width, entries;
	bool symmetric;                   /* the matrix is that of the rows that are kept */
};

/* format: for the message. GNP_NOT_ACCEPTABLE where there is none. */
gnp_status gnp_sparse_find(const struct gnp_tensors *tensors, const char *format, struct gnp_sparse *out,
                           struct gnp_error *error);

/* The row of the answer that is a symmetric matrix's row k < width. */
size_t gnp_sparse_row(const struct gnp_sparse *matrix, size_t k);

/* Whether tensors hold a symmetric one by rows. */
bool gnp_sparse_is_symmetric(const struct gnp_tensors *tensors);

/* Appends to *out tensors as scipy.sparse.load_npz wants them: indptr, indices, data and shape of the symmetric matrix
 * in place of its parts, and all others, which borrow. On failure *out may hold some of them. */
gnp_status gnp_sparse_for_scipy(const struct gnp_tensors *tensors, struct gnp_tensors *out, struct gnp_error *error);

#endif
