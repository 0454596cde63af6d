#include "server/api/openapi_operation.h"

#include <string.h>

#include "proto/file/formats.h"
#include "proto/operation/parameter.h"
#include "proto/tensor/number.h"

/* ---- Parameters ---- */

static void put_choices(struct gnp_writer *w, const struct gnp_parameter *p, const char *separator)
{
	for (size_t i = 0; p->choices[i]; i++)
		gnp_writer_printf(w, "%s%s", i ? separator : "", p->choices[i]);
}

/* A YAML scalar in single quotes. */
static void put_quoted(struct gnp_writer *w, const char *text)
{
	gnp_writer_text(w, "'");
	for (; *text; text++)
		gnp_writer_printf(w, "%s%c", *text == '\'' ? "'" : "", *text);
	gnp_writer_text(w, "'");
}

/* As every YAML reads it: older ones take 1e+200 for a text and 1.0e+200 for a number. */
static void put_number(struct gnp_writer *w, double value)
{
	char text[GNP_NUMBER_LENGTH_MAX + 1];
	text[gnp_number_write_double(text, value)] = '\0';
	int mantissa = (int)strcspn(text, "e");
	bool plain = !text[mantissa] || strchr(text, '.');
	gnp_writer_printf(w, "%.*s%s%s", mantissa, text, plain ? "" : ".0", text + mantissa);
}

static void put_range(struct gnp_writer *w, const struct gnp_parameter *p)
{
	if (p->minimum == GNP_ABOVE_ZERO) {
		gnp_writer_text(w, ", minimum: 0, exclusiveMinimum: true");
	} else {
		gnp_writer_text(w, ", minimum: ");
		put_number(w, p->minimum);
	}
	gnp_writer_text(w, ", maximum: ");
	put_number(w, p->maximum);
}

static void put_type(struct gnp_writer *w, const struct gnp_parameter *p)
{
	static const char *const types[] = {
		[GNP_PARAMETER_INTEGER] = "integer", [GNP_PARAMETER_NUMBER] = "number", [GNP_PARAMETER_AUTO] = "number",
		[GNP_PARAMETER_BOOL] = "boolean",    [GNP_PARAMETER_CHOICE] = "string", [GNP_PARAMETER_SET] = "string",
		[GNP_PARAMETER_MODEL] = "string"};
	bool automatic = p->type == GNP_PARAMETER_AUTO;
	gnp_writer_printf(w, "%stype: %s", automatic ? "oneOf: [{" : "", types[p->type]);
	if (gnp_parameter_is_number(p))
		put_range(w, p);
	if (automatic)
		gnp_writer_text(w, "}, {type: string, enum: [auto]}]");
}

static void put_default(struct gnp_writer *w, const struct gnp_operation *operation, const struct gnp_parameter *p)
{
	char text[GNP_PARAMETER_DEFAULT_MAX];
	double number;
	gnp_parameter_default(operation, p, text);
	gnp_writer_text(w, ", default: ");
	if (gnp_number_read(text, text + strlen(text), &number))
		put_number(w, number);
	else if (p->type == GNP_PARAMETER_BOOL)
		gnp_writer_text(w, text);
	else
		put_quoted(w, text);
}

static void put_schema(struct gnp_writer *w, const struct gnp_operation *operation, const struct gnp_parameter *p)
{
	gnp_writer_text(w, "{");
	put_type(w, p);
	if (p->type == GNP_PARAMETER_CHOICE) {
		gnp_writer_text(w, ", enum: [");
		put_choices(w, p, ", ");
		gnp_writer_text(w, "]");
	}
	if (p->type == GNP_PARAMETER_SET) {
		gnp_writer_text(w, ", pattern: '^(all|(");
		for (size_t i = 0; i < operation->output_count; i++)
			gnp_writer_printf(w, "%s%s", i ? "|" : "", operation->outputs[i].name);
		gnp_writer_text(w, ")(,[a-z_]+)*)$'");
	}
	if (p->type == GNP_PARAMETER_MODEL)
		gnp_writer_printf(w, ", maxLength: %d", GNP_MODEL_NAME_MAX);
	put_default(w, operation, p);
	gnp_writer_text(w, "}");
}

static void put_query(struct gnp_writer *w, const struct gnp_operation *operation)
{
	for (size_t i = 0; i < operation->parameter_count; i++) {
		const struct gnp_parameter *p = &operation->parameters[i];
		gnp_writer_printf(w, "        - name: %s\n          in: query\n          description: ", p->name);
		put_quoted(w, p->help);
		gnp_writer_text(w, "\n          schema: ");
		put_schema(w, operation, p);
		gnp_writer_text(w, "\n");
	}
}

/* ---- Files and tensors ---- */

