/* Help texts and the OpenAPI document, both written from the operation table. */
#include <string.h>

#include "proto/file/file.h"
#include "proto/format/parameters.h"
#include "proto/operation/operation.h"
#include "proto/tensor/number.h"

/* Writes through one object, so that a long run of lines needs one check at its end. */
struct writer {
	struct gnp_buffer *buffer;
	struct gnp_error *error;
	gnp_status status;
};

#define PUT(w, ...)                                                               \
	do {                                                                          \
		if ((w)->status == GNP_OK)                                                \
			(w)->status = gnp_buffer_printf((w)->buffer, (w)->error, __VA_ARGS__); \
	} while (0)

static void put_choices(struct writer *w, const struct gnp_parameter *p, const char *separator)
{
	for (size_t i = 0; p->choices[i]; i++)
		PUT(w, "%s%s", i ? separator : "", p->choices[i]);
}

/* What follows a flag's name: 12..500, cover|all, NAMES; that of a switch may be left out. */
static void put_value(struct writer *w, const struct gnp_parameter *p)
{
	char range[GNP_PARAMETER_RANGE_MAX];
	gnp_parameter_range(p, range);
	PUT(w, p->type == GNP_PARAMETER_BOOL ? "" : " ");
	switch (p->type) {
	case GNP_PARAMETER_INTEGER:
	case GNP_PARAMETER_NUMBER: PUT(w, "%s", range); break;
	case GNP_PARAMETER_AUTO: PUT(w, "auto|%s", range); break;
	case GNP_PARAMETER_BOOL: PUT(w, "[=true|false]"); break;
	case GNP_PARAMETER_CHOICE: put_choices(w, p, "|"); break;
	case GNP_PARAMETER_SET: PUT(w, "NAME,..."); break;
	case GNP_PARAMETER_MODEL: PUT(w, "auto|NAME"); break;
	}
}

gnp_status gnp_operation_usage(const struct gnp_operation *operation, struct gnp_buffer *buffer, struct gnp_error *error)
{
	struct writer w = {buffer, error, GNP_OK};
	for (size_t i = 0; i < operation->parameter_count; i++) {
		const struct gnp_parameter *p = &operation->parameters[i];
		PUT(&w, "  --%s", p->name);
		put_value(&w, p);
		PUT(&w, "\n        %s (default %s)\n", p->help, p->default_text);
		for (size_t o = 0; p->type == GNP_PARAMETER_SET && o < operation->output_count; o++)
			PUT(&w, "          %-28s %s\n", operation->outputs[o].name, operation->outputs[o].help);
	}
	return w.status;
}

/* A YAML scalar in single quotes. */
static void put_quoted(struct writer *w, const char *text)
{
	PUT(w, "'");
	for (; *text; text++)
		PUT(w, "%s%c", *text == '\'' ? "'" : "", *text);
	PUT(w, "'");
}

/* As every YAML reads it: older ones take 1e+200 for a text and 1.0e+200 for a number. */
static void put_number(struct writer *w, double value)
{
	char text[GNP_NUMBER_LENGTH_MAX + 1];
	text[gnp_number_write_double(text, value)] = '\0';
	int mantissa = (int)strcspn(text, "e");
	bool plain = !text[mantissa] || strchr(text, '.');
	PUT(w, "%.*s%s%s", mantissa, text, plain ? "" : ".0", text + mantissa);
}

static void put_range(struct writer *w, const struct gnp_parameter *p)
{
	if (p->minimum == GNP_ABOVE_ZERO) {
		PUT(w, ", minimum: 0, exclusiveMinimum: true");
	} else {
		PUT(w, ", minimum: ");
		put_number(w, p->minimum);
	}
	PUT(w, ", maximum: ");
	put_number(w, p->maximum);
}

static void put_type(struct writer *w, const struct gnp_parameter *p)
{
	static const char *const types[] = {
		[GNP_PARAMETER_INTEGER] = "integer", [GNP_PARAMETER_NUMBER] = "number", [GNP_PARAMETER_AUTO] = "number",
		[GNP_PARAMETER_BOOL] = "boolean",    [GNP_PARAMETER_CHOICE] = "string", [GNP_PARAMETER_SET] = "string",
		[GNP_PARAMETER_MODEL] = "string"};
	bool automatic = p->type == GNP_PARAMETER_AUTO;
	PUT(w, "%stype: %s", automatic ? "oneOf: [{" : "", types[p->type]);
	if (gnp_parameter_is_number(p))
		put_range(w, p);
	if (automatic)
		PUT(w, "}, {type: string, enum: [auto]}]");
}

