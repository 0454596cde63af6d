#include "result.h"

#include <stdlib.h>

#include "memory.h"

static gnp_status borrow(struct gnp_tensors *tensors, const struct gnp_tensor *tensor, struct gnp_error *error)
{
	return gnp_tensors_add_data(tensors, tensor->name, tensor->datatype, tensor->rank, tensor->shape, tensor->data, false, NULL,
	                            error);
}

/* Whether a file of the format can hold the tensor beside the points. */
static bool is_carried(enum gnp_format format, const struct gnp_tensor *points, const struct gnp_tensor *tensor)
{
	return !gnp_format_of_rows(format) || !points || (tensor->rank && tensor->shape[0] == points->shape[0]);
}

/* Borrows what is carried; the names of the rest go to left_out. */
static gnp_status collect(enum gnp_format format, const struct gnp_tensor *points, const struct gnp_tensors *outputs,
                          struct gnp_tensors *tensors, struct gnp_buffer *left_out, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	if (points && !gnp_tensors_find(outputs, "points"))
		status = borrow(tensors, points, error);
	for (size_t i = 0; i < outputs->count && status == GNP_OK; i++) {
		const struct gnp_tensor *output = &outputs->items[i];
		if (is_carried(format, points, output))
			status = borrow(tensors, output, error);
		else
			status = gnp_buffer_printf(left_out, error, "%s%s", left_out->size ? ", " : "", output->name);
	}
	return status;
}

/* The comments with `left_out` before them: where a format cuts them short, this one is kept. */
static gnp_status encode_with(enum gnp_format format, const struct gnp_tensors *tensors, const struct gnp_values *comments,
                              const struct gnp_buffer *left_out, struct gnp_buffer *buffer, struct gnp_error *error)
{
	struct gnp_value first = {.name = "left_out", .type = GNP_VALUE_STRING, .string = (char *)left_out->data};
	struct gnp_values all = {.count = comments->count + 1};
	all.items = gnp_array_new(all.count, sizeof *all.items);
	if (!all.items)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "result: no memory for %zu comments", all.count);
	all.items[0] = first;
	for (size_t i = 0; i < comments->count; i++)
		all.items[i + 1] = comments->items[i];
	gnp_status status = gnp_file_encode(format, tensors, &all, buffer, error);
	free(all.items); /* what they hold is borrowed */
	return status;
}

gnp_status gnp_result_encode(enum gnp_format format, const struct gnp_request *request, const struct gnp_response *response,
                             struct gnp_buffer *buffer, struct gnp_error *error)
{
	const struct gnp_tensors *outputs = &response->outputs;
	const struct gnp_tensor *points = gnp_tensors_find(outputs, "points");
	struct gnp_tensors tensors = {0};
	struct gnp_buffer left_out = {0};
	if (!points)
		points = gnp_tensors_find(&request->inputs, "points");
	gnp_status status = collect(format, points, outputs, &tensors, &left_out, error);
	bool nothing = left_out.size && tensors.count == !gnp_tensors_find(outputs, "points");
	if (status == GNP_OK && nothing)
		status = gnp_error_set(error, GNP_NOT_ACCEPTABLE, "%s: the points have %zu rows, and other numbers of rows have %.200s: ask for npz or json",
		                       gnp_format_name(format), points->shape[0], (const char *)left_out.data);
	if (status == GNP_OK && left_out.size)
		status = encode_with(format, &tensors, &response->parameters, &left_out, buffer, error);
	else if (status == GNP_OK)
		status = gnp_file_encode(format, &tensors, &response->parameters, buffer, error);
	gnp_buffer_clear(&left_out);
	gnp_tensors_clear(&tensors);
	return status;
}
