/* Encodes requests and responses of the Open Inference Protocol (oip.h). */
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "proto/json/json_numbers.h"
#include "proto/oip/oip.h"
#include "proto/oip/oip_tensor.h"

/* ,"parameters":{"binary_data_size":n}} */
static gnp_status close_binary(const struct gnp_tensor *tensor, struct gnp_buffer *buffer, struct gnp_error *error)
{
	return gnp_buffer_printf(buffer, error, ",\"parameters\":{\"binary_data_size\":%zu}}", tensor->size);
}

static gnp_status close_json(const struct gnp_tensor *tensor, struct gnp_buffer *buffer, struct gnp_error *error)
{
	if (tensor->datatype == GNP_FP16 || tensor->datatype == GNP_BYTES)
		return gnp_error_set(error, GNP_NOT_ACCEPTABLE, "output \"%s\": %s has no JSON form: ask for binary data",
		                     tensor->name, gnp_datatype_name(tensor->datatype));
	gnp_status status = gnp_buffer_append(buffer, ",\"data\":", 8, error);
	if (status == GNP_OK)
		status = gnp_json_numbers_write(tensor, false, buffer, error);
	return status == GNP_OK ? gnp_buffer_append(buffer, "}", 1, error) : status;
}

static gnp_status encode_output(const struct gnp_tensor *tensor, bool binary, struct gnp_buffer *head,
                                struct gnp_error *error)
{
	gnp_status status = gnp_oip_encode_tensor(tensor, head, error);
	if (status != GNP_OK)
		return status;
	return binary ? close_binary(tensor, head, error) : close_json(tensor, head, error);
}

/* The outputs in the order asked for, or all of the response's. tails has room for every one. */
static gnp_status encode_outputs(const struct gnp_request *request, const struct gnp_response *response,
                                 struct gnp_buffer *head, const struct gnp_tensor **tails, size_t *tail_count,
                                 struct gnp_error *error)
{
	size_t count = request->output_count ? request->output_count : response->outputs.count;
	for (size_t i = 0; i < count; i++) {
		bool binary = request->output_count ? request->outputs[i].binary : request->binary_default;
		const struct gnp_tensor *tensor = request->output_count
		                                      ? gnp_tensors_find(&response->outputs, request->outputs[i].name)
		                                      : &response->outputs.items[i];
		if (!tensor)
			return gnp_error_set(error, GNP_INTERNAL, "output \"%s\": was asked for and not made", request->outputs[i].name);
		gnp_status status = i ? gnp_buffer_append(head, ",", 1, error) : GNP_OK;
		if (status == GNP_OK)
			status = encode_output(tensor, binary, head, error);
		if (status != GNP_OK)
			return status;
		if (binary)
			tails[(*tail_count)++] = tensor;
	}
	return GNP_OK;
}

static gnp_status encode_head(const struct gnp_operation *operation, const struct gnp_request *request,
                              const struct gnp_response *response, struct gnp_buffer *head, struct gnp_error *error)
{
	gnp_status status = gnp_buffer_printf(head, error, "{\"model_name\":\"%s\",\"model_version\":\"1\"", operation->name);
	if (status == GNP_OK && request->id) {
		status = gnp_buffer_append(head, ",\"id\":", 6, error);
		if (status == GNP_OK)
			status = gnp_json_write_string(request->id, head, error);
	}
	if (status == GNP_OK && response->parameters.count) {
		status = gnp_buffer_append(head, ",\"parameters\":", 14, error);
		if (status == GNP_OK)
			status = gnp_json_write_values(&response->parameters, head, error);
	}
	return status == GNP_OK ? gnp_buffer_append(head, ",\"outputs\":[", 12, error) : status;
}

