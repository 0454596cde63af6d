/* PLY: what the format is, and how it is written: binary little-endian, one vertex element. */
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "proto/codec/comments.h"
#include "proto/codec/fields.h"
#include "proto/codec/rows.h"
#include "proto/format/format.h"
#include "proto/format/ply_decode.h"

static const char *const type_names[GNP_DATATYPE_COUNT] = {
	[GNP_UINT8] = "uchar", [GNP_UINT16] = "ushort", [GNP_UINT32] = "uint",  [GNP_INT8] = "char",
	[GNP_INT16] = "short", [GNP_INT32] = "int",     [GNP_FP32] = "float",   [GNP_FP64] = "double",
};

static gnp_status write_header(const struct gnp_row_item *items, size_t count, size_t rows,
                               const struct gnp_values *comments, struct gnp_buffer *buffer, struct gnp_error *error)
{
	gnp_status status = gnp_buffer_printf(buffer, error, "ply\nformat binary_little_endian 1.0\n");
	if (status == GNP_OK)
		status = gnp_comments_write(comments, "comment ", buffer, error);
	if (status == GNP_OK)
		status = gnp_buffer_printf(buffer, error, "element vertex %zu\n", rows);
	enum gnp_datatype type = GNP_FP64;
	for (size_t i = 0; i < count && status == GNP_OK; i++) {
		if (!i || items[i].tensor != items[i - 1].tensor)
			type = gnp_stored_type(items[i].tensor);
		status = gnp_buffer_printf(buffer, error, "property %s %s\n", type_names[type], items[i].name);
	}
	return status == GNP_OK ? gnp_buffer_printf(buffer, error, "end_header\n") : status;
}

/* Neighbouring columns that lie side by side in their tensor as they will in the file: copied in one go. */
struct span {
	const unsigned char *source; /* of the first row */
	size_t step, offset, bytes;  /* from row to row there; within the file's row; of all its columns */
	enum gnp_datatype from, to;  /* a span of one column where they differ */
};

/* (count) at most; returns how many there are, and the bytes of a row. */
static size_t find_spans(const struct gnp_row_item *items, size_t count, size_t rows, struct span *spans,
                         size_t *stride)
{
	size_t made = 0, offset = 0;
	for (size_t i = 0; i < count; i++) {
		const struct gnp_tensor *tensor = items[i].tensor;
		bool first = !i || tensor != items[i - 1].tensor;
		enum gnp_datatype from = tensor->datatype, to = first ? gnp_stored_type(tensor) : spans[made - 1].to;
		size_t size = gnp_datatype_size(to);
		bool joins = !first && from == to && items[i].item == items[i - 1].item + 1;
		if (joins)
			spans[made - 1].bytes += size;
		else
			spans[made++] = (struct span){(const unsigned char *)tensor->data + items[i].item * gnp_datatype_size(from),
			                              rows ? tensor->size / rows : 0, offset, size, from, to};
		offset += size;
	}
	*stride = offset;
	return made;
}

/* Sizes known to the compiler spare the call. */
static void copy_span(const struct span *span, const unsigned char *source, unsigned char *target, size_t stride,
                      size_t rows)
{
	if (span->from != span->to) {
		struct gnp_column column = {target, stride, span->to};
		gnp_column_copy(&column, span->from, source, span->step, rows);
		return;
	}
	for (size_t row = 0; row < rows; row++, source += span->step, target += stride) {
		switch (span->bytes) {
		case 4: memcpy(target, source, 4); break;
		case 8: memcpy(target, source, 8); break;
		case 12: memcpy(target, source, 12); break;
		default: memcpy(target, source, span->bytes);
		}
	}
}

/* In blocks of rows that stay in the nearest cache while their columns come together. */
static void write_blocks(const struct span *spans, size_t count, size_t rows, unsigned char *target, size_t stride)
{
	enum { BLOCK = 64 };
	for (size_t first = 0; first < rows; first += BLOCK) {
		size_t some = rows - first < BLOCK ? rows - first : BLOCK;
		for (size_t s = 0; s < count; s++)
			copy_span(&spans[s], spans[s].source + first * spans[s].step, target + first * stride + spans[s].offset,
			          stride, some);
	}
}

static gnp_status write_rows(const struct gnp_row_item *items, size_t count, size_t rows, struct gnp_buffer *buffer,
                             struct gnp_error *error)
{
	size_t stride, bytes, found;
	struct span *spans = gnp_array_new(count, sizeof *spans);
	if (!spans)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "ply: no memory for %zu columns", count);
	found = find_spans(items, count, rows, spans, &stride);
	gnp_status status = GNP_OK;
	if (!gnp_size_multiply(rows, stride, &bytes))
		status = gnp_error_set(error, GNP_OUT_OF_MEMORY, "ply: %zu rows of %zu bytes overflow", rows, stride);
	if (status == GNP_OK)
		status = gnp_buffer_reserve(buffer, bytes, error);
	if (status == GNP_OK) {
		write_blocks(spans, found, rows, buffer->data + buffer->size, stride);
		buffer->size += bytes;
	}
	free(spans);
	return status;
}

static gnp_status encode_file(const struct gnp_tensors *tensors, const struct gnp_values *comments,
                              struct gnp_buffer *buffer, struct gnp_error *error)
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

static gnp_status parameters(const unsigned char *body, size_t size, struct gnp_values *values, struct gnp_error *error)
{
	return gnp_comments_read(body, size, "comment ", "end_header", values, error);
}

static const char *const magic[] = {"ply\n", "ply\r", NULL};
static const char *const other_media_types[] = {"model/ply", "application/x-ply", NULL};

const struct gnp_format gnp_format_ply = {
	.name = "ply", .media_type = "application/ply", .extension = "ply", .other_media_types = other_media_types,
	.holds = GNP_HOLDS_ROWS, .magic = magic, .decode = gnp_ply_decode, .encode = encode_file, .parameters = parameters};
