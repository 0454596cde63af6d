#include "proto/operation/call.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#include "core/base/names.h"
#include "proto/operation/parameter.h"
#include "proto/tensor/number.h"

/* Keys that other servers of the protocol define and their clients send by themselves. */
static bool is_foreign(const char *name)
{
	return strcmp(name, "priority") == 0 || strcmp(name, "timeout") == 0 || strcmp(name, "binary_data_output") == 0 ||
	       strncmp(name, "sequence_", 9) == 0 || strncmp(name, "triton_", 7) == 0;
}

static gnp_status check_parameters(struct gnp_call *call, struct gnp_error *error)
{
	const struct gnp_values *values = &call->request->parameters;
	for (size_t i = 0; i < values->count; i++) {
		if (is_foreign(values->items[i].name))
			continue;
		for (size_t j = 0; j < i; j++) {
			if (strcmp(values->items[i].name, values->items[j].name) == 0)
				return gnp_error_set(error, GNP_INVALID_ARGUMENT, "parameter \"%.60s\": given twice",
				                     values->items[i].name);
		}
		gnp_status status = gnp_parameter_set(call->operation, call->options, &values->items[i], error);
		if (status != GNP_OK)
			return status;
	}
	return GNP_OK;
}

/* The parameter that chooses outputs; NULL: all are answered. */
static const struct gnp_parameter *find_set(const struct gnp_operation *operation)
{
	for (size_t i = 0; i < operation->parameter_count; i++)
		if (operation->parameters[i].type == GNP_PARAMETER_SET)
			return &operation->parameters[i];
	return NULL;
}

/* Requested outputs replace what the operation's set parameter says. */
static gnp_status check_outputs(struct gnp_call *call, struct gnp_error *error)
{
	const struct gnp_operation *operation = call->operation;
	uint64_t mask = 0;
	for (size_t i = 0; i < call->request->output_count; i++) {
		const char *name = call->request->outputs[i].name;
		const struct gnp_tensor_info *info =
			gnp_tensor_infos_find(operation->outputs, operation->output_count, name, strlen(name));
		if (!info) {
			struct gnp_names list;
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "unknown output \"%.40s\", known: %s", name,
			                     gnp_tensor_infos_names(operation->outputs, operation->output_count, name, strlen(name),
			                                            &list));
		}
		uint64_t bit = UINT64_C(1) << (info - operation->outputs);
		if (mask & bit)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "output \"%s\": asked for twice", name);
		mask |= bit;
	}
	const struct gnp_parameter *set = find_set(operation);
	if (mask && set)
		*(uint64_t *)(void *)(call->options + set->offset) = mask;
	return GNP_OK;
}

static void write_shape(const struct gnp_tensor *tensor, char *text, size_t size)
{
	size_t length = (size_t)snprintf(text, size, "[");
	for (unsigned d = 0; d < tensor->rank && length < size; d++)
		length += (size_t)snprintf(text + length, size - length, "%s%zu", d ? "," : "", tensor->shape[d]);
	if (length < size)
		snprintf(text + length, size - length, "]");
}

static void write_need(const struct gnp_tensor_info *info, char *text, size_t size)
{
	size_t length = (size_t)snprintf(text, size, "[");
	for (unsigned d = 0; d < info->rank && length < size; d++) {
		const char *comma = d ? "," : "";
		if (info->shape[d] >= 0)
			length += (size_t)snprintf(text + length, size - length, "%s%" PRId64, comma, info->shape[d]);
		else
			length += (size_t)snprintf(text + length, size - length, "%s%c", comma, gnp_extent_letter(info->shape[d]));
	}
	if (length < size)
		snprintf(text + length, size - length, "]");
}

static gnp_status check_shape(const struct gnp_tensor_info *info, const struct gnp_tensor *tensor,
                              struct gnp_error *error)
{
	char got[80], need[80];
	bool fits = tensor->rank == info->rank;
	for (unsigned d = 0; d < info->rank; d++)
		fits = fits && (info->shape[d] < 0 || tensor->shape[d] == (size_t)info->shape[d]);
	if (fits)
		return GNP_OK;
	write_shape(tensor, got, sizeof got);
	write_need(info, need, sizeof need);
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "input \"%s\": shape %s, need %s", info->name, got, need);
}

/* *points: of the inputs before; SIZE_MAX: not known yet. */
static gnp_status check_rows(const struct gnp_tensor_info *info, const struct gnp_tensor *tensor, size_t *points,
                             struct gnp_error *error)
{
	for (unsigned d = 0; d < info->rank; d++) {
		if (info->shape[d] != -1)
			continue;
		if (*points == SIZE_MAX)
			*points = tensor->shape[d];
		if (tensor->shape[d] != *points)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT,
			                     "input \"%s\": %zu rows, need %zu as the input before it has",
			                     info->name, tensor->shape[d], *points);
	}
	return GNP_OK;
}

/* Masks come in any type; a byte of BOOL is looked at as the number it is. */
static gnp_status check_bools(const struct gnp_tensor *tensor, struct gnp_error *error)
{
	struct gnp_tensor numbers = *tensor;
	size_t count = tensor->size / gnp_datatype_size(tensor->datatype);
	if (tensor->datatype == GNP_BOOL)
		numbers.datatype = GNP_UINT8;
	for (size_t i = 0; i < count; i++) {
		double value = gnp_tensor_get(&numbers, i);
		char got[GNP_NUMBER_LENGTH_MAX];
		if (value == 0 || value == 1)
			continue;
		int length = (int)gnp_number_write_double(got, value);
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s[%zu]: got %.*s, need 0 or 1", tensor->name, i, length,
		                     got);
	}
	return GNP_OK;
}

