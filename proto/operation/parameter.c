#include "proto/operation/parameter.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/base/names.h"
#include "proto/tensor/number.h"

static gnp_status bad(const struct gnp_parameter *parameter, const char *text, const char *need,
                      struct gnp_error *error)
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
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: got %s, need %s%s", p->name, number_text(value, got),
	                     auto_or(p), range);
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
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: got \"%.60s\", need one of %s", p->name, text,
	                     gnp_names_end(&list));
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
		const struct gnp_tensor_info *info = gnp_tensor_infos_find(operation->outputs, operation->output_count, text,
		                                                           length);
		if (!info)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: unknown \"%.*s\", known: %s", p->name,
			                     length < 40 ? (int)length : 40, text,
			                     gnp_tensor_infos_names(operation->outputs, operation->output_count, text, length,
			                                            &list));
		mask |= UINT64_C(1) << (info - operation->outputs);
		text += length + (text[length] == ',');
	}
	if (!mask)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: got none, need at least one of %s", p->name,
		                     gnp_tensor_infos_names(operation->outputs, operation->output_count, "", 0, &list));
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
gnp_status gnp_parameter_set(const struct gnp_operation *operation, void *options, const struct gnp_value *value,
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

/* ---- Defaults ---- */

/* Appends the outputs of a mask to a list of names. */
static void write_names(const struct gnp_operation *operation, uint64_t mask, char *list)
{
	char *end = list + strlen(list);
	for (size_t i = 0; i < operation->output_count; i++) {
		if (!(mask >> i & 1))
			continue;
		end = stpcpy(end, end > list ? "," : "");
		end = stpcpy(end, operation->outputs[i].name);
	}
}

static void write_set(const struct gnp_operation *operation, const struct gnp_parameter *p, uint64_t mask, char *text)
{
	bool all = mask == UINT64_MAX >> (64 - operation->output_count);
	strcpy(text, all ? "all" : "");
	for (size_t i = 0; !all && p->choices && p->choices[i]; i++) {
		const char *name = p->choices[i];
		const struct gnp_tensor_info *first = gnp_tensor_infos_find(operation->outputs, operation->output_count, name,
		                                                            strlen(name));
		uint64_t bit = first ? UINT64_C(1) << (first - operation->outputs) : 0;
		write_names(operation, mask & bit, text);
		mask &= ~bit;
	}
	if (!all)
		write_names(operation, mask, text);
}

void gnp_parameter_default(const struct gnp_operation *operation, const struct gnp_parameter *parameter,
                           char text[GNP_PARAMETER_DEFAULT_MAX])
{
	_Alignas(16) unsigned char options[GNP_OPTIONS_SIZE_MAX] = {0};
	operation->defaults(options);
	const void *field = options + parameter->offset;
	switch (parameter->type) {
	case GNP_PARAMETER_INTEGER: sprintf(text, "%d", *(const int *)field); break;
	case GNP_PARAMETER_NUMBER: number_text(*(const double *)field, text); break;
	case GNP_PARAMETER_AUTO:
		if (isnan(*(const double *)field))
			strcpy(text, "auto");
		else
			number_text(*(const double *)field, text);
		break;
	case GNP_PARAMETER_BOOL: strcpy(text, *(const bool *)field ? "true" : "false"); break;
	case GNP_PARAMETER_CHOICE: strcpy(text, parameter->choices[*(const int *)field]); break;
	case GNP_PARAMETER_SET: write_set(operation, parameter, *(const uint64_t *)field, text); break;
	case GNP_PARAMETER_MODEL: strcpy(text, field); break;
	}
}
