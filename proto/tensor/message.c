#include "proto/tensor/message.h"

#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"

static gnp_status add(struct gnp_values *values, struct gnp_value value, const char *name, const char *string,
                      struct gnp_error *error)
{
	if (values->count == values->capacity) {
		size_t capacity = values->capacity ? 2 * values->capacity : 8, bytes;
		struct gnp_value *items = NULL;
		if (gnp_size_multiply(capacity, sizeof *items, &bytes))
			items = realloc(values->items, bytes);
		if (!items)
			return gnp_error_set(error, GNP_OUT_OF_MEMORY, "parameters: no memory for %zu", capacity);
		values->items = items;
		values->capacity = capacity;
	}
	value.name = strdup(name);
	value.string = string ? strdup(string) : NULL;
	if (!value.name || (string && !value.string)) {
		free(value.name);
		free(value.string);
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "parameters: no memory for \"%.40s\"", name);
	}
	values->items[values->count++] = value;
	return GNP_OK;
}

gnp_status gnp_values_add_string(struct gnp_values *values, const char *name, const char *string,
                                 struct gnp_error *error)
{
	return add(values, (struct gnp_value){.type = GNP_VALUE_STRING}, name, string, error);
}

gnp_status gnp_values_add_integer(struct gnp_values *values, const char *name, int64_t integer, struct gnp_error *error)
{
	return add(values, (struct gnp_value){.type = GNP_VALUE_INTEGER, .integer = integer}, name, NULL, error);
}

gnp_status gnp_values_add_number(struct gnp_values *values, const char *name, double number, struct gnp_error *error)
{
	return add(values, (struct gnp_value){.type = GNP_VALUE_NUMBER, .number = number}, name, NULL, error);
}

gnp_status gnp_values_add_bool(struct gnp_values *values, const char *name, bool boolean, struct gnp_error *error)
{
	return add(values, (struct gnp_value){.type = GNP_VALUE_BOOL, .boolean = boolean}, name, NULL, error);
}

const struct gnp_value *gnp_values_find(const struct gnp_values *values, const char *name)
{
	for (size_t i = 0; i < values->count; i++) {
		if (strcmp(values->items[i].name, name) == 0)
			return &values->items[i];
	}
	return NULL;
}

void gnp_values_clear(struct gnp_values *values)
{
	for (size_t i = 0; i < values->count; i++) {
		free(values->items[i].name);
		free(values->items[i].string);
	}
	free(values->items);
	*values = (struct gnp_values){0};
}

void gnp_request_clear(struct gnp_request *request)
{
	free(request->id);
	gnp_values_clear(&request->parameters);
	gnp_tensors_clear(&request->inputs);
	free(request->outputs);
	*request = (struct gnp_request){0};
}

void gnp_response_clear(struct gnp_response *response)
{
	gnp_tensors_clear(&response->outputs);
	gnp_values_clear(&response->parameters);
}
