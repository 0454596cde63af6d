/* Matrix Market out: a sparse matrix by rows (row_offsets, columns, values, and kept for the number of columns) as
 * coordinates from 1. */
#include <inttypes.h>
#include <stdio.h>

#include "proto/codec/comments.h"
#include "proto/format/format.h"
#include "proto/tensor/number.h"

/* Tensors of an operation that makes matrices, checked to fit together. */
struct matrix {
	const int64_t *offsets, *columns;
	const double *values;
	size_t rows, columns_count, entries;
};

static const struct gnp_tensor *part(const struct gnp_tensors *tensors, const char *name, enum gnp_datatype datatype,
                                     struct gnp_error *error)
{
	const struct gnp_tensor *tensor = gnp_tensors_find(tensors, name);
	if (tensor && tensor->rank == 1 && tensor->datatype == datatype)
		return tensor;
	gnp_error_set(error, GNP_NOT_ACCEPTABLE,
	              "mtx: needs row_offsets, columns and values, a sparse matrix; there is no %s", name);
	return NULL;
}

/* Columns are those of `kept` where that is there, else as many as the entries need. */
static size_t count_columns(const struct gnp_tensors *tensors, const struct matrix *matrix)
{
	const struct gnp_tensor *kept = gnp_tensors_find(tensors, "kept");
	size_t most = kept && kept->rank == 1 ? kept->shape[0] : 0;
	for (size_t e = 0; e < matrix->entries; e++)
		most = matrix->columns[e] >= (int64_t)most ? (size_t)matrix->columns[e] + 1 : most;
	return most;
}

static gnp_status find_matrix(const struct gnp_tensors *tensors, struct matrix *matrix, struct gnp_error *error)
{
	const struct gnp_tensor *offsets = part(tensors, "row_offsets", GNP_INT64, error),
	                                   *columns = part(tensors, "columns", GNP_INT64, error);
	const struct gnp_tensor *values = part(tensors, "values", GNP_FP64, error);
	if (!offsets || !columns || !values)
		return GNP_NOT_ACCEPTABLE;
	*matrix = (struct matrix){.offsets = offsets->data, .columns = columns->data, .values = values->data,
	                          .rows = offsets->shape[0] ? offsets->shape[0] - 1 : 0, .entries = values->shape[0]};
	if (columns->shape[0] != matrix->entries || !offsets->shape[0] ||
	    matrix->offsets[matrix->rows] != (int64_t)matrix->entries)
		return gnp_error_set(error, GNP_NOT_ACCEPTABLE, "mtx: row_offsets, columns and values do not fit together");
	matrix->columns_count = count_columns(tensors, matrix);
	return GNP_OK;
}

static gnp_status write_row(const struct matrix *matrix, size_t row, struct gnp_buffer *buffer, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	for (int64_t e = matrix->offsets[row]; e < matrix->offsets[row + 1] && status == GNP_OK; e++) {
		char text[GNP_NUMBER_LENGTH_MAX];
		int length = (int)gnp_number_write_double(text, matrix->values[e]);
		status = gnp_buffer_printf(buffer, error, "%zu %" PRId64 " %.*s\n", row + 1, matrix->columns[e] + 1, length,
		                           text);
	}
	return status;
}

static gnp_status encode_file(const struct gnp_tensors *tensors, const struct gnp_values *comments,
                              struct gnp_buffer *buffer, struct gnp_error *error)
{
	struct matrix matrix;
	gnp_status status = find_matrix(tensors, &matrix, error);
	if (status == GNP_OK)
		status = gnp_buffer_printf(buffer, error, "%%%%MatrixMarket matrix coordinate real general\n");
	if (status == GNP_OK)
		status = gnp_comments_write(comments, "% ", buffer, error);
	if (status == GNP_OK)
		status = gnp_buffer_printf(buffer, error, "%zu %zu %zu\n", matrix.rows, matrix.columns_count, matrix.entries);
	for (size_t row = 0; row < matrix.rows && status == GNP_OK; row++)
		status = write_row(&matrix, row, buffer, error);
	return status;
}

static gnp_status parameters(const unsigned char *body, size_t size, struct gnp_values *values, struct gnp_error *error)
{
	return gnp_comments_read(body, size, "%", "", values, error);
}

const struct gnp_format gnp_format_mtx = {
	.name = "mtx", .media_type = "application/x-matrix-market", .extension = "mtx", .holds = GNP_HOLDS_MATRIX,
	.encode = encode_file, .parameters = parameters};
