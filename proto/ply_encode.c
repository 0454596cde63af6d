/* PLY out: binary little-endian, one vertex element. */
#include <stdlib.h>

#include "file_codec.h"
#include "memory.h"

/* What PLY has no type for goes into the next wider one. */
static enum gnp_datatype stored_type(enum gnp_datatype datatype, const char **name)
{
	switch (datatype) {
	case GNP_BOOL:
	case GNP_UINT8: *name = "uchar"; return GNP_UINT8;
	case GNP_UINT16: *name = "ushort"; return GNP_UINT16;
	case GNP_UINT32: *name = "uint"; return GNP_UINT32;
	case GNP_INT8: *name = "char"; return GNP_INT8;
	case GNP_INT16: *name = "short"; return GNP_INT16;
	case GNP_INT32: *name = "int"; return GNP_INT32;
	case GNP_FP16:
	case GNP_FP32: *name = "float"; return GNP_FP32;
	default: *name = "double"; return GNP_FP64;
	}
}

static gnp_status write_header(const struct gnp_row_item *items, size_t count, size_t rows,
                               const struct gnp_values *comments, struct gnp_buffer *buffer, struct gnp_error *error)
{
	gnp_status status = gnp_buffer_printf(buffer, error, "ply\nformat binary_little_endian 1.0\n");
	if (status == GNP_OK)
		status = gnp_write_comments(comments, "comment ", buffer, error);
	if (status == GNP_OK)
		status = gnp_buffer_printf(buffer, error, "element vertex %zu\n", rows);
	for (size_t i = 0; i < count && status == GNP_OK; i++) {
		const char *type;
		stored_type(items[i].tensor->datatype, &type);
		status = gnp_buffer_printf(buffer, error, "property %s %s\n", type, items[i].name);
	}
	return status == GNP_OK ? gnp_buffer_printf(buffer, error, "end_header\n") : status;
}

/* One column of all rows. */
static void write_column(const struct gnp_row_item *item, size_t rows, unsigned char *target, size_t stride)
{
	const struct gnp_tensor *tensor = item->tensor;
	const char *name;
	enum gnp_datatype type = stored_type(tensor->datatype, &name);
	size_t size = gnp_datatype_size(tensor->datatype), step = rows ? tensor->size / rows : 0;
	const unsigned char *source = (const unsigned char *)tensor->data + item->item * size;
	struct gnp_column column = {target, stride, type};
	gnp_column_copy(&column, tensor->datatype, source, step, rows);
}

static gnp_status write_rows(const struct gnp_row_item *items, size_t count, size_t rows, struct gnp_buffer *buffer,
                             struct gnp_error *error)
{
	const char *name;
	size_t stride = 0, bytes, offset = 0;
	for (size_t i = 0; i < count; i++)
		stride += gnp_datatype_size(stored_type(items[i].tensor->datatype, &name));
	if (!gnp_size_multiply(rows, stride, &bytes))
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "ply: %zu rows of %zu bytes overflow", rows, stride);
	gnp_status status = gnp_buffer_reserve(buffer, bytes, error);
	if (status != GNP_OK)
		return status;
	for (size_t i = 0; i < count; i++) {
		write_column(&items[i], rows, buffer->data + buffer->size + offset, stride);
		offset += gnp_datatype_size(stored_type(items[i].tensor->datatype, &name));
	}
	buffer->size += bytes;
	return GNP_OK;
}

gnp_status gnp_ply_encode(const struct gnp_tensors *tensors, const struct gnp_values *comments, struct gnp_buffer *buffer,
                          struct gnp_error *error)
{
	struct gnp_row_item *items;
	size_t count;
	gnp_status status = gnp_row_items(tensors, "ply", "scalar_", true, &items, &count, error);
	if (status != GNP_OK)
		return status;
	size_t rows = items[0].tensor->shape[0];
	status = write_header(items, count, rows, comments, buffer, error);
	if (status == GNP_OK)
		status = write_rows(items, count, rows, buffer, error);
	free(items);
	return status;
}