static void put_schema(struct writer *w, const struct gnp_operation *operation, const struct gnp_parameter *p)
{
	PUT(w, "{");
	put_type(w, p);
	if (p->type == GNP_PARAMETER_CHOICE) {
		PUT(w, ", enum: [");
		put_choices(w, p, ", ");
		PUT(w, "]");
	}
	if (p->type == GNP_PARAMETER_SET) {
		PUT(w, ", pattern: '^(all|(");
		for (size_t i = 0; i < operation->output_count; i++)
			PUT(w, "%s%s", i ? "|" : "", operation->outputs[i].name);
		PUT(w, ")(,[a-z_]+)*)$'");
	}
	if (p->type == GNP_PARAMETER_MODEL)
		PUT(w, ", maxLength: %d", GNP_MODEL_NAME_MAX);
	PUT(w, ", default: ");
	double number;
	if (gnp_number_read(p->default_text, p->default_text + strlen(p->default_text), &number))
		put_number(w, number);
	else if (p->type == GNP_PARAMETER_BOOL)
		PUT(w, "%s", p->default_text);
	else
		put_quoted(w, p->default_text);
	PUT(w, "}");
}

static void put_query(struct writer *w, const struct gnp_operation *operation)
{
	for (size_t i = 0; i < operation->parameter_count; i++) {
		const struct gnp_parameter *p = &operation->parameters[i];
		PUT(w, "        - name: %s\n          in: query\n          description: ", p->name);
		put_quoted(w, p->help);
		PUT(w, "\n          schema: ");
		put_schema(w, operation, p);
		PUT(w, "\n");
	}
}

static void put_media_types(struct writer *w, bool in, const char *indent)
{
	for (int f = 0; f < GNP_FORMAT_COUNT; f++) {
		if (in ? gnp_format_readable(f) : gnp_format_writable(f))
			PUT(w, "%s%s: {schema: {type: string, format: binary}}\n", indent, gnp_format_media_type(f));
	}
}

/* The type goes without saying where the numbers are those of geometry. */
static void put_tensor(struct writer *w, const struct gnp_tensor_info *info, bool input)
{
	PUT(w, "        - `%s` (", info->name);
	for (unsigned d = 0; d < info->rank; d++) {
		PUT(w, d ? ", " : "");
		if (info->shape[d] < 0)
			PUT(w, "%c", gnp_extent_letter(info->shape[d]));
		else
			PUT(w, "%d", (int)info->shape[d]);
	}
	PUT(w, ")%s%s%s: %s\n", info->datatype == GNP_FP32 ? "" : " ", info->datatype == GNP_FP32 ? "" : gnp_datatype_name(info->datatype),
	    input && info->optional ? ", optional" : "", info->help);
}

static void put_tensors(struct writer *w, const char *title, const struct gnp_tensor_info *infos, size_t count, bool input)
{
	PUT(w, "        %s:\n\n", title);
	for (size_t i = 0; i < count; i++)
		put_tensor(w, &infos[i], input);
}

static void put_description(struct writer *w, const struct gnp_operation *operation)
{
	PUT(w, "      description: |\n        %s\n\n", operation->help);
	put_tensors(w, "Inputs, of any numeric type", operation->inputs, operation->input_count, true);
	PUT(w, "\n");
	put_tensors(w, "Outputs, FP64 where points are FP64 and else FP32 unless a type is given", operation->outputs, operation->output_count, false);
}

static void put_timeout(struct writer *w)
{
	PUT(w, "        - {name: timeout, in: query, description: 'most time for the work, such as 30s or 500ms; never more than the server allows', "
	       "schema: {type: string}}\n");
}

/* Of what an answer says of itself. */
#define REPORT_HEADERS "headers: {X-Gnpd-Warnings: {$ref: '#/components/headers/Warnings'}, X-Gnpd-Parameters: {$ref: '#/components/headers/Parameters'}}"

