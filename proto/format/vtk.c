/* VTK legacy out, binary (big-endian): points as vertices, normals, and every other tensor as a field array; what
 * the answer says of itself is the field `parameters`, bytes of JSON, since the title has room for a part of it
 * alone. */
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "proto/codec/comments.h"
#include "proto/codec/parameters.h"
#include "proto/codec/rows.h"
#include "proto/format/format.h"
#include "proto/tensor/scalar.h"

static const char *type_name(const struct gnp_tensor *tensor)
{
	static const char *const names[GNP_DATATYPE_COUNT] = {
		[GNP_UINT8] = "unsigned_char", [GNP_UINT16] = "unsigned_short", [GNP_UINT32] = "unsigned_int",
			[GNP_INT8] = "char",
		[GNP_INT16] = "short",         [GNP_INT32] = "int",             [GNP_FP32] = "float",
			[GNP_FP64] = "double",
	};
	return names[gnp_stored_type(tensor)];
}

static gnp_status write_numbers(const struct gnp_tensor *tensor, struct gnp_buffer *buffer, struct gnp_error *error)
{
	enum gnp_datatype type = gnp_stored_type(tensor);
	size_t size = gnp_datatype_size(type), count = tensor->size / gnp_datatype_size(tensor->datatype);
	gnp_status status = gnp_buffer_reserve(buffer, count * size + 1, error);
	if (status != GNP_OK)
		return status;
	unsigned char *target = buffer->data + buffer->size, item[8];
	for (size_t i = 0; i < count; i++, target += size) {
		gnp_scalar_store(type, item, gnp_tensor_get(tensor, i));
		gnp_scalar_swap(target, item, 1, size);
	}
	*target = '\n';
	buffer->size += count * size + 1;
	return GNP_OK;
}

static gnp_status write_vertices(size_t count, struct gnp_buffer *buffer, struct gnp_error *error)
{
	if (count > INT32_MAX / 2)
		return gnp_error_set(error, GNP_NOT_ACCEPTABLE, "vtk: got %zu points, need at most %d", count, INT32_MAX / 2);
	gnp_status status = gnp_buffer_printf(buffer, error, "VERTICES %zu %zu\n", count, 2 * count);
	if (status == GNP_OK)
		status = gnp_buffer_reserve(buffer, 8 * count + 1, error);
	if (status != GNP_OK)
		return status;
	for (size_t i = 0; i < count; i++) {
		uint32_t cell[2] = {__builtin_bswap32(1), __builtin_bswap32((uint32_t)i)};
		memcpy(buffer->data + buffer->size, cell, sizeof cell);
		buffer->size += sizeof cell;
	}
	return gnp_buffer_append(buffer, "\n", 1, error);
}

/* The title holds one line of at most 255 characters. */
static gnp_status write_title(const struct gnp_values *comments, struct gnp_buffer *buffer, struct gnp_error *error)
{
	struct gnp_buffer lines = {0};
	gnp_status status = gnp_comments_write(comments, "", &lines, error);
	if (status == GNP_OK)
		status = gnp_buffer_printf(&lines, error, "gnpd");
	for (size_t i = 0; status == GNP_OK && i < lines.size; i++) {
		if (lines.data[i] == '\n')
			lines.data[i] = ',';
	}
	if (status == GNP_OK)
		status = gnp_buffer_printf(buffer, error, "# vtk DataFile Version 3.0\n%.*s\nBINARY\nDATASET POLYDATA\n",
		                           (int)(lines.size < 255 ? lines.size : 255), (const char *)lines.data);
	gnp_buffer_clear(&lines);
	return status;
}

static gnp_status write_report(const struct gnp_values *comments, struct gnp_buffer *buffer, struct gnp_error *error)
{
	struct gnp_buffer json = {0};
	gnp_status status = gnp_parameters_write(comments, &json, error);
	if (status == GNP_OK)
		status = gnp_buffer_printf(buffer, error,
		                           "FIELD FieldData 1\n" GNP_PARAMETERS_NAME " 1 %zu unsigned_char\n%.*s\n", json.size,
		                           (int)json.size, (const char *)json.data);
	gnp_buffer_clear(&json);
	return status;
}

static bool is_normals(const struct gnp_tensor *tensor)
{
	return strcmp(tensor->name, "normals") == 0 && tensor->rank == 2 && tensor->shape[1] == 3;
}

