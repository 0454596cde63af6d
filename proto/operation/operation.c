#include "proto/operation/operation.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/names.h"
#include "proto/operation/operation_table.h"
#include "proto/tensor/number.h"

static const struct gnp_operation *const operations[] = {&gnp_operation_estimate, &gnp_operation_filter,
                                                         &gnp_operation_flow, &gnp_operation_laplacian, &gnp_operation_poisson,
                                                         &gnp_operation_heat, &gnp_operation_geodesic, &gnp_operation_spectrum};
_Static_assert(sizeof operations / sizeof operations[0] == GNP_OPERATIONS, "tables beside this one have a row for each operation");

const struct gnp_operation *gnp_operation_at(size_t i)
{
	return i < GNP_OPERATIONS ? operations[i] : NULL;
}

const struct gnp_operation *gnp_operation_find(const char *name)
{
	for (size_t i = 0; gnp_operation_at(i); i++) {
		if (strcmp(operations[i]->name, name) == 0)
			return operations[i];
	}
	return NULL;
}

/* given: length bytes, not one of the tensors. */
static const char *list_tensors(const struct gnp_tensor_info *infos, size_t count, const char *given, size_t length, struct gnp_names *list)
{
	gnp_names_begin(list, given, length);
	for (size_t i = 0; i < count; i++)
		gnp_names_add(list, infos[i].name);
	return gnp_names_end(list);
}

static const struct gnp_tensor_info *tensor_info(const struct gnp_tensor_info *infos, size_t count, const char *name,
                                                 size_t length)
{
	for (size_t i = 0; i < count; i++) {
		if (strlen(infos[i].name) == length && memcmp(infos[i].name, name, length) == 0)
			return &infos[i];
	}
	return NULL;
}

static gnp_status bad(const struct gnp_parameter *parameter, const char *text, const char *need, struct gnp_error *error)
{
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: got \"%.60s\", need %s", parameter->name, text, need);
}

bool gnp_parameter_is_number(const struct gnp_parameter *parameter)
{
	return parameter->type == GNP_PARAMETER_INTEGER || parameter->type == GNP_PARAMETER_NUMBER ||
	       parameter->type == GNP_PARAMETER_AUTO;
}

static const char *number_text(double value, char text[GNP_NUMBER_LENGTH_MAX + 1])
{
	text[gnp_number_write_double(text, value)] = '\0';
	return text;
}

void gnp_parameter_range(const struct gnp_parameter *parameter, char text[GNP_PARAMETER_RANGE_MAX])
{
	char low[GNP_NUMBER_LENGTH_MAX + 1], high[GNP_NUMBER_LENGTH_MAX + 1];
	bool positive = parameter->minimum == GNP_ABOVE_ZERO;
	snprintf(text, GNP_PARAMETER_RANGE_MAX, "%s..%s", positive ? ">0" : number_text(parameter->minimum, low),
	         number_text(parameter->maximum, high));
}

static const char *auto_or(const struct gnp_parameter *p)
{
	return p->type == GNP_PARAMETER_AUTO ? "auto or " : "";
}

static gnp_status out_of_range(const struct gnp_parameter *p, double value, struct gnp_error *error)
{
	char got[GNP_NUMBER_LENGTH_MAX + 1], range[GNP_PARAMETER_RANGE_MAX];
	gnp_parameter_range(p, range);
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: got %s, need %s%s", p->name, number_text(value, got), auto_or(p),
	                     range);
}

static gnp_status set_number(const struct gnp_parameter *p, void *field, double value, struct gnp_error *error)
{
	if (!(value >= p->minimum && value <= p->maximum))
		return out_of_range(p, value, error);
	if (p->type != GNP_PARAMETER_INTEGER) {
		*(double *)field = value;
		return GNP_OK;
	}
	if (value != floor(value))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: got %.17g, need an integer", p->name, value);
	*(int *)field = (int)value;
	return GNP_OK;
}

static gnp_status parse_number(const struct gnp_parameter *p, void *field, const char *text, struct gnp_error *error)
{
	const char *end = text + strlen(text);
	double value;
	if (p->type == GNP_PARAMETER_AUTO && strcmp(text, "auto") == 0) {
		*(double *)field = NAN;
		return GNP_OK;
	}
	if (gnp_number_read(text, end, &value) == end && isfinite(value))
		return set_number(p, field, value, error);
	char need[32];
	snprintf(need, sizeof need, "%s%s", auto_or(p), p->type == GNP_PARAMETER_INTEGER ? "an integer" : "a number");
	return bad(p, text, need, error);
}