static void put_file_operation(struct writer *w, const struct gnp_operation *operation)
{
	PUT(w, "  /v1/%s:\n    post:\n      operationId: %s\n      summary: ", operation->name, operation->name);
	put_quoted(w, operation->help);
	PUT(w, "\n");
	put_description(w, operation);
	PUT(w, "      parameters:\n");
	put_query(w, operation);
	PUT(w, "        - name: format\n          in: query\n          description: 'format of the answer where Accept names none; else the format of the body, or npz where that has no place for the answer'\n"
	       "          schema: {type: string, enum: [");
	for (int f = 0, first = 1; f < GNP_FORMAT_COUNT; f++) {
		if (gnp_format_writable(f)) {
			PUT(w, "%s%s", first ? "" : ", ", gnp_format_name(f));
			first = 0;
		}
	}
	PUT(w, "]}\n");
	put_timeout(w);
	PUT(w, "      requestBody:\n        required: true\n        content:\n");
	put_media_types(w, true, "          ");
	PUT(w, "      responses:\n        '200':\n          description: 'the cloud with the outputs; a comment left_out names those that a format made of rows cannot hold'\n          " REPORT_HEADERS "\n          content:\n");
	put_media_types(w, false, "            ");
	PUT(w, "        default: {$ref: '#/components/responses/Error'}\n");
}

static void put_infer_operation(struct writer *w, const struct gnp_operation *operation)
{
	PUT(w, "  /v2/models/%s/infer:\n    post:\n      operationId: infer_%s\n      summary: ", operation->name, operation->name);
	put_quoted(w, operation->help);
	PUT(w, "\n");
	put_description(w, operation);
	PUT(w, "      parameters:\n"
	       "        - name: Inference-Header-Content-Length\n          in: header\n"
	       "          description: 'bytes of the JSON part when binary tensors follow it; 0: the body is raw FP32 points (n, 3)'\n"
	       "          schema: {type: integer, minimum: 0}\n"
	       "      requestBody:\n        required: true\n        content:\n"
	       "          application/json: {schema: {$ref: '#/components/schemas/%s_request'}}\n"
	       "          application/octet-stream: {schema: {type: string, format: binary}}\n"
	       "      responses:\n        '200':\n          description: 'the outputs, as JSON or as JSON followed by binary tensors'\n"
	       "          headers: {X-Gnpd-Warnings: {$ref: '#/components/headers/Warnings'}}\n"
	       "          content:\n"
	       "            application/json: {schema: {$ref: '#/components/schemas/response'}}\n"
	       "            application/octet-stream: {schema: {type: string, format: binary}}\n"
	       "        default: {$ref: '#/components/responses/Error'}\n", operation->name);
}

/* ---- Jobs ---- */

static void put_job_operation(struct writer *w, const struct gnp_operation *operation)
{
	PUT(w, "  /v1/jobs/%s:\n    post:\n      operationId: submit_%s\n      summary: ", operation->name, operation->name);
	put_quoted(w, operation->help);
	PUT(w, "\n      description: 'As a job: takes the query and body of /v1/%s, or the body of /v2/models/%s/infer where "
	       "Inference-Header-Content-Length is there or an application/json body has \"inputs\".'\n      parameters:\n"
	       "        - {name: Idempotency-Key, in: header, description: 'the same key with the same request is the same job', "
	       "schema: {type: string, minLength: 1, maxLength: 128}}\n",
	    operation->name, operation->name);
	put_query(w, operation);
	put_timeout(w);
	PUT(w, "      requestBody:\n        required: true\n        content:\n");
	put_media_types(w, true, "          ");
	PUT(w, "      responses:\n"
	       "        '202': {description: 'the job, which is on disk; Location and Retry-After', content: {application/json: {schema: {$ref: '#/components/schemas/job'}}}}\n"
	       "        '200': {description: 'the job the Idempotency-Key had made', content: {application/json: {schema: {$ref: '#/components/schemas/job'}}}}\n"
	       "        '409': {description: 'the Idempotency-Key is that of another request (conflict), or the same request is being taken (in_progress, with Retry-After)', content: {application/json: {schema: {$ref: '#/components/schemas/error'}}}}\n"
	       "        '507': {description: 'the store of jobs is full', content: {application/json: {schema: {$ref: '#/components/schemas/error'}}}}\n"
	       "        default: {$ref: '#/components/responses/Error'}\n");
}

