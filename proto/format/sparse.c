#include "proto/format/sparse.h"

#include <string.h>

static const char *const by_rows[] = {"row_offsets", "columns", "stiffness"};

static const struct gnp_tensor *part(const struct gnp_tensors *tensors, const char *name, enum gnp_datatype datatype)
{
	const struct gnp_tensor *tensor = gnp_tensors_find(tensors, name);
	return tensor && tensor->rank == 1 && tensor->datatype == datatype ? tensor : NULL;
}

/* Columns are those of `kept` where that is there, else as many as the entries need. */
static size_t count_columns(const struct gnp_tensor *kept, const struct gnp_sparse *matrix)
{
	size_t most = kept ? kept->shape[0] : 0;
	for (size_t e = 0; e < matrix->entries; e++)
		most = matrix->columns[e] >= (int64_t)most ? (size_t)matrix->columns[e] + 1 : most;
	return most;
}

static void take_diagonal(const struct gnp_tensor *mass, struct gnp_sparse *out)
{
	size_t count = mass->shape[0];
	*out = (struct gnp_sparse){.values = mass->data, .rows = count, .width = count, .entries = count,
	                           .symmetric = true};
}

gnp_status gnp_sparse_find(const struct gnp_tensors *tensors, const char *format, struct gnp_sparse *out,
                           struct gnp_error *error)
{
	const struct gnp_tensor *offsets = part(tensors, "row_offsets", GNP_INT64);
	const struct gnp_tensor *columns = part(tensors, "columns", GNP_INT64), *kept = part(tensors, "kept", GNP_INT64);
	const struct gnp_tensor *stiffness = part(tensors, "stiffness", GNP_FP64), *mass = part(tensors, "mass", GNP_FP64);
	const struct gnp_tensor *values = stiffness ? stiffness : part(tensors, "values", GNP_FP64);
	if (mass && !offsets && !columns && !values) {
		take_diagonal(mass, out);
		return GNP_OK;
	}
	if (!offsets || !columns || !values)
		return gnp_error_set(error, GNP_NOT_ACCEPTABLE,
		                     "%s: needs row_offsets, columns and values, a sparse matrix; there is no %s", format,
		                     !offsets ? "row_offsets" : !columns ? "columns" : "values");
	struct gnp_sparse matrix = {.offsets = offsets->data, .columns = columns->data, .values = values->data,
	                            .kept = kept ? kept->data : NULL, .symmetric = stiffness != NULL,
	                            .rows = offsets->shape[0] ? offsets->shape[0] - 1 : 0, .entries = values->shape[0]};
	if (columns->shape[0] != matrix.entries || !offsets->shape[0] ||
	    matrix.offsets[matrix.rows] != (int64_t)matrix.entries)
		return gnp_error_set(error, GNP_NOT_ACCEPTABLE, "%s: row_offsets, columns and values do not fit together",
		                     format);
	matrix.width = count_columns(kept, &matrix);
	bool square = kept ? kept->shape[0] == matrix.width : matrix.width <= matrix.rows;
	if (matrix.symmetric && !square)
		return gnp_error_set(error, GNP_NOT_ACCEPTABLE, "%s: stiffness has more columns than rows, or than kept names",
		                     format);
	if (matrix.symmetric && !kept)
		matrix.width = matrix.rows;
	*out = matrix;
	return GNP_OK;
}

size_t gnp_sparse_row(const struct gnp_sparse *matrix, size_t k)
{
	return matrix->kept ? (size_t)matrix->kept[k] : k;
}

bool gnp_sparse_is_symmetric(const struct gnp_tensors *tensors)
{
	struct gnp_sparse matrix;
	return gnp_sparse_find(tensors, "", &matrix, NULL) == GNP_OK && matrix.symmetric && matrix.offsets;
}

static bool is_part(const char *name)
{
	for (size_t i = 0; i < sizeof by_rows / sizeof *by_rows; i++)
		if (strcmp(name, by_rows[i]) == 0)
			return true;
	return false;
}

