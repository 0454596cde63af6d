/* JSON as a file: {"points": [[x, y, z], ...], "normals": [...], ...} in, {"name": nested arrays, ...} out. */
#include <stdio.h>
#include <string.h>

#include "core/base/names.h"
#include "proto/codec/parameters.h"
#include "proto/format/format.h"
#include "proto/json/json_numbers.h"
#include "proto/json/json_text.h"
#include "proto/operation/operation.h"
#include "proto/tensor/number.h"

/* The first character of a list's first item, ']' of an empty list. */
static char first_character(const struct gnp_json_span *span)
{
	size_t skip = 0;
	while (skip < span->size && strchr("[ \n\r\t", span->text[skip]))
		skip++;
	return skip < span->size ? span->text[skip] : '\0';
}

/* Of a list of true and false it is BOOL, else FP64: JSON numbers have no type. */
static enum gnp_datatype item_type(const struct gnp_json_span *span)
{
	char first = first_character(span);
	return first == 't' || first == 'f' ? GNP_BOOL : GNP_FP64;
}

static bool is_vector(const char *name)
{
	return strcmp(name, "points") == 0 || strcmp(name, "normals") == 0;
}

static gnp_status add_array(const struct gnp_decode *decode, const char *name, const struct gnp_json_span *span,
                            struct gnp_tensors *tensors, struct gnp_error *error)
{
	size_t shape[GNP_TENSOR_RANK_MAX] = {0};
	unsigned rank;
	bool vector = is_vector(name);
	gnp_status status = gnp_json_numbers_shape(span->text, span->size, name, &rank, shape, error);
	if (status != GNP_OK)
		return status;
	if (vector && !decode->all && rank == 1 && shape[0] % 3 == 0) {
		rank = 2;
		shape[0] /= 3;
		shape[1] = 3;
	}
	if (vector && !decode->all && (rank != 2 || shape[1] != 3))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "json: \"%s\": need an array of [x, y, z]", name);
	status = gnp_decode_check_points(decode, shape[0], error);
	if (status != GNP_OK)
		return status;
	return gnp_json_numbers_read(span->text, span->size, name, vector ? GNP_FP64 : item_type(span), rank, shape,
	                             tensors, error);
}

/* ---- Members that are no input ---- */

static bool is_parameter(const struct gnp_operation *operation, const char *name)
{
	for (size_t i = 0; i < operation->parameter_count; i++)
		if (strcmp(operation->parameters[i].name, name) == 0)
			return true;
	return strcmp(name, "format") == 0 || strcmp(name, "timeout") == 0;
}

static bool is_output(const struct gnp_operation *operation, const char *name)
{
	for (size_t i = 0; i < operation->output_count; i++)
		if (strcmp(operation->outputs[i].name, name) == 0)
			return true;
	return false;
}

/* A list that an answer may carry: of numbers, of true and false, or empty. */
static bool is_column(const struct gnp_json_span *span)
{
	char first = span ? first_character(span) : '\0';
	return first && strchr("-0123456789tf]", first);
}

/* What every answer says of how it was made, and no parameter says: the report holds both. */
static bool is_report(json_t *value)
{
	const char *key;
	json_t *item;
	json_object_foreach(value, key, item)
		if (json_is_object(item) || json_is_array(item))
			return false;
	return json_is_string(json_object_get(value, "estimator")) &&
	       json_is_boolean(json_object_get(value, "normals_estimated"));
}

#define QUERY_MAX 100

/* The parameter as a query says it. */
static void write_query(const char *key, const json_t *value, char query[QUERY_MAX])
{
	char number[GNP_NUMBER_LENGTH_MAX + 1];
	const char *shown = json_is_string(value) ? json_string_value(value) : json_is_true(value) ? "true" :
	                    json_is_false(value) ? "false" : "...";
	if (json_is_number(value)) {
		number[gnp_number_write_double(number, json_number_value(value))] = '\0';
		shown = number;
	}
	snprintf(query, QUERY_MAX, "?%.40s=%.40s", key, shown);
}

static gnp_status refuse_parameters(const struct gnp_operation *operation, json_t *value, struct gnp_error *error)
{
	char query[QUERY_MAX] = "?NAME=VALUE";
	const char *key;
	json_t *item;
	json_object_foreach(value, key, item) {
		if (is_parameter(operation, key)) {
			write_query(key, item, query);
			break;
		}
	}
	return gnp_error_set(error, GNP_INVALID_ARGUMENT,
	                     "json: \"parameters\" is passed over only where an answer wrote it: give parameters in the "
	                     "query: %s", query);
}

