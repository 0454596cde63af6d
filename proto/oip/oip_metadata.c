/* What the protocol's clients ask of an operation before they use it: its metadata, its configuration as Triton writes
 * one, and the body of an error. */
#include <inttypes.h>

#include "proto/json/json_text.h"
#include "proto/oip/oip.h"
#include "proto/operation/parameter.h"
#include "proto/tensor/number.h"
#include "proto/tensor/writer.h"

static void put_member(struct gnp_writer *w, const char *key, const char *text)
{
	gnp_writer_printf(w, "\"%s\":", key);
	gnp_json_put_string(w, text);
}

/* The protocol writes every free extent as -1. */
static void put_shape(struct gnp_writer *w, const struct gnp_tensor_info *info)
{
	for (unsigned d = 0; d < info->rank; d++)
		gnp_writer_printf(w, "%s%" PRId64, d ? "," : "", info->shape[d] < 0 ? -1 : info->shape[d]);
}

static void put_tensor(struct gnp_writer *w, const struct gnp_tensor_info *info, bool input)
{
	gnp_writer_printf(w, "{\"name\":\"%s\",\"datatype\":\"%s\",\"shape\":[", info->name,
	                  gnp_datatype_name(info->datatype));
	put_shape(w, info);
	gnp_writer_printf(w, "],\"optional\":%s,", input && info->optional ? "true" : "false");
	put_member(w, "help", info->help);
	gnp_writer_text(w, "}");
}

static void put_tensors(struct gnp_writer *w, const struct gnp_tensor_info *infos, size_t count, bool input)
{
	gnp_writer_printf(w, ",\"%s\":[", input ? "inputs" : "outputs");
	for (size_t i = 0; i < count; i++) {
		gnp_writer_text(w, i ? "," : "");
		put_tensor(w, &infos[i], input);
	}
	gnp_writer_text(w, "]");
}

static void put_range(struct gnp_writer *w, const struct gnp_parameter *p)
{
	char low[GNP_NUMBER_LENGTH_MAX], high[GNP_NUMBER_LENGTH_MAX];
	int low_length = (int)gnp_number_write_double(low, p->minimum),
	                 high_length = (int)gnp_number_write_double(high, p->maximum);
	gnp_writer_printf(w, ",\"minimum\":%.*s,\"maximum\":%.*s", low_length, low, high_length, high);
}

static void put_choices(struct gnp_writer *w, const struct gnp_parameter *p)
{
	gnp_writer_text(w, ",\"choices\":[");
	for (size_t i = 0; p->choices[i]; i++)
		gnp_writer_printf(w, "%s\"%s\"", i ? "," : "", p->choices[i]);
	gnp_writer_text(w, "]");
}

static void put_parameter(struct gnp_writer *w, const struct gnp_operation *operation, const struct gnp_parameter *p)
{
	static const char *const types[] = {
		[GNP_PARAMETER_INTEGER] = "integer", [GNP_PARAMETER_NUMBER] = "number", [GNP_PARAMETER_AUTO] = "number_or_auto",
		[GNP_PARAMETER_BOOL] = "boolean",    [GNP_PARAMETER_CHOICE] = "choice", [GNP_PARAMETER_SET] = "set",
		[GNP_PARAMETER_MODEL] = "model"};
	char default_text[GNP_PARAMETER_DEFAULT_MAX];
	gnp_writer_printf(w, "{\"name\":\"%s\",\"type\":\"%s\",", p->name, types[p->type]);
	gnp_parameter_default(operation, p, default_text);
	put_member(w, "default", default_text);
	if (gnp_parameter_is_number(p))
		put_range(w, p);
	if (p->type == GNP_PARAMETER_CHOICE)
		put_choices(w, p);
	gnp_writer_text(w, ",");
	put_member(w, "help", p->help);
	gnp_writer_text(w, "}");
}