/* One attribute; `points` itself is none. */
static gnp_status write_field(const struct gnp_tensor *tensor, size_t rows, struct gnp_buffer *buffer,
                              struct gnp_error *error)
{
	size_t width = rows ? tensor->size / gnp_datatype_size(tensor->datatype) / rows : 1;
	gnp_status status = gnp_buffer_printf(buffer, error, "%s %zu %zu %s\n", tensor->name, width, rows,
	                                      type_name(tensor));
	return status == GNP_OK ? write_numbers(tensor, buffer, error) : status;
}

static gnp_status write_attributes(const struct gnp_tensors *tensors, const struct gnp_tensor *points,
                                   struct gnp_buffer *buffer, struct gnp_error *error)
{
	size_t rows = points->shape[0], fields = 0;
	gnp_status status = gnp_buffer_printf(buffer, error, "POINT_DATA %zu\n", rows);
	for (size_t i = 0; i < tensors->count && status == GNP_OK; i++) {
		const struct gnp_tensor *t = &tensors->items[i];
		if (!is_normals(t)) {
			fields += t != points;
			continue;
		}
		status = gnp_buffer_printf(buffer, error, "NORMALS normals %s\n", type_name(t));
		if (status == GNP_OK)
			status = write_numbers(t, buffer, error);
	}
	if (status == GNP_OK && fields)
		status = gnp_buffer_printf(buffer, error, "FIELD quantities %zu\n", fields);
	for (size_t i = 0; i < tensors->count && status == GNP_OK; i++) {
		if (&tensors->items[i] != points && !is_normals(&tensors->items[i]))
			status = write_field(&tensors->items[i], rows, buffer, error);
	}
	return status;
}

static gnp_status encode_file(const struct gnp_tensors *tensors, const struct gnp_values *comments,
                              struct gnp_buffer *buffer, struct gnp_error *error)
{
	struct gnp_row_item *items;
	size_t count;
	gnp_status status = gnp_row_items(tensors, "vtk", "", false, &items, &count, error); /* checks the rows */
	if (status != GNP_OK)
		return status;
	const struct gnp_tensor *points = items[0].tensor;
	free(items);
	status = write_title(comments, buffer, error);
	if (status == GNP_OK && comments && comments->count)
		status = write_report(comments, buffer, error);
	if (status == GNP_OK)
		status = gnp_buffer_printf(buffer, error, "POINTS %zu %s\n", points->shape[0], type_name(points));
	if (status == GNP_OK)
		status = write_numbers(points, buffer, error);
	if (status == GNP_OK)
		status = write_vertices(points->shape[0], buffer, error);
	return status == GNP_OK ? write_attributes(tensors, points, buffer, error) : status;
}

/* ---- Reading what an answer says of itself ---- */

/* The field that answers have, or the title. */
static gnp_status parameters(const unsigned char *body, size_t size, struct gnp_values *values, struct gnp_error *error)
{
	enum { HEAD = 1024 };
	static const char field[] = "\nFIELD FieldData 1\n" GNP_PARAMETERS_NAME " 1 ";
	const char *text = (const char *)body, *end = text + size;
	const char *at = memmem(text, size < HEAD ? size : HEAD, field, sizeof field - 1);
	size_t count = 0;
	for (at = at ? at + sizeof field - 1 : NULL; at && at < end && *at >= '0' && *at <= '9' && count <= size; at++)
		count = 10 * count + (size_t)(*at - '0');
	const char *data = at ? memchr(at, '\n', (size_t)(end - at)) : NULL;
	if (data && count < (size_t)(end - data))
		return gnp_parameters_read(data + 1, count, values, error);
	const char *first = memchr(text, '\n', size), *title = first ? first + 1 : end,
	                    *stop = memchr(title, '\n', (size_t)(end - title));
	return stop ? gnp_comments_add(title, stop, values, error) : GNP_OK;
}

static const char *const magic[] = {"# vtk DataFile", NULL};
static const char *const other_media_types[] = {"application/vtk", NULL};

const struct gnp_format gnp_format_vtk = {
	.name = "vtk", .media_type = "application/x-vtk", .extension = "vtk", .other_media_types = other_media_types,
	.holds = GNP_HOLDS_ROWS, .magic = magic, .encode = encode_file, .parameters = parameters};