static gnp_status check_input(const struct gnp_tensor_info *info, const struct gnp_tensor *tensor, size_t *points,
                              struct gnp_error *error)
{
	gnp_status status = check_shape(info, tensor, error);
	if (status != GNP_OK)
		return status;
	if (info->datatype != GNP_BOOL && tensor->datatype == GNP_BOOL)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "input \"%s\": datatype %s, need a numeric one, for example %s",
		                     info->name, gnp_datatype_name(tensor->datatype), gnp_datatype_name(info->datatype));
	status = check_rows(info, tensor, points, error);
	return status == GNP_OK && info->datatype == GNP_BOOL ? check_bools(tensor, error) : status;
}

static gnp_status check_inputs(struct gnp_call *call, struct gnp_error *error)
{
	const struct gnp_operation *operation = call->operation;
	const struct gnp_tensors *inputs = &call->request->inputs;
	struct gnp_names list;
	for (size_t i = 0; i < inputs->count; i++) {
		const char *name = inputs->items[i].name;
		if (!gnp_tensor_infos_find(operation->inputs, operation->input_count, name, strlen(name)))
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "unknown input \"%.60s\", known: %s", name,
			                     gnp_tensor_infos_names(operation->inputs, operation->input_count, name, strlen(name),
			                                            &list));
		if (gnp_tensors_find(inputs, name) != &inputs->items[i])
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "input \"%s\": given twice", name);
	}
	size_t points = SIZE_MAX;
	for (size_t i = 0; i < operation->input_count; i++) {
		const struct gnp_tensor_info *info = &operation->inputs[i];
		const struct gnp_tensor *tensor = gnp_tensors_find(inputs, info->name);
		if (!tensor && !info->optional)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "input \"%s\": missing", info->name);
		gnp_status status = tensor ? check_input(info, tensor, &points, error) : GNP_OK;
		if (status != GNP_OK)
			return status;
	}
	call->points = points == SIZE_MAX ? 0 : points;
	return GNP_OK;
}

gnp_status gnp_call_prepare(const struct gnp_operation *operation, const struct gnp_request *request,
                            const struct gnp_limits *limits, struct gnp_call *call, struct gnp_error *error)
{
	struct gnp_call made = {.operation = operation, .request = request};
	gnp_status status = check_inputs(&made, error);
	if (status != GNP_OK)
		return status;
	if (limits && limits->points && made.points > limits->points)
		return gnp_error_set(error, GNP_TOO_LARGE, "points: got %zu, need at most %zu", made.points, limits->points);
	operation->defaults(made.options);
	status = check_parameters(&made, error);
	if (status == GNP_OK)
		status = check_outputs(&made, error);
	if (status == GNP_OK && operation->resolve)
		status = operation->resolve(made.options, limits ? limits->models : NULL, error);
	made.models = limits ? limits->models : NULL;
	made.cache = limits ? limits->cache : NULL;
	if (status == GNP_OK && operation->check)
		status = operation->check(&made, error);
	if (status != GNP_OK)
		return status;
	made.memory = operation->memory(&made);
	*call = made;
	return GNP_OK;
}

uint64_t gnp_call_outputs(const struct gnp_call *call)
{
	const struct gnp_parameter *set = find_set(call->operation);
	if (set)
		return *(const uint64_t *)(const void *)(call->options + set->offset);
	return (UINT64_C(1) << call->operation->output_count) - 1;
}

bool gnp_call_names_outputs(const struct gnp_call *call)
{
	const struct gnp_parameter *set = find_set(call->operation);
	const struct gnp_value *value = set ? gnp_values_find(&call->request->parameters, set->name) : NULL;
	return call->request->output_count ||
	       (value && value->type == GNP_VALUE_STRING && strcmp(value->string, "all") != 0);
}

size_t gnp_call_rows(const struct gnp_call *call, int64_t extent)
{
	const struct gnp_operation *operation = call->operation;
	if (extent >= 0)
		return (size_t)extent;
	if (extent == -1)
		return call->points;
	for (size_t i = 0; i < operation->input_count; i++) {
		const struct gnp_tensor_info *info = &operation->inputs[i];
		const struct gnp_tensor *tensor = gnp_tensors_find(&call->request->inputs, info->name);
		for (unsigned d = 0; tensor && d < info->rank; d++)
			if (info->shape[d] == extent)
				return tensor->shape[d];
	}
	return operation->rows ? operation->rows(call, extent) : GNP_ROWS_OPEN;
}

gnp_status gnp_call_run(const struct gnp_call *call, struct gnp_pool *pool, struct gnp_task *task,
                        struct gnp_response *response, struct gnp_error *error)
{
	struct gnp_task own;
	gnp_task_init(&own); /* warnings go through a task */
	gnp_status status = call->operation->run(call, pool, task ? task : &own, response, error);
	if (status != GNP_OK)
		gnp_response_clear(response);
	return status;
}