static void put_media_types(struct gnp_writer *w, bool in, const char *indent)
{
	const struct gnp_format *f;
	for (size_t i = 0; (f = gnp_format_at(i)); i++) {
		if (in ? gnp_format_readable(f) : gnp_format_writable(f))
			gnp_writer_printf(w, "%s%s: {schema: {type: string, format: binary}}\n", indent, f->media_type);
	}
}

/* The type goes without saying where the numbers are those of geometry. */
static void put_tensor(struct gnp_writer *w, const struct gnp_tensor_info *info, bool input)
{
	gnp_writer_printf(w, "        - `%s` (", info->name);
	for (unsigned d = 0; d < info->rank; d++) {
		gnp_writer_text(w, d ? ", " : "");
		if (info->shape[d] < 0)
			gnp_writer_printf(w, "%c", gnp_extent_letter(info->shape[d]));
		else
			gnp_writer_printf(w, "%d", (int)info->shape[d]);
	}
	gnp_writer_printf(w, ")%s%s%s: %s\n", info->datatype == GNP_FP32 ? "" : " ",
	                  info->datatype == GNP_FP32 ? "" : gnp_datatype_name(info->datatype),
	                  input && info->optional ? ", optional" : "", info->help);
}

static void put_tensors(struct gnp_writer *w, const char *title, const struct gnp_tensor_info *infos, size_t count,
                        bool input)
{
	gnp_writer_printf(w, "        %s:\n\n", title);
	for (size_t i = 0; i < count; i++)
		put_tensor(w, &infos[i], input);
}

static void put_description(struct gnp_writer *w, const struct gnp_operation *operation)
{
	gnp_writer_printf(w, "      description: |\n        %s\n\n", operation->help);
	put_tensors(w, "Inputs, of any numeric type", operation->inputs, operation->input_count, true);
	gnp_writer_text(w, "\n");
	put_tensors(w, "Outputs, FP64 where points are FP64 and else FP32 unless a type is given", operation->outputs,
	            operation->output_count, false);
}

/* ---- Paths ---- */

static void put_timeout(struct gnp_writer *w)
{
	gnp_writer_printf(w,
	                  "        - {name: timeout, in: query, description: 'most time for the work, such as 30s or "
	                  "500ms; never more than the server allows', schema: {type: string}}\n");
}

static void put_written_formats(struct gnp_writer *w)
{
	const struct gnp_format *f;
	const char *separator = "";
	for (size_t i = 0; (f = gnp_format_at(i)); i++) {
		if (!gnp_format_writable(f))
			continue;
		gnp_writer_printf(w, "%s%s", separator, f->name);
		separator = ", ";
	}
}

static void put_file_operation(struct gnp_writer *w, const struct gnp_operation *operation)
{
	gnp_writer_printf(w, "  /v1/%s:\n    post:\n      operationId: %s\n      summary: ", operation->name,
	                  operation->name);
	put_quoted(w, operation->help);
	gnp_writer_text(w, "\n");
	put_description(w, operation);
	gnp_writer_text(w, "      parameters:\n");
	put_query(w, operation);
	gnp_writer_printf(w, "        - name: format\n          in: query\n"
	                  "          description: 'format of the answer where Accept names none; else the format of the "
	                  "body, or npz where that has no place for the answer'\n          schema: {type: string, enum: [");
	put_written_formats(w);
	gnp_writer_text(w, "]}\n");
	put_timeout(w);
	gnp_writer_text(w, "      requestBody:\n        required: true\n        content:\n");
	put_media_types(w, true, "          ");
	gnp_writer_printf(w, "      responses:\n        '200':\n"
	                  "          description: 'the cloud with the outputs; a comment left_out names those that a "
	                  "format made of rows cannot hold'\n          " GNPD_OPENAPI_REPORT_HEADERS "\n"
	                  "          content:\n");
	put_media_types(w, false, "            ");
	gnp_writer_text(w, "        default: {$ref: '#/components/responses/Error'}\n");
}

static void put_infer_operation(struct gnp_writer *w, const struct gnp_operation *operation)
{
	gnp_writer_printf(w, "  /v2/models/%s/infer:\n    post:\n      operationId: infer_%s\n      summary: ",
	                  operation->name, operation->name);
	put_quoted(w, operation->help);
	gnp_writer_text(w, "\n");
	put_description(w, operation);
	gnp_writer_printf(w, "      parameters:\n        - name: Inference-Header-Content-Length\n          in: header\n"
	                  "          description: 'bytes of the JSON part when binary tensors follow it; 0: the body is "
	                  "raw FP32 points (n, 3)'\n          schema: {type: integer, minimum: 0}\n      requestBody:\n"
	                  "        required: true\n        content:\n"
	                  "          application/json: {schema: {$ref: '#/components/schemas/%s_request'}}\n"
	                  "          application/octet-stream: {schema: {type: string, format: binary}}\n      responses:\n"
	                  "        '200':\n"
	                  "          description: 'the outputs, as JSON or as JSON followed by binary tensors'\n"
	                  "          headers: {X-Gnpd-Warnings: {$ref: '#/components/headers/Warnings'}}\n"
	                  "          content:\n"
	                  "            application/json: {schema: {$ref: '#/components/schemas/response'}}\n"
	                  "            application/octet-stream: {schema: {type: string, format: binary}}\n"
	                  "        default: {$ref: '#/components/responses/Error'}\n", operation->name);
}