static gnp_status set_bool(const struct gnp_parameter *p, void *field, const char *text, struct gnp_error *error)
{
	bool yes = strcmp(text, "true") == 0 || strcmp(text, "1") == 0;
	if (!yes && strcmp(text, "false") != 0 && strcmp(text, "0") != 0)
		return bad(p, text, "true or false", error);
	*(bool *)field = yes;
	return GNP_OK;
}

static gnp_status set_choice(const struct gnp_parameter *p, void *field, const char *text, struct gnp_error *error)
{
	struct gnp_names list;
	for (int i = 0; p->choices[i]; i++) {
		if (strcmp(text, p->choices[i]) == 0) {
			*(int *)field = i;
			return GNP_OK;
		}
	}
	gnp_names_begin(&list, text, strlen(text));
	for (int i = 0; p->choices[i]; i++)
		gnp_names_add(&list, p->choices[i]);
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: got \"%.60s\", need one of %s", p->name, text, gnp_names_end(&list));
}

static gnp_status set_outputs(const struct gnp_operation *operation, const struct gnp_parameter *p, void *field,
                              const char *text, struct gnp_error *error)
{
	struct gnp_names list;
	uint64_t mask = 0;
	if (strcmp(text, "all") == 0) {
		for (size_t i = 0; i < operation->output_count; i++)
			mask |= UINT64_C(1) << i;
		text = "";
	}
	while (*text) {
		size_t length = strcspn(text, ",");
		const struct gnp_tensor_info *info = tensor_info(operation->outputs, operation->output_count, text, length);
		if (!info)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: unknown \"%.*s\", known: %s", p->name,
			                     length < 40 ? (int)length : 40, text,
			                     list_tensors(operation->outputs, operation->output_count, text, length, &list));
		mask |= UINT64_C(1) << (info - operation->outputs);
		text += length + (text[length] == ',');
	}
	if (!mask)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: got none, need at least one of %s", p->name,
		                     list_tensors(operation->outputs, operation->output_count, "", 0, &list));
	*(uint64_t *)field = mask;
	return GNP_OK;
}

static gnp_status set_model(const struct gnp_parameter *p, char *field, const char *text, struct gnp_error *error)
{
	if (!gnp_model_name_fits(text))
		return bad(p, text, "auto or the name of a model", error);
	memset(field, 0, GNP_MODEL_NAME_MAX + 1);
	memcpy(field, text, strlen(text));
	return GNP_OK;
}

static const struct gnp_parameter *parameter_find(const struct gnp_operation *operation, const char *name,
                                                  struct gnp_error *error)
{
	struct gnp_names list;
	for (size_t i = 0; i < operation->parameter_count; i++) {
		if (strcmp(operation->parameters[i].name, name) == 0)
			return &operation->parameters[i];
	}
	gnp_names_begin(&list, name, strlen(name));
	for (size_t i = 0; i < operation->parameter_count; i++)
		gnp_names_add(&list, operation->parameters[i].name);
	gnp_error_set(error, GNP_INVALID_ARGUMENT, "unknown parameter \"%.60s\", known: %s", name, gnp_names_end(&list));
	return NULL;
}

static gnp_status parse_text(const struct gnp_operation *operation, const struct gnp_parameter *p, void *options,
                             const char *text, struct gnp_error *error)
{
	void *field = (char *)options + p->offset;
	switch (p->type) {
	case GNP_PARAMETER_BOOL: return set_bool(p, field, text, error);
	case GNP_PARAMETER_CHOICE: return set_choice(p, field, text, error);
	case GNP_PARAMETER_SET: return set_outputs(operation, p, field, text, error);
	case GNP_PARAMETER_MODEL: return set_model(p, field, text, error);
	default: return parse_number(p, field, text, error);
	}
}

gnp_status gnp_parameter_parse(const struct gnp_operation *operation, void *options, const char *name,
                               const char *text, struct gnp_error *error)
{
	const struct gnp_parameter *p = parameter_find(operation, name, error);
	return p ? parse_text(operation, p, options, text, error) : GNP_INVALID_ARGUMENT;
}

