/* Decodes requests and responses of the Open Inference Protocol (oip.h). */
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "proto/oip/oip.h"
#include "proto/oip/oip_tensor.h"

gnp_status gnp_oip_header_length(const char *text, size_t body_size, size_t *header_length, struct gnp_error *error)
{
	size_t length = 0;
	const char *p = text;
	for (; *p >= '0' && *p <= '9'; p++) {
		if (__builtin_mul_overflow(length, 10, &length) || __builtin_add_overflow(length, (size_t)(*p - '0'), &length))
			length = SIZE_MAX - 9;
	}
	if (*p || p == text)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "Inference-Header-Content-Length: got \"%.40s\", need an integer of at least 0", text);
	if (length > body_size)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "Inference-Header-Content-Length: got %.40s, need at most the body's %zu bytes", text, body_size);
	*header_length = length;
	return GNP_OK;
}

/* The whole body is the one input's numbers. The answer is binary as the question was. */
static gnp_status decode_raw(const unsigned char *body, size_t size, struct gnp_request *request, struct gnp_error *error)
{
	enum { POINT_BYTES = 12 };
	if (size % POINT_BYTES)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "body: got %zu bytes, raw FP32 points [n,3] need a multiple of %d", size, POINT_BYTES);
	size_t shape[] = {size / POINT_BYTES, 3};
	struct gnp_tensor *tensor;
	gnp_status status;
	request->binary_default = true;
	if ((uintptr_t)body % sizeof(float) == 0)
		return gnp_tensors_add_data(&request->inputs, "points", GNP_FP32, 2, shape, (void *)(uintptr_t)body, false, NULL,
		                            error);
	status = gnp_tensors_add(&request->inputs, "points", GNP_FP32, 2, shape, &tensor, error);
	if (status == GNP_OK)
		memcpy(tensor->data, body, size);
	return status;
}

/* NULL for one that is absent or null: clients with optional fields write either. */
static const json_t *member(const json_t *object, const char *key)
{
	const json_t *value = json_object_get(object, key);
	return json_is_null(value) ? NULL : value;
}

static gnp_status decode_choice(const json_t *object, size_t index, bool binary, struct gnp_output_choice *choice,
                                struct gnp_error *error)
{
	const char *name = json_string_value(json_object_get(object, "name"));
	if (!name || strlen(name) >= sizeof choice->name)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "outputs[%zu]: name: need a string of at most %d bytes", index,
		                     GNP_TENSOR_NAME_MAX - 1);
	strcpy(choice->name, name);
	choice->binary = binary;
	const json_t *parameters = member(object, "parameters");
	if (parameters && !json_is_object(parameters))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "output \"%s\": parameters: need an object", name);
	const char *key;
	json_t *value;
	json_object_foreach((json_t *)(uintptr_t)parameters, key, value) {
		if (strcmp(key, "binary_data") != 0)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "output \"%s\": unknown parameter \"%.60s\", known: binary_data",
			                     name, key);
		if (!json_is_boolean(value))
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "output \"%s\": binary_data: need true or false", name);
		choice->binary = json_is_true(value);
	}
	return GNP_OK;
}

static gnp_status decode_choices(const json_t *outputs, struct gnp_request *request, struct gnp_error *error)
{
	enum { CHOICES_MAX = 256 };
	if (!outputs)
		return GNP_OK;
	size_t count = json_array_size(outputs);
	if (!json_is_array(outputs) || count > CHOICES_MAX)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "outputs: need an array of at most %d objects", CHOICES_MAX);
	request->outputs = gnp_array_zero(count, sizeof *request->outputs);
	if (!request->outputs)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "outputs: no memory for %zu", count);
	for (size_t i = 0; i < count; i++) {
		gnp_status status = decode_choice(json_array_get(outputs, i), i, request->binary_default, &request->outputs[i], error);
		if (status != GNP_OK)
			return status;
		for (size_t j = 0; j < i; j++) {
			if (strcmp(request->outputs[i].name, request->outputs[j].name) == 0)
				return gnp_error_set(error, GNP_INVALID_ARGUMENT, "outputs: \"%s\" is asked for twice", request->outputs[i].name);
		}
		request->output_count++;
	}
	return GNP_OK;
}