#define JOB "application/json: {schema: {$ref: '#/components/schemas/job'}}"
#define ID "        - {name: id, in: path, required: true, schema: {type: string}}\n"
#define STATES "[queued, running, succeeded, failed, cancelled, expired]"

static void put_job_paths(struct writer *w)
{
	PUT(w, "  /v1/jobs:\n    get:\n      operationId: list_jobs\n      summary: 'the jobs of the caller, newest first'\n      parameters:\n"
	       "        - {name: state, in: query, schema: {type: string, enum: " STATES "}}\n"
	       "        - {name: operation, in: query, schema: {type: string}}\n"
	       "        - {name: limit, in: query, schema: {type: integer, minimum: 1, maximum: 1000, default: 100}}\n"
	       "        - {name: after, in: query, description: 'older than this job', schema: {type: string}}\n"
	       "      responses:\n        '200':\n          description: 'done'\n          content:\n            application/json:\n"
	       "              schema:\n                type: object\n                properties:\n"
	       "                  jobs: {type: array, items: {$ref: '#/components/schemas/job'}}\n"
	       "                  more: {type: boolean}\n                  next: {type: string, nullable: true}\n"
	       "        default: {$ref: '#/components/responses/Error'}\n");
	PUT(w, "  /v1/jobs/{id}:\n    get:\n      operationId: job\n      summary: 'a job as it is now, or when it is over'\n      parameters:\n" ID
	       "        - {name: wait, in: query, description: 'wait so long for its end, such as 30s', schema: {type: string}}\n"
	       "      responses:\n        '200': {description: 'the job', content: {" JOB "}}\n"
	       "        default: {$ref: '#/components/responses/Error'}\n"
	       "    delete:\n      operationId: delete_job\n      summary: 'cancels a job that waits or runs, removes one that is over'\n"
	       "      parameters:\n" ID "      responses:\n        '200': {description: 'it is cancelled', content: {" JOB "}}\n"
	       "        '202': {description: 'it is being cancelled', content: {" JOB "}}\n        '204': {description: 'it is removed'}\n"
	       "        default: {$ref: '#/components/responses/Error'}\n");
	PUT(w, "  /v1/jobs/{id}/events:\n    get:\n      operationId: job_events\n"
	       "      summary: 'server-sent events state and progress, each with the job, until it is over'\n      parameters:\n" ID
	       "        - {name: Last-Event-ID, in: header, description: 'the id of the last event that came, when asked again', schema: {type: string}}\n"
	       "      responses:\n        '200': {description: 'the stream', content: {text/event-stream: {}}}\n"
	       "        '204': {description: 'that was the last'}\n"
	       "        default: {$ref: '#/components/responses/Error'}\n"
	       "  /v1/jobs/{id}/result:\n    get:\n      operationId: job_result\n"
	       "      summary: 'the answer, as the call itself would have given it'\n      parameters:\n" ID
	       "        - {name: Range, in: header, description: 'one range of bytes', schema: {type: string}}\n"
	       "        - {name: If-Range, in: header, schema: {type: string}}\n"
	       "      responses:\n        '200': {description: 'the answer, with an ETag', " REPORT_HEADERS ", content: {'*/*': {}}}\n"
	       "        '206': {description: 'the part asked for', " REPORT_HEADERS ", content: {'*/*': {}}}\n"
	       "        '409': {description: 'it is not over yet', content: {application/json: {schema: {$ref: '#/components/schemas/error'}}}}\n"
	       "        '410': {description: 'it was cancelled, or has expired', content: {application/json: {schema: {$ref: '#/components/schemas/error'}}}}\n"
	       "        default: {$ref: '#/components/responses/Error'}\n");
}

static void put_job_schema(struct writer *w)
{
	PUT(w, "    job:\n      type: object\n      required: [id, operation, state, created]\n      properties:\n"
	       "        id: {type: string}\n        operation: {type: string}\n        state: {type: string, enum: " STATES "}\n"
	       "        created: {type: string, format: date-time}\n        started: {type: string, format: date-time, nullable: true}\n"
	       "        finished: {type: string, format: date-time, nullable: true}\n"
	       "        progress:\n          type: object\n          properties:\n            fraction: {type: number, minimum: 0, maximum: 1}\n"
	       "            stage: {type: string}\n            step: {type: integer}\n            steps: {type: integer}\n"
	       "            eta_seconds: {type: number, nullable: true}\n"
	       "        error: {type: object, properties: {code: {type: string}, text: {type: string}}}\n"
	       "        result: {type: object, properties: {bytes: {type: integer}, content_type: {type: string}, href: {type: string}, "
	       "sha256: {type: string}}}\n"
	       "        warnings: {type: array, description: 'of a job that succeeded', items: {type: string}}\n");
}

