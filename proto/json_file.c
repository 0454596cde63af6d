/* JSON as a file: {"points": [[x, y, z], ...], "normals": [...], ...} in, {"name": nested arrays, ...} out. */
#include <stdio.h>
#include <string.h>

#include "file_codec.h"
#include "json_numbers.h"
#include "json_text.h"

/* Of a list of true and false it is BOOL, else FP64: JSON numbers have no type. */
static enum gnp_datatype item_type(const struct gnp_json_span *span)
{
	size_t skip = 0;
	while (skip < span->size && strchr("[ \n\r\t", span->text[skip]))
		skip++;
	return skip < span->size && (span->text[skip] == 't' || span->text[skip] == 'f') ? GNP_BOOL : GNP_FP64;
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
	return gnp_json_numbers_read(span->text, span->size, name, vector ? GNP_FP64 : item_type(span), rank, shape, tensors, error);
}

/* A member that is no input: who sends one takes it for something that has an effect. */
static gnp_status unknown_member(const struct gnp_decode *decode, const char *key, struct gnp_error *error)
{
	char list[256] = "points, normals";
	for (size_t i = 0; i < decode->wants.input_count; i++) {
		const char *name = decode->wants.inputs[i].name;
		size_t length = strlen(list);
		if (!is_vector(name))
			snprintf(list + length, sizeof list - length, ", %s", name);
	}
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "json: unknown member \"%.60s\", known: %s; parameters go into the query", key, list);
}

gnp_status gnp_json_file_decode(const struct gnp_decode *decode, struct gnp_tensors *tensors, struct gnp_error *error)
{
	struct gnp_json_document document = {0};
	gnp_status status = gnp_json_parse((const char *)decode->body, decode->size, 1, NULL, tensors->budget, &document, error);
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
		else if (wanted && !decode->all)
			status = gnp_error_set(error, GNP_INVALID_ARGUMENT, "json: need \"%s\": an array of %s", key,
			                       is_vector(key) ? "[x, y, z]" : "numbers");
		else if (decode->wants.strict)
			status = unknown_member(decode, key, error);
		if (status != GNP_OK)
			break;
	}
	if (status == GNP_OK && !decode->all && !gnp_tensors_find(tensors, "points"))
		status = gnp_error_set(error, GNP_INVALID_ARGUMENT, "json: need \"points\": an array of [x, y, z]");
	gnp_json_clear(&document);
	return status;
}

gnp_status gnp_json_file_encode(const struct gnp_tensors *tensors, const struct gnp_values *comments,
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