static gnp_status decode_id(const json_t *id, char **out, struct gnp_error *error)
{
	if (!id)
		return GNP_OK;
	if (!json_is_string(id))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "id: need a string");
	*out = strdup(json_string_value(id));
	return *out ? GNP_OK : gnp_error_set(error, GNP_OUT_OF_MEMORY, "id: no memory");
}

static gnp_status decode_json(const struct gnp_json_document *document, struct gnp_oip_binary *binary,
                              struct gnp_request *request, struct gnp_error *error)
{
	const json_t *root = document->root;
	gnp_status status = decode_id(member(root, "id"), &request->id, error);
	if (status == GNP_OK)
		status = gnp_oip_decode_values(member(root, "parameters"), &request->parameters, error);
	if (status != GNP_OK)
		return status;
	const struct gnp_value *all = gnp_values_find(&request->parameters, "binary_data_output");
	if (all && all->type != GNP_VALUE_BOOL)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "binary_data_output: need true or false");
	request->binary_default = all && all->boolean;
	status = decode_choices(member(root, "outputs"), request, error);
	return status == GNP_OK ? gnp_oip_decode_tensors(document, "inputs", binary, &request->inputs, error) : status;
}

gnp_status gnp_oip_decode_request(const unsigned char *body, size_t size, size_t header_length,
                                  struct gnp_request *request, struct gnp_error *error)
{
	struct gnp_request made = {.inputs.budget = request->inputs.budget};
	struct gnp_json_document document = {0};
	struct gnp_oip_binary binary;
	gnp_status status;
	if (header_length == 0) {
		status = decode_raw(body, size, &made, error);
	} else {
		status = gnp_oip_split(body, size, header_length, made.inputs.budget, &document, &binary, error);
		if (status == GNP_OK)
			status = decode_json(&document, &binary, &made, error);
	}
	gnp_json_clear(&document);
	if (status == GNP_OK)
		*request = made;
	else
		gnp_request_clear(&made);
	return status;
}

gnp_status gnp_oip_decode_response(const unsigned char *body, size_t size, size_t header_length,
                                   struct gnp_response *response, struct gnp_error *error)
{
	struct gnp_response made = {0};
	struct gnp_json_document document = {0};
	struct gnp_oip_binary binary;
	gnp_status status = gnp_oip_split(body, size, header_length, NULL, &document, &binary, error);
	if (status == GNP_OK)
		status = gnp_oip_decode_values(json_object_get(document.root, "parameters"), &made.parameters, error);
	if (status == GNP_OK)
		status = gnp_oip_decode_tensors(&document, "outputs", &binary, &made.outputs, error);
	gnp_json_clear(&document);
	if (status == GNP_OK)
		*response = made;
	else
		gnp_response_clear(&made);
	return status;
}

static bool is_space(char c)
{
	return c == ' ' || c == '\t' || c == '\r' || c == '\n';
}

bool gnp_oip_is_request(const unsigned char *body, size_t size)
{
	static const char member[] = "\"inputs\"";
	const char *p = (const char *)body, *end = p + size;
	size_t depth = 0;
	while (p < end) {
		char c = *p;
		if (c == '"') {
			const char *start = p, *after = p = gnp_json_skip_string(p, end);
			while (after < end && is_space(*after))
				after++;
			if (depth == 1 && after < end && *after == ':' && p - start == sizeof member - 1 &&
			    memcmp(start, member, sizeof member - 1) == 0)
				return true;
			continue;
		}
		if (depth == 0 && c != '{' && !is_space(c))
			return false;
		depth += c == '{' || c == '[';
		depth -= c == '}' || c == ']';
		if (depth == 0 && c == '}')
			return false; /* the object is over */
		p++;
	}
	return false;
}
