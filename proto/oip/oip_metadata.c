#include <inttypes.h>
#include <string.h>

#include "proto/json/json_text.h"
#include "proto/oip/oip.h"
#include "proto/tensor/number.h"

static gnp_status text_member(const char *key, const char *text, struct gnp_buffer *buffer, struct gnp_error *error)
{
	gnp_status status = gnp_buffer_printf(buffer, error, "\"%s\":", key);
	return status == GNP_OK ? gnp_json_write_string(text, buffer, error) : status;
}

/* The protocol writes every free extent as -1. */
static gnp_status write_tensor(const struct gnp_tensor_info *info, bool input, struct gnp_buffer *buffer, struct gnp_error *error)
{
	gnp_status status = gnp_buffer_printf(buffer, error, "{\"name\":\"%s\",\"datatype\":\"%s\",\"shape\":[", info->name,
	                                      gnp_datatype_name(info->datatype));
	for (unsigned d = 0; d < info->rank && status == GNP_OK; d++)
		status = gnp_buffer_printf(buffer, error, "%s%" PRId64, d ? "," : "", info->shape[d] < 0 ? -1 : info->shape[d]);
	if (status == GNP_OK)
		status = gnp_buffer_printf(buffer, error, "],\"optional\":%s,", input && info->optional ? "true" : "false");
	if (status == GNP_OK)
		status = text_member("help", info->help, buffer, error);
	return status == GNP_OK ? gnp_buffer_append(buffer, "}", 1, error) : status;
}

static gnp_status write_tensors(const char *key, const struct gnp_tensor_info *infos, size_t count,
                                struct gnp_buffer *buffer, struct gnp_error *error)
{
	bool input = strcmp(key, "inputs") == 0;
	gnp_status status = gnp_buffer_printf(buffer, error, ",\"%s\":[", key);
	for (size_t i = 0; i < count && status == GNP_OK; i++) {
		status = i ? gnp_buffer_append(buffer, ",", 1, error) : GNP_OK;
		if (status == GNP_OK)
			status = write_tensor(&infos[i], input, buffer, error);
	}
	return status == GNP_OK ? gnp_buffer_append(buffer, "]", 1, error) : status;
}

static gnp_status write_range(const struct gnp_parameter *p, struct gnp_buffer *buffer, struct gnp_error *error)
{
	char low[GNP_NUMBER_LENGTH_MAX], high[GNP_NUMBER_LENGTH_MAX];
	int low_length = (int)gnp_number_write_double(low, p->minimum), high_length = (int)gnp_number_write_double(high, p->maximum);
	return gnp_buffer_printf(buffer, error, ",\"minimum\":%.*s,\"maximum\":%.*s", low_length, low, high_length, high);
}

static gnp_status write_choices(const struct gnp_parameter *p, struct gnp_buffer *buffer, struct gnp_error *error)
{
	gnp_status status = gnp_buffer_printf(buffer, error, ",\"choices\":[");
	for (size_t i = 0; p->choices[i] && status == GNP_OK; i++)
		status = gnp_buffer_printf(buffer, error, "%s\"%s\"", i ? "," : "", p->choices[i]);
	return status == GNP_OK ? gnp_buffer_append(buffer, "]", 1, error) : status;
}

static gnp_status write_parameter(const struct gnp_parameter *p, struct gnp_buffer *buffer, struct gnp_error *error)
{
	static const char *const types[] = {
		[GNP_PARAMETER_INTEGER] = "integer", [GNP_PARAMETER_NUMBER] = "number", [GNP_PARAMETER_AUTO] = "number_or_auto",
		[GNP_PARAMETER_BOOL] = "boolean",    [GNP_PARAMETER_CHOICE] = "choice", [GNP_PARAMETER_SET] = "set",
		[GNP_PARAMETER_MODEL] = "model"};
	gnp_status status = gnp_buffer_printf(buffer, error, "{\"name\":\"%s\",\"type\":\"%s\",", p->name, types[p->type]);
	if (status == GNP_OK)
		status = text_member("default", p->default_text, buffer, error);
	if (status == GNP_OK && gnp_parameter_is_number(p))
		status = write_range(p, buffer, error);
	if (status == GNP_OK && p->type == GNP_PARAMETER_CHOICE)
		status = write_choices(p, buffer, error);
	if (status == GNP_OK)
		status = gnp_buffer_append(buffer, ",", 1, error);
	if (status == GNP_OK)
		status = text_member("help", p->help, buffer, error);
	return status == GNP_OK ? gnp_buffer_append(buffer, "}", 1, error) : status;
}

