/* Matrix Market out: the sparse matrix of an answer (sparse.h) as coordinates from 1. */
#include "proto/codec/comments.h"
#include "proto/format/format.h"
#include "proto/format/sparse.h"
#include "proto/tensor/number.h"

static gnp_status write_entry(size_t row, size_t column, double value, struct gnp_buffer *buffer,
                              struct gnp_error *error)
{
	char text[GNP_NUMBER_LENGTH_MAX];
	int length = (int)gnp_number_write_double(text, value);
	return gnp_buffer_printf(buffer, error, "%zu %zu %.*s\n", row + 1, column + 1, length, text);
}

/* Of a symmetric matrix on and below the diagonal: its row k. Adds to *count how many there are; buffer NULL: it counts
 * alone. */
static gnp_status write_half(const struct gnp_sparse *matrix, size_t k, size_t *count, struct gnp_buffer *buffer,
                             struct gnp_error *error)
{
	size_t row = gnp_sparse_row(matrix, k);
	gnp_status status = GNP_OK;
	for (int64_t e = matrix->offsets[row]; e < matrix->offsets[row + 1] && status == GNP_OK; e++) {
		if ((size_t)matrix->columns[e] > k)
			continue;
		++*count;
		if (buffer)
			status = write_entry(k, (size_t)matrix->columns[e], matrix->values[e], buffer, error);
	}
	return status;
}

static gnp_status write_symmetric(const struct gnp_sparse *matrix, struct gnp_buffer *buffer, struct gnp_error *error)
{
	size_t count = 0, written = 0;
	for (size_t k = 0; k < matrix->width && matrix->offsets; k++)
		write_half(matrix, k, &count, NULL, NULL);
	gnp_status status = gnp_buffer_printf(buffer, error, "%zu %zu %zu\n", matrix->width, matrix->width,
	                                      matrix->offsets ? count : matrix->width);
	for (size_t k = 0; k < matrix->width && status == GNP_OK; k++)
		status = matrix->offsets ? write_half(matrix, k, &written, buffer, error)
		                         : write_entry(k, k, matrix->values[k], buffer, error);
	return status;
}

static gnp_status write_general(const struct gnp_sparse *matrix, struct gnp_buffer *buffer, struct gnp_error *error)
{
	gnp_status status = gnp_buffer_printf(buffer, error, "%zu %zu %zu\n", matrix->rows, matrix->width, matrix->entries);
	for (size_t row = 0; row < matrix->rows; row++)
		for (int64_t e = matrix->offsets[row]; e < matrix->offsets[row + 1] && status == GNP_OK; e++)
			status = write_entry(row, (size_t)matrix->columns[e], matrix->values[e], buffer, error);
	return status;
}

static gnp_status encode_file(const struct gnp_tensors *tensors, const struct gnp_values *comments,
                              struct gnp_buffer *buffer, struct gnp_error *error)
{
	struct gnp_sparse matrix;
	gnp_status status = gnp_sparse_find(tensors, "mtx", &matrix, error);
	if (status == GNP_OK)
		status = gnp_buffer_printf(buffer, error, "%%%%MatrixMarket matrix coordinate real %s\n",
		                           matrix.symmetric ? "symmetric" : "general");
	if (status == GNP_OK)
		status = gnp_comments_write(comments, "% ", buffer, error);
	if (status != GNP_OK)
		return status;
	return matrix.symmetric ? write_symmetric(&matrix, buffer, error) : write_general(&matrix, buffer, error);
}

static gnp_status parameters(const unsigned char *body, size_t size, struct gnp_values *values, struct gnp_error *error)
{
	return gnp_comments_read(body, size, "%", "", values, error);
}

const struct gnp_format gnp_format_mtx = {
	.name = "mtx", .media_type = "application/x-matrix-market", .extension = "mtx", .holds = GNP_HOLDS_MATRIX,
	.encode = encode_file, .parameters = parameters};