/* Entries of the rows that are kept: filters leave rows empty, and copies of points have those of others. */
static size_t count_entries(const struct gnp_sparse *matrix)
{
	size_t entries = 0;
	for (size_t k = 0; k < matrix->width; k++) {
		const int64_t *row = matrix->offsets + gnp_sparse_row(matrix, k);
		entries += (size_t)(row[1] - row[0]);
	}
	return entries;
}

static gnp_status add(const char *name, enum gnp_datatype datatype, size_t count, void **data, struct gnp_tensors *out,
                      struct gnp_error *error)
{
	struct gnp_tensor *tensor;
	gnp_status status = gnp_tensors_add(out, name, datatype, 1, &count, &tensor, error);
	if (status == GNP_OK)
		*data = tensor->data;
	return status;
}

/* Numbers of the kept rows' entries, one row after the other. */
static void gather(const struct gnp_sparse *matrix, const void *from, void *to)
{
	size_t at = 0, size = sizeof(int64_t); /* that of a double, too */
	for (size_t k = 0; k < matrix->width; k++) {
		const int64_t *row = matrix->offsets + gnp_sparse_row(matrix, k);
		size_t count = (size_t)(row[1] - row[0]);
		memcpy((char *)to + at * size, (const char *)from + (size_t)row[0] * size, count * size);
		at += count;
	}
}

static gnp_status add_gathered(const struct gnp_sparse *matrix, const char *name, enum gnp_datatype datatype,
                               const void *from, struct gnp_tensors *out, struct gnp_error *error)
{
	void *to;
	gnp_status status = add(name, datatype, count_entries(matrix), &to, out, error);
	if (status == GNP_OK)
		gather(matrix, from, to);
	return status;
}

static gnp_status add_offsets(const struct gnp_sparse *matrix, struct gnp_tensors *out, struct gnp_error *error)
{
	void *data;
	gnp_status status = add("indptr", GNP_INT64, matrix->width + 1, &data, out, error);
	int64_t *offsets = data;
	for (size_t k = 0; k <= matrix->width && status == GNP_OK; k++) {
		const int64_t *row = matrix->offsets + (k > 0 ? gnp_sparse_row(matrix, k - 1) : 0);
		offsets[k] = k > 0 ? offsets[k - 1] + row[1] - row[0] : 0;
	}
	return status;
}

static gnp_status add_shape(const struct gnp_sparse *matrix, struct gnp_tensors *out, struct gnp_error *error)
{
	void *data;
	gnp_status status = add("shape", GNP_INT64, 2, &data, out, error);
	for (size_t d = 0; d < 2 && status == GNP_OK; d++)
		((int64_t *)data)[d] = (int64_t)matrix->width;
	return status;
}

/* Entries of the Laplacian stand as those of the matrix do. */
static gnp_status add_other(const struct gnp_sparse *matrix, const struct gnp_tensor *tensor, struct gnp_tensors *out,
                            struct gnp_error *error)
{
	if (is_part(tensor->name))
		return GNP_OK;
	bool values = strcmp(tensor->name, "values") == 0 && tensor->datatype == GNP_FP64;
	if (values && tensor->size == matrix->entries * sizeof(double))
		return add_gathered(matrix, "values", GNP_FP64, tensor->data, out, error);
	return gnp_tensors_add_data(out, tensor->name, tensor->datatype, tensor->rank, tensor->shape, tensor->data, false,
	                            NULL, error);
}

gnp_status gnp_sparse_for_scipy(const struct gnp_tensors *tensors, struct gnp_tensors *out, struct gnp_error *error)
{
	struct gnp_sparse matrix;
	gnp_status status = gnp_sparse_find(tensors, "npz", &matrix, error);
	if (status == GNP_OK)
		status = add_offsets(&matrix, out, error);
	if (status == GNP_OK)
		status = add_gathered(&matrix, "indices", GNP_INT64, matrix.columns, out, error);
	if (status == GNP_OK)
		status = add_gathered(&matrix, "data", GNP_FP64, matrix.values, out, error);
	if (status == GNP_OK)
		status = add_shape(&matrix, out, error);
	for (size_t i = 0; i < tensors->count && status == GNP_OK; i++)
		status = add_other(&matrix, &tensors->items[i], out, error);
	return status;
}
