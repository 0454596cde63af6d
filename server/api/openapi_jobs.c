#include "server/api/openapi_jobs.h"

#include "server/api/openapi_operation.h"

#define JOB "application/json: {schema: {$ref: '#/components/schemas/job'}}"
#define ID "        - {name: id, in: path, required: true, schema: {type: string}}\n"
#define STATES "[queued, running, succeeded, failed, cancelled, expired]"

void gnpd_openapi_jobs_paths(struct gnp_writer *w)
{
	gnp_writer_printf(w, "  /v1/jobs:\n    get:\n      operationId: list_jobs\n"
	                  "      summary: 'the jobs of the caller, newest first'\n      parameters:\n"
	                  "        - {name: state, in: query, schema: {type: string, enum: " STATES "}}\n"
	                  "        - {name: operation, in: query, schema: {type: string}}\n"
	                  "        - {name: limit, in: query, schema: {type: integer, minimum: 1, maximum: 1000, default: "
	                  "100}}\n"
	                  "        - {name: after, in: query, description: 'older than this job', schema: {type: string}}\n"
	                  "      responses:\n        '200':\n          description: 'done'\n          content:\n"
	                  "            application/json:\n              schema:\n                type: object\n"
	                  "                properties:\n"
	                  "                  jobs: {type: array, items: {$ref: '#/components/schemas/job'}}\n"
	                  "                  more: {type: boolean}\n"
	                  "                  next: {type: string, nullable: true}\n"
	                  "        default: {$ref: '#/components/responses/Error'}\n");
	gnp_writer_printf(w, "  /v1/jobs/{id}:\n    get:\n      operationId: job\n"
	                  "      summary: 'a job as it is now, or when it is over'\n      parameters:\n" ID
	                  "        - {name: wait, in: query, description: 'wait so long for its end, such as 30s', schema: "
	                  "{type: string}}\n      responses:\n        '200': {description: 'the job', content: {" JOB "}}\n"
	                  "        default: {$ref: '#/components/responses/Error'}\n    delete:\n"
	                  "      operationId: delete_job\n"
	                  "      summary: 'cancels a job that waits or runs, removes one that is over'\n      parameters:\n"
	                  ID "      responses:\n        '200': {description: 'it is cancelled', content: {" JOB "}}\n"
	                  "        '202': {description: 'it is being cancelled', content: {" JOB "}}\n"
	                  "        '204': {description: 'it is removed'}\n"
	                  "        default: {$ref: '#/components/responses/Error'}\n");
	gnp_writer_printf(w, "  /v1/jobs/{id}/events:\n    get:\n      operationId: job_events\n"
	                  "      summary: 'server-sent events state and progress, each with the job, until it is over'\n"
	                  "      parameters:\n" ID
	                  "        - {name: Last-Event-ID, in: header, description: 'the id of the last event that came, "
	                  "when asked again', schema: {type: string}}\n      responses:\n"
	                  "        '200': {description: 'the stream', content: {text/event-stream: {}}}\n"
	                  "        '204': {description: 'that was the last'}\n"
	                  "        default: {$ref: '#/components/responses/Error'}\n  /v1/jobs/{id}/result:\n    get:\n"
	                  "      operationId: job_result\n"
	                  "      summary: 'the answer, as the call itself would have given it'\n      parameters:\n" ID
	                  "        - {name: Range, in: header, description: 'one range of bytes', schema: {type: string}}\n"
	                  "        - {name: If-Range, in: header, schema: {type: string}}\n      responses:\n"
	                  "        '200': {description: 'the answer, with an ETag', " GNPD_OPENAPI_REPORT_HEADERS
	                  ", content: {'*/*': {}}}\n        '206': {description: 'the part asked for', "
	                  GNPD_OPENAPI_REPORT_HEADERS ", content: {'*/*': {}}}\n"
	                  "        '409': {description: 'it is not over yet', content: {application/json: {schema: {$ref: "
	                  "'#/components/schemas/error'}}}}\n"
	                  "        '410': {description: 'it was cancelled, or has expired', content: {application/json: "
	                  "{schema: {$ref: '#/components/schemas/error'}}}}\n"
	                  "        default: {$ref: '#/components/responses/Error'}\n");
}

void gnpd_openapi_jobs_schema(struct gnp_writer *w)
{
	gnp_writer_printf(w, "    job:\n      type: object\n      required: [id, operation, state, created]\n"
	                  "      properties:\n        id: {type: string}\n        operation: {type: string}\n"
	                  "        state: {type: string, enum: " STATES "}\n"
	                  "        created: {type: string, format: date-time}\n"
	                  "        started: {type: string, format: date-time, nullable: true}\n"
	                  "        finished: {type: string, format: date-time, nullable: true}\n        progress:\n"
	                  "          type: object\n          properties:\n"
	                  "            fraction: {type: number, minimum: 0, maximum: 1}\n"
	                  "            stage: {type: string}\n            step: {type: integer}\n"
	                  "            steps: {type: integer}\n            eta_seconds: {type: number, nullable: true}\n"
	                  "        error: {type: object, properties: {code: {type: string}, text: {type: string}}}\n"
	                  "        result: {type: object, properties: {bytes: {type: integer}, content_type: {type: "
	                  "string}, href: {type: string}, sha256: {type: string}}}\n"
	                  "        warnings: {type: array, description: 'of a job that succeeded', items: {type: string}}\n");
}