gnp_status gnp_oip_encode_response(const struct gnp_operation *operation, const struct gnp_request *request,
                                   const struct gnp_response *response, struct gnp_buffer *head,
                                   const struct gnp_tensor ***tails, size_t *tail_count, struct gnp_error *error)
{
	size_t count = request->output_count ? request->output_count : response->outputs.count, made_count = 0;
	const struct gnp_tensor **made = gnp_array_new(count, sizeof *made);
	if (!made)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "response: no memory for %zu outputs", count);
	size_t before = head->size;
	gnp_status status = encode_head(operation, request, response, head, error);
	if (status == GNP_OK)
		status = encode_outputs(request, response, head, made, &made_count, error);
	if (status == GNP_OK)
		status = gnp_buffer_append(head, "]}", 2, error);
	if (status != GNP_OK) {
		head->size = before;
		free(made);
		return status;
	}
	*tails = made;
	*tail_count = made_count;
	return GNP_OK;
}

static gnp_status encode_choices(const struct gnp_request *request, struct gnp_buffer *body, struct gnp_error *error)
{
	gnp_status status = gnp_buffer_append(body, ",\"outputs\":[", 12, error);
	for (size_t i = 0; i < request->output_count && status == GNP_OK; i++) {
		status = gnp_buffer_printf(body, error, "%s{\"name\":", i ? "," : "");
		if (status == GNP_OK)
			status = gnp_json_write_string(request->outputs[i].name, body, error);
		if (status == GNP_OK)
			status = gnp_buffer_printf(body, error, ",\"parameters\":{\"binary_data\":%s}}",
			                           request->outputs[i].binary ? "true" : "false");
	}
	return status == GNP_OK ? gnp_buffer_append(body, "]", 1, error) : status;
}

/* The parameters with binary_data_output put right by binary_default. */
static gnp_status encode_parameters(const struct gnp_request *request, struct gnp_buffer *body, struct gnp_error *error)
{
	gnp_status status = gnp_buffer_append(body, ",\"parameters\":", 14, error);
	if (status == GNP_OK)
		status = gnp_json_write_values(&request->parameters, body, error);
	if (status != GNP_OK || !request->binary_default || gnp_values_find(&request->parameters, "binary_data_output"))
		return status;
	body->size--; /* the closing brace */
	return gnp_buffer_printf(body, error, "%s\"binary_data_output\":true}", request->parameters.count ? "," : "");
}

static gnp_status encode_inputs(const struct gnp_tensors *inputs, struct gnp_buffer *body, struct gnp_error *error)
{
	gnp_status status = gnp_buffer_append(body, ",\"inputs\":[", 11, error);
	for (size_t i = 0; i < inputs->count && status == GNP_OK; i++) {
		status = i ? gnp_buffer_append(body, ",", 1, error) : GNP_OK;
		if (status == GNP_OK)
			status = gnp_oip_encode_tensor(&inputs->items[i], body, error);
		if (status == GNP_OK)
			status = close_binary(&inputs->items[i], body, error);
	}
	return status == GNP_OK ? gnp_buffer_append(body, "]}", 2, error) : status;
}

gnp_status gnp_oip_encode_request(const struct gnp_request *request, struct gnp_buffer *body, size_t *header_length,
                                  struct gnp_error *error)
{
	size_t before = body->size;
	gnp_status status = gnp_buffer_append(body, "{\"id\":", 6, error);
	if (status == GNP_OK)
		status = gnp_json_write_string(request->id ? request->id : "", body, error);
	if (status == GNP_OK)
		status = encode_parameters(request, body, error);
	if (status == GNP_OK && request->output_count)
		status = encode_choices(request, body, error);
	if (status == GNP_OK)
		status = encode_inputs(&request->inputs, body, error);
	size_t json = body->size - before;
	for (size_t i = 0; i < request->inputs.count && status == GNP_OK; i++)
		status = gnp_buffer_append(body, request->inputs.items[i].data, request->inputs.items[i].size, error);
	if (status == GNP_OK)
		*header_length = json;
	else
		body->size = before;
	return status;
}