/* A typed value goes the way of its text where the types differ, so that messages and rules are the same. */
static gnp_status set_value(const struct gnp_operation *operation, void *options, const struct gnp_value *value,
                            struct gnp_error *error)
{
	const struct gnp_parameter *p = parameter_find(operation, value->name, error);
	if (!p)
		return GNP_INVALID_ARGUMENT;
	void *field = (char *)options + p->offset;
	bool numeric = gnp_parameter_is_number(p);
	char text[GNP_NUMBER_LENGTH_MAX + 1];
	switch (value->type) {
	case GNP_VALUE_STRING: return parse_text(operation, p, options, value->string, error);
	case GNP_VALUE_BOOL: return parse_text(operation, p, options, value->boolean ? "true" : "false", error);
	case GNP_VALUE_INTEGER:
		if (numeric)
			return set_number(p, field, (double)value->integer, error);
		snprintf(text, sizeof text, "%" PRId64, value->integer);
		return parse_text(operation, p, options, text, error);
	default:
		if (numeric)
			return set_number(p, field, value->number, error);
		text[gnp_number_write_double(text, value->number)] = '\0';
		return parse_text(operation, p, options, text, error);
	}
}

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
				return gnp_error_set(error, GNP_INVALID_ARGUMENT, "parameter \"%.60s\": given twice", values->items[i].name);
		}
		gnp_status status = set_value(call->operation, call->options, &values->items[i], error);
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
			tensor_info(operation->outputs, operation->output_count, name, strlen(name));
		if (!info) {
			struct gnp_names list;
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "unknown output \"%.40s\", known: %s", name,
			                     list_tensors(operation->outputs, operation->output_count, name, strlen(name), &list));
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

static void format_shape(unsigned rank, const size_t *shape, char *text, size_t size)
{
	size_t length = (size_t)snprintf(text, size, "[");
	for (unsigned i = 0; i < rank && length < size; i++)
		length += (size_t)snprintf(text + length, size - length, "%s%zu", i ? "," : "", shape[i]);
	if (length < size)
		snprintf(text + length, size - length, "]");
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
		char got[GNP_NUMBER_LENGTH_MAX + 1];
		if (value != 0 && value != 1)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s[%zu]: got %s, need 0 or 1", tensor->name, i,
			                     number_text(value, got));
	}
	return GNP_OK;
}

static gnp_status check_input(const struct gnp_tensor_info *info, const struct gnp_tensor *tensor, size_t *points,
                              struct gnp_error *error)
{
	char got[80], need[80] = "[";
	bool fits = tensor->rank == info->rank;
	for (unsigned d = 0; d < info->rank; d++) {
		size_t length = strlen(need);
		if (info->shape[d] >= 0)
			snprintf(need + length, sizeof need - length, "%s%" PRId64, d ? "," : "", info->shape[d]);
		else
			snprintf(need + length, sizeof need - length, "%s%c", d ? "," : "", gnp_extent_letter(info->shape[d]));
		fits = fits && (info->shape[d] < 0 || tensor->shape[d] == (size_t)info->shape[d]);
	}
	if (!fits) {
		format_shape(tensor->rank, tensor->shape, got, sizeof got);
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "input \"%s\": shape %s, need %s]", info->name, got, need);
	}
	if (info->datatype != GNP_BOOL && tensor->datatype == GNP_BOOL)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "input \"%s\": datatype %s, need a numeric one, for example %s",
		                     info->name, gnp_datatype_name(tensor->datatype), gnp_datatype_name(info->datatype));
	for (unsigned d = 0; d < info->rank; d++) {
		if (info->shape[d] != -1)
			continue;
		if (*points == SIZE_MAX)
			*points = tensor->shape[d];
		if (tensor->shape[d] != *points)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "input \"%s\": %zu rows, need %zu as the input before it has",
			                     info->name, tensor->shape[d], *points);
	}
	return info->datatype == GNP_BOOL ? check_bools(tensor, error) : GNP_OK;
}

static gnp_status check_inputs(struct gnp_call *call, struct gnp_error *error)
{
	const struct gnp_operation *operation = call->operation;
	const struct gnp_tensors *inputs = &call->request->inputs;
	struct gnp_names list;
	for (size_t i = 0; i < inputs->count; i++) {
		const char *name = inputs->items[i].name;
		if (!tensor_info(operation->inputs, operation->input_count, name, strlen(name)))
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "unknown input \"%.60s\", known: %s", name,
			                     list_tensors(operation->inputs, operation->input_count, name, strlen(name), &list));
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
	return call->request->output_count || (value && value->type == GNP_VALUE_STRING && strcmp(value->string, "all") != 0);
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