static void put_request_schema(struct writer *w, const struct gnp_operation *operation)
{
	PUT(w, "    %s_request:\n      type: object\n      required: [inputs]\n      properties:\n"
	       "        id: {type: string}\n"
	       "        inputs: {type: array, items: {$ref: '#/components/schemas/tensor'}}\n"
	       "        outputs:\n          type: array\n          items:\n            type: object\n            required: [name]\n"
	       "            properties:\n              name: {type: string, enum: [", operation->name);
	for (size_t i = 0; i < operation->output_count; i++)
		PUT(w, "%s%s", i ? ", " : "", operation->outputs[i].name);
	PUT(w, "]}\n              parameters: {type: object, properties: {binary_data: {type: boolean}}}\n"
	       "        parameters:\n          type: object\n          properties:\n"
	       "            binary_data_output: {type: boolean, default: false}\n"
	       "            timeout: {type: integer, minimum: 0, description: 'most microseconds for the work; 0: as many as the server allows'}\n");
	for (size_t i = 0; i < operation->parameter_count; i++) {
		PUT(w, "            %s: ", operation->parameters[i].name);
		put_schema(w, operation, &operation->parameters[i]);
		PUT(w, "\n");
	}
}

/* The paths that no operation owns. */
static void put_fixed_paths(struct writer *w)
{
	static const struct {
		const char *path, *method, *summary, *media_type;
	} paths[] = {
		{"/v2", "get", "name, version and extensions of the server", "application/json"},
		{"/v2/health/live", "get", "whether the process answers", "application/json"},
		{"/v2/health/ready", "get", "whether work is accepted", "application/json"},
		{"/v2/repository/index", "post", "the operations", "application/json"},
		{"/metrics", "get", "Prometheus metrics", "text/plain"},
		{"/openapi.yaml", "get", "this document", "application/yaml"},
	};
	for (size_t i = 0; i < sizeof paths / sizeof paths[0]; i++)
		PUT(w, "  %s:\n    %s:\n      summary: '%s'\n      responses:\n        '200': {description: 'done', content: {%s: {}}}\n"
		       "        default: {$ref: '#/components/responses/Error'}\n",
		    paths[i].path, paths[i].method, paths[i].summary, paths[i].media_type);
}

/* The paths of the admin listener, which is a server of its own. */
static void put_admin_paths(struct writer *w)
{
	static const char error[] = "        default: {$ref: '#/components/responses/Error'}\n",
	                  server[] = "    servers: [{url: 'http://127.0.0.1:8090', description: 'the address of admin-listen'}]\n";
	PUT(w, "  /admin/reload:\n%s    get:\n      summary: 'what the last loads of keys, certificate and weights came to'\n      responses:\n"
	       "        '200': {description: 'done', content: {application/json: {}}}\n%s"
	       "    post:\n      summary: 'load keys, certificate and weights again, as SIGHUP does'\n      responses:\n"
	       "        '202': {description: 'asked for; the number of the load', content: {application/json: {}}}\n%s", server, error, error);
	PUT(w, "  /admin/log-level:\n%s    get:\n      summary: 'the level of the log'\n      responses:\n"
	       "        '200': {description: 'done', content: {application/json: {}}}\n%s"
	       "    put:\n      summary: 'change it'\n      parameters:\n"
	       "        - {name: level, in: query, required: true, schema: {type: string, enum: [error, warning, info, debug]}}\n"
	       "      responses:\n        '200': {description: 'done', content: {application/json: {}}}\n%s", server, error, error);
	PUT(w, "  /admin/config:\n%s    get:\n      summary: 'the configuration in effect, as its file has it'\n      responses:\n"
	       "        '200': {description: 'done', content: {text/plain: {}}}\n%s", server, error);
}

