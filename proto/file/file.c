#include "proto/file/file.h"

static gnp_status take_all(struct gnp_tensors *from, struct gnp_tensors *to, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	size_t before = to->count;
	for (size_t i = 0; i < from->count && status == GNP_OK; i++) {
		struct gnp_tensor *t = &from->items[i];
		status = gnp_tensors_add_data(to, t->name, t->datatype, t->rank, t->shape, t->data, t->owned, NULL, error);
	}
	if (status != GNP_OK) {
		to->count = before; /* still owned by `from` */
		return status;
	}
	for (size_t i = 0; i < from->count; i++)
		from->items[i].owned = false;
	return GNP_OK;
}

/* A list of single numbers serves an input of rank 2 as its only column. */
static void give_columns(const struct gnp_decode *request, struct gnp_tensors *tensors)
{
	for (size_t i = 0; i < tensors->count; i++) {
		struct gnp_tensor *tensor = &tensors->items[i];
		const struct gnp_tensor_info *info = gnp_decode_input(request, tensor->name);
		if (info && info->rank == 2 && tensor->rank == 1) {
			tensor->rank = 2;
			tensor->shape[1] = 1;
		}
	}
}

static gnp_status decode(const struct gnp_format *format, const struct gnp_decode *request, struct gnp_tensors *tensors,
                         struct gnp_error *error)
{
	if (!gnp_format_readable(format))
		return gnp_error_set(error, GNP_UNSUPPORTED_MEDIA, "format %s cannot be read", gnp_format_name(format));
	struct gnp_tensors made = {.budget = tensors->budget};
	gnp_status status = format->decode(request, &made, error);
	if (status == GNP_OK) {
		give_columns(request, &made);
		status = take_all(&made, tensors, error);
	}
	gnp_tensors_clear(&made);
	return status;
}

gnp_status gnp_file_decode(const struct gnp_format *format, const unsigned char *body, size_t size,
                           const struct gnp_file_wants *wants, struct gnp_tensors *tensors, struct gnp_error *error)
{
	struct gnp_decode request = {.body = body, .size = size, .wants = wants ? *wants : (struct gnp_file_wants){0}};
	return decode(format, &request, tensors, error);
}

gnp_status gnp_file_decode_all(const struct gnp_format *format, const unsigned char *body, size_t size,
                               struct gnp_tensors *tensors, struct gnp_error *error)
{
	struct gnp_decode request = {.body = body, .size = size, .all = true};
	return decode(format, &request, tensors, error);
}

gnp_status gnp_file_encode(const struct gnp_format *format, const struct gnp_tensors *tensors,
                           const struct gnp_values *comments, struct gnp_buffer *buffer, struct gnp_error *error)
{
	if (!gnp_format_writable(format))
		return gnp_error_set(error, GNP_NOT_ACCEPTABLE, "format %s cannot be written", gnp_format_name(format));
	size_t before = buffer->size;
	gnp_status status = format->encode(tensors, comments, buffer, error);
	if (status != GNP_OK)
		buffer->size = before;
	return status;
}

gnp_status gnp_file_parameters(const struct gnp_format *format, const unsigned char *body, size_t size,
                               struct gnp_values *values, struct gnp_error *error)
{
	return format && format->parameters ? format->parameters(body, size, values, error) : GNP_OK;
}
