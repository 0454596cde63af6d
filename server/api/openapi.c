#include "server/api/openapi.h"

#include "proto/codec/parameters.h"
#include "proto/operation/operations.h"
#include "proto/tensor/datatype.h"
#include "server/api/openapi_jobs.h"
#include "server/api/openapi_operation.h"

/* The paths that no operation owns. */
static void put_fixed_paths(struct gnp_writer *w)
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
		gnp_writer_printf(w, "  %s:\n    %s:\n      summary: '%s'\n      responses:\n"
		                  "        '200': {description: 'done', content: {%s: {}}}\n"
		                  "        default: {$ref: '#/components/responses/Error'}\n", paths[i].path, paths[i].method,
		                  paths[i].summary, paths[i].media_type);
}

/* The paths of the admin listener, which is a server of its own. */
static void put_admin_paths(struct gnp_writer *w)
{
	static const char error[] = "        default: {$ref: '#/components/responses/Error'}\n";
	static const char server[] = "    servers: [{url: 'http://127.0.0.1:8090', description: 'the address of "
	                             "admin-listen'}]\n";
	gnp_writer_printf(w, "  /admin/reload:\n%s    get:\n"
	                  "      summary: 'what the last loads of keys, certificate and weights came to'\n"
	                  "      responses:\n        '200': {description: 'done', content: {application/json: {}}}\n"
	                  "%s    post:\n      summary: 'load keys, certificate and weights again, as SIGHUP does'\n"
	                  "      responses:\n"
	                  "        '202': {description: 'asked for; the number of the load', content: {application/json: "
	                  "{}}}\n%s", server, error, error);
	gnp_writer_printf(w, "  /admin/log-level:\n%s    get:\n      summary: 'the level of the log'\n      responses:\n"
	                  "        '200': {description: 'done', content: {application/json: {}}}\n%s    put:\n"
	                  "      summary: 'change it'\n      parameters:\n"
	                  "        - {name: level, in: query, required: true, schema: {type: string, enum: [error, "
	                  "warning, info, debug]}}\n      responses:\n"
	                  "        '200': {description: 'done', content: {application/json: {}}}\n%s", server, error,
	                  error);
	gnp_writer_printf(w, "  /admin/config:\n%s    get:\n"
	                  "      summary: 'the configuration in effect, as its file has it'\n      responses:\n"
	                  "        '200': {description: 'done', content: {text/plain: {}}}\n%s", server, error);
}

static void put_shared_schemas(struct gnp_writer *w)
{
	gnp_writer_printf(w, "    tensor:\n      type: object\n      required: [name, shape, datatype]\n      properties:\n"
	                  "        name: {type: string, maxLength: %d}\n"
	                  "        shape: {type: array, maxItems: %d, items: {type: integer, minimum: 0}}\n"
	                  "        datatype: {type: string, enum: [", GNP_TENSOR_NAME_MAX - 1, GNP_TENSOR_RANK_MAX);
	for (int d = 0; d < GNP_BYTES; d++)
		gnp_writer_printf(w, "%s%s", d ? ", " : "", gnp_datatype_name(d));
	gnp_writer_printf(w, "]}\n"
	                  "        parameters: {type: object, properties: {binary_data_size: {type: integer, minimum: "
	                  "0}}}\n        data: {type: array, description: 'row-major, flat or nested', items: {}}\n"
	                  "    response:\n      type: object\n      required: [model_name, model_version, outputs]\n"
	                  "      properties:\n        model_name: {type: string}\n        model_version: {type: string}\n"
	                  "        id: {type: string}\n        parameters: {type: object}\n"
	                  "        outputs: {type: array, items: {$ref: '#/components/schemas/tensor'}}\n    error:\n"
	                  "      type: object\n      required: [error, code]\n      properties:\n"
	                  "        error: {type: string}\n        code: {type: string, enum: [");
	for (int s = GNP_OK + 1; s < GNP_STATUS_COUNT; s++)
		gnp_writer_printf(w, "%s%s", s > GNP_OK + 1 ? ", " : "", gnp_status_name(s));
	gnp_writer_text(w, "]}\n        request_id: {type: string}\n");
}

gnp_status gnpd_openapi_write(struct gnp_buffer *buffer, struct gnp_error *error)
{
	struct gnp_writer w = gnp_writer_to(buffer, error);
	const struct gnp_operation *operation;
	gnp_writer_printf(&w, "# Written from the operation table by `make openapi`.\nopenapi: 3.0.3\ninfo:\n"
	                  "  title: gnpd\n"
	                  "  description: 'Geometry of point clouds: files in, files out (/v1) and the Open Inference "
	                  "Protocol (/v2).'\n  version: '1'\npaths:\n");
	for (size_t i = 0; (operation = gnp_operation_at(i)); i++)
		gnpd_openapi_operation_paths(&w, operation);
	gnpd_openapi_jobs_paths(&w);
	put_fixed_paths(&w);
	put_admin_paths(&w);
	gnp_writer_printf(&w, "security: [{}, {bearer: []}, {key: []}]\ncomponents:\n  securitySchemes:\n"
	                  "    bearer: {type: http, scheme: bearer, description: 'where the server has keys'}\n"
	                  "    key: {type: apiKey, in: header, name: X-API-Key}\n  headers:\n"
	                  "    Warnings: {description: 'how many warnings the answer has', schema: {type: integer, "
	                  "minimum: 0}}\n    Parameters:\n"
	                  "      description: 'what was done, as one line of JSON in ASCII: estimator, weights, "
	                  "weights_sha256, ..., warnings parted by \"; \"'\n      schema: {type: string, maxLength: %d}\n"
	                  "  responses:\n    Error:\n      description: 'what went wrong'\n      content:\n"
	                  "        application/json: {schema: {$ref: '#/components/schemas/error'}}\n  schemas:\n",
	                  GNP_PARAMETERS_HEADER_MAX);
	for (size_t i = 0; (operation = gnp_operation_at(i)); i++)
		gnpd_openapi_operation_request(&w, operation);
	gnpd_openapi_jobs_schema(&w);
	put_shared_schemas(&w);
	return w.status;
}
