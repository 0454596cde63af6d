#include "core/linear/csr.h"

#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"

enum { ROWS_A_CHUNK = 2048, PRODUCT_ROWS_A_CHUNK = 512 };

gnp_status gnp_csr_allocate(size_t rows, size_t columns, size_t entries, struct gnp_csr *out, struct gnp_error *error)
{
	struct gnp_csr matrix = {.rows = rows, .columns = columns, .row_offsets = gnp_array_zero(rows + 1, sizeof(size_t)),
	                         .column = gnp_array_new(entries, sizeof(uint32_t)),
	                         .value = gnp_array_new(entries, sizeof(double))};
	if (!matrix.row_offsets || !matrix.column || !matrix.value) {
		gnp_csr_clear(&matrix);
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "matrix: no memory for %zu entries in %zu rows", entries, rows);
	}
	*out = matrix;
	return GNP_OK;
}

void gnp_csr_clear(struct gnp_csr *matrix)
{
	free(matrix->row_offsets);
	free(matrix->column);
	free(matrix->value);
	*matrix = (struct gnp_csr){.rows = 0};
}

size_t gnp_csr_bytes(const struct gnp_csr *matrix)
{
	if (!matrix->row_offsets)
		return 0;
	return (matrix->rows + 1) * sizeof(size_t) +
	       matrix->row_offsets[matrix->rows] * (sizeof(uint32_t) + sizeof(double));
}

struct multiplication {
	const struct gnp_csr *matrix;
	const double *x;
	double *y;
};

static gnp_status multiply_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                 struct gnp_error *error)
{
	const struct multiplication *work = context;
	const struct gnp_csr *matrix = work->matrix;
	(void)scratch;
	(void)error;
	for (size_t i = begin; i < end; i++) {
		double sum = 0;
		for (size_t e = matrix->row_offsets[i]; e < matrix->row_offsets[i + 1]; e++)
			sum += matrix->value[e] * work->x[matrix->column[e]];
		work->y[i] = sum;
	}
	return GNP_OK;
}

gnp_status gnp_csr_multiply(const struct gnp_csr *matrix, const double *x, double *y, struct gnp_pool *pool,
                            struct gnp_task *task, struct gnp_error *error)
{
	struct multiplication work = {matrix, x, y};
	return gnp_pool_run(pool, task, matrix->rows, ROWS_A_CHUNK, multiply_chunk, &work, error);
}

/* counts (rows): entries of each row, as offsets of the row after; made into offsets. */
static void accumulate(size_t *offsets, size_t rows)
{
	for (size_t i = 0; i < rows; i++)
		offsets[i + 1] += offsets[i];
}

gnp_status gnp_csr_transpose(const struct gnp_csr *matrix, struct gnp_csr *out, struct gnp_error *error)
{
	struct gnp_csr turned;
	size_t entries = matrix->row_offsets[matrix->rows];
	gnp_status status = gnp_csr_allocate(matrix->columns, matrix->rows, entries, &turned, error);
	size_t *next = status == GNP_OK ? gnp_array_new(matrix->columns + 1, sizeof *next) : NULL;
	if (!next) {
		if (status == GNP_OK)
			gnp_csr_clear(&turned);
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "matrix: no memory to transpose %zu entries", entries);
	}
	for (size_t e = 0; e < entries; e++)
		turned.row_offsets[matrix->column[e] + 1]++;
	accumulate(turned.row_offsets, matrix->columns);
	memcpy(next, turned.row_offsets, (matrix->columns + 1) * sizeof *next);
	for (size_t i = 0; i < matrix->rows; i++)
		for (size_t e = matrix->row_offsets[i]; e < matrix->row_offsets[i + 1]; e++) {
			size_t at = next[matrix->column[e]]++;
			turned.column[at] = (uint32_t)i;
			turned.value[at] = matrix->value[e];
		}
	free(next);
	*out = turned;
	return GNP_OK;
}

/* Gustavson 1978: a row of the product is a sum of rows of the right factor. */
struct product {
	const struct gnp_csr *left, *right;
	struct gnp_csr *out; /* first its row lengths, then its entries */
	int filling;
};

static int ascending(const void *a, const void *b)
{
	uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
	return (x > y) - (x < y);
}

/* The columns of row i into `column`, their sums into sum; where each column was last seen: row i + 1. */
static size_t product_row(const struct product *work, size_t i, uint32_t *seen, uint32_t *column, double *sum)
{
	const struct gnp_csr *left = work->left, *right = work->right;
	size_t count = 0;
	for (size_t a = left->row_offsets[i]; a < left->row_offsets[i + 1]; a++) {
		size_t k = left->column[a];
		for (size_t b = right->row_offsets[k]; b < right->row_offsets[k + 1]; b++) {
			uint32_t j = right->column[b];
			if (seen[j] != i + 1) {
				seen[j] = (uint32_t)(i + 1);
				sum[j] = 0;
				column[count++] = j;
			}
			sum[j] += left->value[a] * right->value[b];
		}
	}
	return count;
}

static gnp_status product_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                struct gnp_error *error)
{
	const struct product *work = context;
	size_t columns = work->right->columns;
	uint32_t *seen = gnp_scratch_take(scratch, columns, sizeof *seen);
	uint32_t *column = gnp_scratch_take(scratch, columns, sizeof *column);
	double *sum = gnp_scratch_take(scratch, columns, sizeof *sum);
	if (!seen || !column || !sum)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "matrix: no memory for a product with %zu columns", columns);
	memset(seen, 0, columns * sizeof *seen);
	for (size_t i = begin; i < end; i++) {
		size_t count = product_row(work, i, seen, column, sum);
		if (!work->filling) {
			work->out->row_offsets[i + 1] = count;
			continue;
		}
		size_t at = work->out->row_offsets[i];
		qsort(column, count, sizeof *column, ascending);
		for (size_t e = 0; e < count; e++) {
			work->out->column[at + e] = column[e];
			work->out->value[at + e] = sum[column[e]];
		}
	}
	return GNP_OK;
}

gnp_status gnp_csr_product(const struct gnp_csr *left, const struct gnp_csr *right, struct gnp_pool *pool,
                           struct gnp_task *task, struct gnp_csr *out, struct gnp_error *error)
{
	struct gnp_csr lengths, matrix = {.rows = 0};
	gnp_status status = gnp_csr_allocate(left->rows, right->columns, 0, &lengths, error);
	if (status != GNP_OK)
		return status;
	struct product work = {left, right, &lengths, 0};
	status = gnp_pool_run(pool, task, left->rows, PRODUCT_ROWS_A_CHUNK, product_chunk, &work, error);
	accumulate(lengths.row_offsets, left->rows);
	if (status == GNP_OK)
		status = gnp_csr_allocate(left->rows, right->columns, lengths.row_offsets[left->rows], &matrix, error);
	if (status == GNP_OK) {
		memcpy(matrix.row_offsets, lengths.row_offsets, (left->rows + 1) * sizeof(size_t));
		work = (struct product){left, right, &matrix, 1};
		status = gnp_pool_run(pool, task, left->rows, PRODUCT_ROWS_A_CHUNK, product_chunk, &work, error);
	}
	gnp_csr_clear(&lengths);
	if (status == GNP_OK)
		*out = matrix;
	else
		gnp_csr_clear(&matrix);
	return status;
}