static void put_model_paths(struct writer *w, const struct gnp_operation *operation)
{
	static const struct {
		const char *path, *summary;
	} paths[] = {{"", "inputs, outputs and parameters"}, {"/ready", "whether the operation is ready"}, {"/stats", "counts and seconds"},
	             {"/config", "inputs and outputs as a model configuration of Triton"}};
	for (size_t i = 0; i < sizeof paths / sizeof paths[0]; i++)
		PUT(w, "  /v2/models/%s%s:\n    get:\n      summary: '%s'\n      responses:\n"
		       "        '200': {description: 'done', content: {application/json: {}}}\n"
		       "        default: {$ref: '#/components/responses/Error'}\n",
		    operation->name, paths[i].path, paths[i].summary);
}

static void put_shared_schemas(struct writer *w)
{
	PUT(w, "    tensor:\n      type: object\n      required: [name, shape, datatype]\n      properties:\n"
	       "        name: {type: string, maxLength: %d}\n"
	       "        shape: {type: array, maxItems: %d, items: {type: integer, minimum: 0}}\n"
	       "        datatype: {type: string, enum: [", GNP_TENSOR_NAME_MAX - 1, GNP_TENSOR_RANK_MAX);
	for (int d = 0; d < GNP_BYTES; d++)
		PUT(w, "%s%s", d ? ", " : "", gnp_datatype_name(d));
	PUT(w, "]}\n        parameters: {type: object, properties: {binary_data_size: {type: integer, minimum: 0}}}\n"
	       "        data: {type: array, description: 'row-major, flat or nested', items: {}}\n"
	       "    response:\n      type: object\n      required: [model_name, model_version, outputs]\n      properties:\n"
	       "        model_name: {type: string}\n        model_version: {type: string}\n        id: {type: string}\n"
	       "        parameters: {type: object}\n"
	       "        outputs: {type: array, items: {$ref: '#/components/schemas/tensor'}}\n"
	       "    error:\n      type: object\n      required: [error, code]\n      properties:\n"
	       "        error: {type: string}\n        code: {type: string, enum: [");
	for (int s = GNP_OK + 1; s < GNP_STATUS_COUNT; s++)
		PUT(w, "%s%s", s > GNP_OK + 1 ? ", " : "", gnp_status_name(s));
	PUT(w, "]}\n        request_id: {type: string}\n");
}

gnp_status gnp_openapi_write(struct gnp_buffer *buffer, struct gnp_error *error)
{
	struct writer w = {buffer, error, GNP_OK};
	const struct gnp_operation *operation;
	PUT(&w, "# Written from the operation table by `make openapi`.\nopenapi: 3.0.3\ninfo:\n  title: gnpd\n"
	        "  description: 'Geometry of point clouds: files in, files out (/v1) and the Open Inference Protocol (/v2).'\n"
	        "  version: '1'\npaths:\n");
	for (size_t i = 0; (operation = gnp_operation_at(i)); i++) {
		put_file_operation(&w, operation);
		put_infer_operation(&w, operation);
		put_job_operation(&w, operation);
		put_model_paths(&w, operation);
	}
	put_job_paths(&w);
	put_fixed_paths(&w);
	put_admin_paths(&w);
	PUT(&w, "security: [{}, {bearer: []}, {key: []}]\n"
	        "components:\n  securitySchemes:\n    bearer: {type: http, scheme: bearer, description: 'where the server has keys'}\n"
	        "    key: {type: apiKey, in: header, name: X-API-Key}\n  headers:\n"
	        "    Warnings: {description: 'how many warnings the answer has', schema: {type: integer, minimum: 0}}\n"
	        "    Parameters:\n      description: 'what was done, as one line of JSON in ASCII: estimator, weights, weights_sha256, ..., warnings parted by \"; \"'\n"
	        "      schema: {type: string, maxLength: %d}\n"
	        "  responses:\n    Error:\n      description: 'what went wrong'\n      content:\n"
	        "        application/json: {schema: {$ref: '#/components/schemas/error'}}\n  schemas:\n", GNP_PARAMETERS_HEADER_MAX);
	for (size_t i = 0; (operation = gnp_operation_at(i)); i++)
		put_request_schema(&w, operation);
	put_job_schema(&w);
	put_shared_schemas(&w);
	return w.status;
}