static void put_job_operation(struct gnp_writer *w, const struct gnp_operation *operation)
{
	gnp_writer_printf(w, "  /v1/jobs/%s:\n    post:\n      operationId: submit_%s\n      summary: ", operation->name,
	                  operation->name);
	put_quoted(w, operation->help);
	gnp_writer_printf(w, "\n"
	                  "      description: 'As a job: takes the query and body of /v1/%s, or the body of "
	                  "/v2/models/%s/infer where Inference-Header-Content-Length is there or an application/json body "
	                  "has \"inputs\".'\n      parameters:\n"
	                  "        - {name: Idempotency-Key, in: header, description: 'the same key with the same request "
	                  "is the same job', schema: {type: string, minLength: 1, maxLength: 128}}\n", operation->name,
	                  operation->name);
	put_query(w, operation);
	put_timeout(w);
	gnp_writer_text(w, "      requestBody:\n        required: true\n        content:\n");
	put_media_types(w, true, "          ");
	gnp_writer_printf(w, "      responses:\n"
	                  "        '202': {description: 'the job, which is on disk; Location and Retry-After', content: "
	                  "{application/json: {schema: {$ref: '#/components/schemas/job'}}}}\n"
	                  "        '200': {description: 'the job the Idempotency-Key had made', content: "
	                  "{application/json: {schema: {$ref: '#/components/schemas/job'}}}}\n"
	                  "        '409': {description: 'the Idempotency-Key is that of another request (conflict), or the "
	                  "same request is being taken (in_progress, with Retry-After)', content: {application/json: "
	                  "{schema: {$ref: '#/components/schemas/error'}}}}\n"
	                  "        '507': {description: 'the store of jobs is full', content: {application/json: {schema: "
	                  "{$ref: '#/components/schemas/error'}}}}\n"
	                  "        default: {$ref: '#/components/responses/Error'}\n");
}

static void put_model_paths(struct gnp_writer *w, const struct gnp_operation *operation)
{
	static const struct {
		const char *path, *summary;
	} paths[] = {{"", "inputs, outputs and parameters"},
	             {"/ready", "whether the operation is ready"},
	             {"/stats", "counts and seconds"},
	             {"/config", "inputs and outputs as a model configuration of Triton"}};
	for (size_t i = 0; i < sizeof paths / sizeof paths[0]; i++)
		gnp_writer_printf(w, "  /v2/models/%s%s:\n    get:\n      summary: '%s'\n      responses:\n"
		                  "        '200': {description: 'done', content: {application/json: {}}}\n"
		                  "        default: {$ref: '#/components/responses/Error'}\n", operation->name, paths[i].path,
		                  paths[i].summary);
}

void gnpd_openapi_operation_paths(struct gnp_writer *w, const struct gnp_operation *operation)
{
	put_file_operation(w, operation);
	put_infer_operation(w, operation);
	put_job_operation(w, operation);
	put_model_paths(w, operation);
}

void gnpd_openapi_operation_request(struct gnp_writer *w, const struct gnp_operation *operation)
{
	gnp_writer_printf(w, "    %s_request:\n      type: object\n      required: [inputs]\n      properties:\n"
	                  "        id: {type: string}\n"
	                  "        inputs: {type: array, items: {$ref: '#/components/schemas/tensor'}}\n        outputs:\n"
	                  "          type: array\n          items:\n            type: object\n"
	                  "            required: [name]\n            properties:\n"
	                  "              name: {type: string, enum: [", operation->name);
	for (size_t i = 0; i < operation->output_count; i++)
		gnp_writer_printf(w, "%s%s", i ? ", " : "", operation->outputs[i].name);
	gnp_writer_printf(w, "]}\n              parameters: {type: object, properties: {binary_data: {type: boolean}}}\n"
	                  "        parameters:\n          type: object\n          properties:\n"
	                  "            binary_data_output: {type: boolean, default: false}\n"
	                  "            timeout: {type: integer, minimum: 0, description: 'most microseconds for the work; "
	                  "0: as many as the server allows'}\n");
	for (size_t i = 0; i < operation->parameter_count; i++) {
		gnp_writer_printf(w, "            %s: ", operation->parameters[i].name);
		put_schema(w, operation, &operation->parameters[i]);
		gnp_writer_text(w, "\n");
	}
}