/* The models a client may name. Their names and regimes need no escapes. */
static gnp_status write_models(const struct gnp_models *models, struct gnp_buffer *buffer, struct gnp_error *error)
{
	const struct gnp_model *model;
	gnp_status status = gnp_buffer_printf(buffer, error, ",\"weights\":[");
	for (size_t i = 0; status == GNP_OK && (model = gnp_models_at(models, i)); i++)
		status = gnp_buffer_printf(buffer, error, "%s{\"name\":\"%s\",\"sha256\":\"%s\",\"parameter_count\":%zu,\"regime\":\"%s\",\"k\":%u}",
		                           i ? "," : "", model->name, model->sha256, model->parameter_count, model->regime, model->recipe.k);
	return status == GNP_OK ? gnp_buffer_append(buffer, "]", 1, error) : status;
}

gnp_status gnp_oip_model_metadata(const struct gnp_operation *operation, const struct gnp_models *models,
                                  struct gnp_buffer *buffer, struct gnp_error *error)
{
	gnp_status status = gnp_buffer_printf(buffer, error, "{\"name\":\"%s\",\"versions\":[\"1\"],\"platform\":\"gnpd\",", operation->name);
	if (status == GNP_OK)
		status = text_member("help", operation->help, buffer, error);
	if (status == GNP_OK)
		status = write_tensors("inputs", operation->inputs, operation->input_count, buffer, error);
	if (status == GNP_OK)
		status = write_tensors("outputs", operation->outputs, operation->output_count, buffer, error);
	if (status == GNP_OK)
		status = gnp_buffer_printf(buffer, error, ",\"parameters\":[");
	for (size_t i = 0; i < operation->parameter_count && status == GNP_OK; i++) {
		status = i ? gnp_buffer_append(buffer, ",", 1, error) : GNP_OK;
		if (status == GNP_OK)
			status = write_parameter(&operation->parameters[i], buffer, error);
	}
	if (status == GNP_OK)
		status = gnp_buffer_append(buffer, "]", 1, error);
	if (status == GNP_OK && operation->resolve)
		status = write_models(models, buffer, error);
	return status == GNP_OK ? gnp_buffer_append(buffer, "}", 1, error) : status;
}

static gnp_status write_config_tensor(const struct gnp_tensor_info *info, bool input, struct gnp_buffer *buffer, struct gnp_error *error)
{
	gnp_status status = gnp_buffer_printf(buffer, error, "{\"name\":\"%s\",\"data_type\":\"TYPE_%s\",\"dims\":[", info->name,
	                                      gnp_datatype_name(info->datatype));
	for (unsigned d = 0; d < info->rank && status == GNP_OK; d++)
		status = gnp_buffer_printf(buffer, error, "%s%" PRId64, d ? "," : "", info->shape[d] < 0 ? -1 : info->shape[d]);
	return status == GNP_OK ? gnp_buffer_printf(buffer, error, "]%s}", input && info->optional ? ",\"optional\":true" : "") : status;
}

gnp_status gnp_oip_model_config(const struct gnp_operation *operation, struct gnp_buffer *buffer, struct gnp_error *error)
{
	gnp_status status = gnp_buffer_printf(buffer, error, "{\"name\":\"%s\",\"platform\":\"gnpd\",\"backend\":\"gnpd\",\"max_batch_size\":0,"
	                                      "\"input\":[", operation->name);
	for (size_t i = 0; i < operation->input_count && status == GNP_OK; i++) {
		status = i ? gnp_buffer_append(buffer, ",", 1, error) : GNP_OK;
		if (status == GNP_OK)
			status = write_config_tensor(&operation->inputs[i], true, buffer, error);
	}
	if (status == GNP_OK)
		status = gnp_buffer_printf(buffer, error, "],\"output\":[");
	for (size_t i = 0; i < operation->output_count && status == GNP_OK; i++) {
		status = i ? gnp_buffer_append(buffer, ",", 1, error) : GNP_OK;
		if (status == GNP_OK)
			status = write_config_tensor(&operation->outputs[i], false, buffer, error);
	}
	return status == GNP_OK ? gnp_buffer_append(buffer, "]}", 2, error) : status;
}

gnp_status gnp_oip_error_body(gnp_status status, const char *text, const char *request_id, struct gnp_buffer *buffer)
{
	gnp_status written = gnp_buffer_append(buffer, "{", 1, NULL);
	if (written == GNP_OK)
		written = text_member("error", text && *text ? text : gnp_status_text(status), buffer, NULL);
	if (written == GNP_OK)
		written = gnp_buffer_append(buffer, ",", 1, NULL);
	if (written == GNP_OK)
		written = text_member("code", gnp_status_name(status), buffer, NULL);
	if (written == GNP_OK && request_id) {
		written = gnp_buffer_append(buffer, ",", 1, NULL);
		if (written == GNP_OK)
			written = text_member("request_id", request_id, buffer, NULL);
	}
	return written == GNP_OK ? gnp_buffer_append(buffer, "}", 1, NULL) : written;
}
