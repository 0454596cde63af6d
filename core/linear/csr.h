/* Sparse matrices by rows (compressed sparse rows): 12 bytes an entry and 8 a row. */
#ifndef GNP_CORE_CSR_H
#define GNP_CORE_CSR_H

#include <stddef.h>
#include <stdint.h>

#include "core/base/pool.h"
#include "core/base/status.h"
#include "core/base/task.h"

/* Plain data: row i holds entries [row_offsets[i], row_offsets[i + 1]). Freed by gnp_csr_clear unless it is a view
 * of another's arrays. */
struct gnp_csr {
	size_t rows, columns;
	size_t *row_offsets; /* (rows + 1) ascending from 0 */
	uint32_t *column;    /* (row_offsets[rows]) ascending within a row, < columns */
	double *value;       /* (row_offsets[rows]) */
};

/* Room for `entries` of them; row_offsets is zeroed, the rest uninitialised. On failure *out is unchanged. */
gnp_status gnp_csr_allocate(size_t rows, size_t columns, size_t entries, struct gnp_csr *out, struct gnp_error *error);
void gnp_csr_clear(struct gnp_csr *matrix);
size_t gnp_csr_bytes(const struct gnp_csr *matrix);

/* y (rows) = A x, x (columns). Rows in parallel; the same bytes for any number of workers. O(entries), no memory. */
gnp_status gnp_csr_multiply(const struct gnp_csr *matrix, const double *x, double *y, struct gnp_pool *pool,
                            struct gnp_task *task, struct gnp_error *error);

/* O(entries + columns); 8 bytes a column beside the result. */
gnp_status gnp_csr_transpose(const struct gnp_csr *matrix, struct gnp_csr *out, struct gnp_error *error);

/* A B, rows in parallel: A^T A is the product of the transpose and the matrix. O(products of entries, rows
 * sorted); beside the result 8 bytes a row, and 16 a column for each worker. */
gnp_status gnp_csr_product(const struct gnp_csr *left, const struct gnp_csr *right, struct gnp_pool *pool,
                           struct gnp_task *task, struct gnp_csr *out, struct gnp_error *error);

#endif