static gnp_status unknown_member(const struct gnp_decode *decode, const char *key, struct gnp_error *error)
{
	struct gnp_names list;
	gnp_names_begin(&list, "", 0);
	gnp_names_add(&list, "points");
	gnp_names_add(&list, "normals");
	for (size_t i = 0; i < decode->wants.input_count; i++)
		if (!is_vector(decode->wants.inputs[i].name))
			gnp_names_add(&list, decode->wants.inputs[i].name);
	return gnp_error_set(error, GNP_INVALID_ARGUMENT,
	                     "json: unknown member \"%.60s\", known: %s, and arrays of numbers; parameters go into the "
	                     "query", key, gnp_names_end(&list));
}

/* What answers carry is passed over, so that one can be sent in; else who sends a member takes it for something that
 * has an effect. */
static gnp_status check_member(const struct gnp_decode *decode, const char *key, json_t *value,
                               const struct gnp_json_span *span, struct gnp_error *error)
{
	const struct gnp_operation *operation = decode->wants.operation;
	bool column = is_column(span);
	if (is_parameter(operation, key) && !(column && is_output(operation, key))) {
		char query[QUERY_MAX];
		write_query(key, value, query);
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "json: \"%.60s\" is a parameter: give it in the query: %s",
		                     key, query);
	}
	if (strcmp(key, "parameters") == 0)
		return is_report(value) ? GNP_OK : refuse_parameters(operation, value, error);
	return column ? GNP_OK : unknown_member(decode, key, error);
}

/* ---- Files ---- */

static gnp_status decode_file(const struct gnp_decode *decode, struct gnp_tensors *tensors, struct gnp_error *error)
{
	struct gnp_json_document document = {0};
	gnp_status status = gnp_json_parse((const char *)decode->body, decode->size, 1, NULL, tensors->budget, &document,
	                                   error);
	if (status != GNP_OK)
		return status;
	const char *key;
	json_t *value;
	json_object_foreach(document.root, key, value) {
		const struct gnp_json_span *span = gnp_json_member_span(&document, value);
		const struct gnp_tensor_info *input = gnp_decode_input(decode, key);
		bool wanted = decode->all || input || is_vector(key);
		if (span && wanted)
			status = add_array(decode, input ? input->name : key, span, tensors, error);
		else if (wanted && json_is_null(value))
			continue; /* as if it were absent */
		else if (wanted && !decode->all)
			status = gnp_error_set(error, GNP_INVALID_ARGUMENT, "json: \"%s\": need an array of %s", key,
			                       is_vector(key) ? "[x, y, z]" : "numbers");
		else if (decode->wants.operation)
			status = check_member(decode, key, value, span, error);
		if (status != GNP_OK)
			break;
	}
	if (status == GNP_OK && !decode->all && !gnp_tensors_find(tensors, "points"))
		status = gnp_error_set(error, GNP_INVALID_ARGUMENT, "json: need \"points\": an array of [x, y, z]");
	gnp_json_clear(&document);
	return status;
}

static gnp_status encode_file(const struct gnp_tensors *tensors, const struct gnp_values *comments,
                              struct gnp_buffer *buffer, struct gnp_error *error)
{
	gnp_status status = gnp_buffer_append(buffer, "{", 1, error);
	if (status == GNP_OK && comments && comments->count) {
		status = gnp_buffer_append(buffer, "\"parameters\":", 13, error);
		if (status == GNP_OK)
			status = gnp_json_write_values(comments, buffer, error);
	}
	for (size_t i = 0; i < tensors->count && status == GNP_OK; i++) {
		status = i || (comments && comments->count) ? gnp_buffer_append(buffer, ",\n", 2, error) : GNP_OK;
		if (status == GNP_OK)
			status = gnp_json_write_string(tensors->items[i].name, buffer, error);
		if (status == GNP_OK)
			status = gnp_buffer_append(buffer, ":", 1, error);
		if (status == GNP_OK)
			status = gnp_json_numbers_write(&tensors->items[i], true, buffer, error);
	}
	return status == GNP_OK ? gnp_buffer_append(buffer, "}\n", 2, error) : status;
}

static bool begins(const char *text, const char *end)
{
	return gnp_format_begins(text, end, "{");
}

static gnp_status parameters(const unsigned char *body, size_t size, struct gnp_values *values, struct gnp_error *error)
{
	return gnp_parameters_read_member((const char *)body, size, values, error);
}

static const char *const other_media_types[] = {"text/json", NULL};

const struct gnp_format gnp_format_json = {
	.name = "json", .media_type = "application/json", .extension = "json", .other_media_types = other_media_types,
	.holds = GNP_HOLDS_TENSORS, .begins = begins, .decode = decode_file, .encode = encode_file,
		.parameters = parameters};