static void put_parameters(struct gnp_writer *w, const struct gnp_operation *operation)
{
	gnp_writer_text(w, ",\"parameters\":[");
	for (size_t i = 0; i < operation->parameter_count; i++) {
		gnp_writer_text(w, i ? "," : "");
		put_parameter(w, operation, &operation->parameters[i]);
	}
	gnp_writer_text(w, "]");
}

/* k only of models whose patches have one. Names and regimes need no escapes. */
static void put_model(struct gnp_writer *w, const struct gnp_model *model, bool first)
{
	gnp_writer_printf(w, "%s{\"name\":\"%s\",\"sha256\":\"%s\",\"parameter_count\":%zu,\"regime\":\"%s\"", first ? "" : ",",
	                  model->name, model->sha256, model->parameter_count, model->regime);
	if (model->recipe.k)
		gnp_writer_printf(w, ",\"k\":%u", model->recipe.k);
	gnp_writer_text(w, "}");
}

/* The models a client may name. */
static void put_models(struct gnp_writer *w, const struct gnp_models *models)
{
	const struct gnp_model *model;
	gnp_writer_text(w, ",\"weights\":[");
	for (size_t i = 0; (model = gnp_models_at(models, i)); i++)
		put_model(w, model, i == 0);
	gnp_writer_text(w, "]");
}

gnp_status gnp_oip_model_metadata(const struct gnp_operation *operation, const struct gnp_models *models,
                                  struct gnp_buffer *buffer, struct gnp_error *error)
{
	struct gnp_writer w = gnp_writer_to(buffer, error);
	gnp_writer_printf(&w, "{\"name\":\"%s\",\"versions\":[\"1\"],\"platform\":\"gnpd\",", operation->name);
	put_member(&w, "help", operation->help);
	put_tensors(&w, operation->inputs, operation->input_count, true);
	put_tensors(&w, operation->outputs, operation->output_count, false);
	put_parameters(&w, operation);
	if (operation->resolve)
		put_models(&w, models);
	gnp_writer_text(&w, "}");
	return w.status;
}

static void put_config_tensors(struct gnp_writer *w, const struct gnp_tensor_info *infos, size_t count, bool input)
{
	for (size_t i = 0; i < count; i++) {
		gnp_writer_printf(w, "%s{\"name\":\"%s\",\"data_type\":\"TYPE_%s\",\"dims\":[", i ? "," : "", infos[i].name,
		                  gnp_datatype_name(infos[i].datatype));
		put_shape(w, &infos[i]);
		gnp_writer_printf(w, "]%s}", input && infos[i].optional ? ",\"optional\":true" : "");
	}
}

gnp_status gnp_oip_model_config(const struct gnp_operation *operation, struct gnp_buffer *buffer,
                                struct gnp_error *error)
{
	struct gnp_writer w = gnp_writer_to(buffer, error);
	gnp_writer_printf(&w,
	                  "{\"name\":\"%s\",\"platform\":\"gnpd\",\"backend\":\"gnpd\",\"max_batch_size\":0,\"input\":[",
	                  operation->name);
	put_config_tensors(&w, operation->inputs, operation->input_count, true);
	gnp_writer_text(&w, "],\"output\":[");
	put_config_tensors(&w, operation->outputs, operation->output_count, false);
	gnp_writer_text(&w, "]}");
	return w.status;
}

gnp_status gnp_oip_error_body(gnp_status status, const char *text, const char *request_id, struct gnp_buffer *buffer)
{
	struct gnp_writer w = gnp_writer_to(buffer, NULL);
	gnp_writer_text(&w, "{");
	put_member(&w, "error", text && *text ? text : gnp_status_text(status));
	gnp_writer_text(&w, ",");
	put_member(&w, "code", gnp_status_name(status));
	if (request_id) {
		gnp_writer_text(&w, ",");
		put_member(&w, "request_id", request_id);
	}
	gnp_writer_text(&w, "}");
	return w.status;
}
