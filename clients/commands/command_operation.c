/* gnp OPERATION: runs any operation of proto/operation, by this machine's core or by a server; the answer is the same
 * bytes. */
#include <stdlib.h>
#include <string.h>

#include "clients/command.h"
#include "clients/file_io.h"
#include "clients/http_client.h"
#include "clients/job_client.h"
#include "clients/notices.h"
#include "clients/server_options.h"
#include "clients/session.h"
#include "proto/file/file.h"
#include "proto/file/result.h"
#include "proto/operation/call.h"
#include "proto/operation/parameter.h"

static const struct gnp_option client_options[] = {
	{"output", 'o', "FILE", "where to write (default: standard output)"},
	{"parameters", 0, "FILE", "where to write what was done, as JSON: NPY and CSV have no place for it"},
	{"format", 0, "NAME", "format of the output (default: by extension; ply on standard output)"},
	{"input-format", 0, "NAME", "format of the input (default: by extension, else by its first bytes)"},
	{"local", 0, NULL, "work on this machine (the default)"},
	{"workers", 0, "N", "threads of local work (default: one a core)"},
	{"weights-dir", 0, "DIR", "weights of local work (default: the installed ones, else ./weights)"},
	{"url", 0, "URL", "have a server do it, for example http://127.0.0.1:8080"},
	GNP_SERVER_OPTIONS,
	{"timeout", 0, "SECONDS", "how long a server may take (default: no limit)"},
	{"job", 0, NULL, "with --url: as a job of the server; prints its id"},
	{"wait", 0, NULL, "with --job: wait for it and write its result"},
};
#define CLIENT_OPTIONS (sizeof client_options / sizeof client_options[0])

/* One invocation. */
struct job {
	const struct gnp_operation *operation;
	const char *input, *output, *url, *input_format_name, *weights_dir;
	const struct gnp_format *input_format, *output_format;
	uint64_t workers;
	struct gnp_http_request server; /* key, cacert, timeout */
	bool job, wait;
	const struct gnp_arguments *arguments;
	struct gnp_values parameters, report; /* as given; what the answer says of itself */
	struct gnp_buffer body; /* the input file */
};

static bool is_client_option(const struct gnp_option *option)
{
	for (size_t i = 0; i < CLIENT_OPTIONS; i++)
		if (strcmp(client_options[i].name, option->name) == 0)
			return true;
	return false;
}

/* Every parameter given is checked against the table before any work or request. */
static gnp_status parse_parameters(const struct gnp_arguments *arguments, struct job *job, struct gnp_error *error)
{
	_Alignas(16) unsigned char checked[GNP_OPTIONS_SIZE_MAX];
	gnp_status status = GNP_OK;
	job->operation->defaults(checked);
	for (size_t i = 0; i < arguments->option_count && status == GNP_OK; i++) {
		const struct gnp_option_given *given = &arguments->options[i];
		if (is_client_option(given->option) || strcmp(given->option->name, gnp_option_quiet.name) == 0)
			continue;
		status = gnp_parameter_parse(job->operation, checked, given->option->name, given->value, error);
		if (status == GNP_OK)
			status = gnp_values_add_string(&job->parameters, given->option->name, given->value, error);
	}
	return status;
}

static gnp_status parse_job(const struct gnp_arguments *arguments, struct job *job, struct gnp_error *error)
{
	job->input = arguments->operands[0];
	job->output = gnp_arguments_get(arguments, "output", "-");
	job->url = gnp_arguments_get(arguments, "url", NULL);
	job->weights_dir = gnp_arguments_get(arguments, "weights-dir", NULL);
	job->input_format_name = gnp_arguments_get(arguments, "input-format", NULL);
	if (job->url && gnp_arguments_has(arguments, "local"))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "--local and --url: give one of them");
	if (job->url && job->weights_dir)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "--weights-dir: is of local work, and --url asks a server");
	if (job->url && gnp_arguments_has(arguments, "workers"))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "--workers: is of local work, and --url asks a server");
	job->job = gnp_arguments_has(arguments, "job");
	job->wait = gnp_arguments_has(arguments, "wait");
	if (job->job && !job->url)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "--job: needs --url, jobs are those of a server");
	if (job->job && !job->wait && gnp_arguments_has(arguments, "parameters"))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "--parameters: are the answer's, with --job it needs --wait");
	if (job->wait && !job->job)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "--wait: needs --job");
	gnp_status status = gnp_server_options_take(arguments, job->url != NULL, &job->server, error);
	if (status == GNP_OK)
		status = gnp_arguments_integer(arguments, "workers", 1, 1024, &job->workers, error);
	if (status == GNP_OK)
		status = gnp_arguments_number(arguments, "timeout", 0.001, 1e6, &job->server.timeout, error);
	if (status == GNP_OK)
		status = gnp_file_format_out(gnp_arguments_get(arguments, "format", NULL), job->output, &job->output_format, error);
	if (status == GNP_OK)
		status = parse_parameters(arguments, job, error);
	return status;
}

static gnp_status run_local(struct job *job, struct gnp_session *session, struct gnp_buffer *answer, struct gnp_error *error)
{
	struct gnp_models *models = NULL;
	struct gnp_request request = {0};
	struct gnp_response response = {0};
	struct gnp_call call;
	const struct gnp_file_wants wants = {.inputs = job->operation->inputs, .input_count = job->operation->input_count};
	gnp_task_stage(&session->task, GNP_STAGE_DECODE, 0);
	gnp_status status = gnp_file_decode(job->input_format, job->body.data, job->body.size, &wants, &request.inputs, error);
	request.parameters = job->parameters;
	if (status == GNP_OK && job->operation->resolve)
		status = gnp_models_load(job->weights_dir, &models, error);
	if (status == GNP_OK)
		status = gnp_call_prepare(job->operation, &request, &(struct gnp_limits){.models = models}, &call, error);
	if (status == GNP_OK)
		status = gnp_call_run(&call, session->pool, &session->task, &response, error);
	gnp_task_stage(&session->task, GNP_STAGE_ENCODE, 0);
	if (status == GNP_OK)
		status = gnp_result_encode(job->output_format, &request, &response, answer, error);
	if (status == GNP_OK) {
		job->report = response.parameters;
		response.parameters = (struct gnp_values){0};
	}
	gnp_response_clear(&response);
	request.parameters = (struct gnp_values){0};
	gnp_request_clear(&request);
	gnp_models_release(models);
	return status;
}

/* URL/v1/OPERATION?name=value&..., or URL/v1/jobs/OPERATION... */
static gnp_status build_url(const struct job *job, struct gnp_buffer *url, struct gnp_error *error)
{
	size_t length = strlen(job->url);
	while (length && job->url[length - 1] == '/')
		length--;
	gnp_status status = gnp_buffer_printf(url, error, "%.*s/v1/%s%s", (int)length, job->url, job->job ? "jobs/" : "", job->operation->name);
	for (size_t i = 0; i < job->parameters.count && status == GNP_OK; i++) {
		status = gnp_buffer_printf(url, error, "%c%s=", i ? '&' : '?', job->parameters.items[i].name);
		if (status == GNP_OK)
			status = gnp_http_escape(job->parameters.items[i].string, url, error);
	}
	return status == GNP_OK ? gnp_buffer_append(url, "", 1, error) : status;
}

static gnp_status run_remote(struct job *job, struct gnp_session *session, struct gnp_buffer *answer, struct gnp_error *error)
{
	struct gnp_buffer url = {0}, header = {0};
	gnp_status status = build_url(job, &url, error);
	if (status == GNP_OK) {
		struct gnp_http_request request = job->server;
		request.url = (const char *)url.data;
		request.body = job->body.data;
		request.size = job->body.size;
		request.content_type = gnp_format_media_type(job->input_format);
		request.accept = gnp_format_media_type(job->output_format);
		request.parameters = &header;
		status = gnp_http_post(&request, &session->progress, answer, error);
	}
	if (status == GNP_OK && !job->job)
		gnp_notices_of_answer(job->output_format, answer, &header, &job->report);
	gnp_buffer_clear(&header);
	gnp_buffer_clear(&url);
	return status;
}

/* Submits; the answer is the id as a line, or what the job answers. */
static gnp_status run_as_job(struct job *job, struct gnp_session *session, struct gnp_buffer *answer, struct gnp_error *error)
{
	const struct gnp_job_server server = {.url = job->url, .with = job->server, .progress = &session->progress};
	char id[GNP_JOB_ID_MAX];
	struct gnp_buffer json = {0}, header = {0};
	gnp_status status = run_remote(job, session, &json, error);
	if (status == GNP_OK)
		status = gnp_job_id(&json, id, error);
	gnp_buffer_clear(&json);
	if (status == GNP_OK && !job->wait)
		return gnp_buffer_printf(answer, error, "%s\n", id);
	if (status == GNP_OK)
		status = gnp_job_wait(&server, id, error);
	if (status == GNP_OK)
		status = gnp_job_fetch(&server, id, answer, &header, error);
	if (status == GNP_OK)
		gnp_notices_of_answer(job->output_format, answer, &header, &job->report);
	gnp_buffer_clear(&header);
	return status;
}

/* Warnings to the terminal, parameters where they are wanted. */
static gnp_status tell(const struct job *job, struct gnp_error *error)
{
	const char *path = gnp_arguments_get(job->arguments, "parameters", NULL);
	struct gnp_buffer json = {0};
	gnp_notices_warn(&job->report, job->arguments);
	gnp_status status = path ? gnp_parameters_write(&job->report, &json, error) : GNP_OK;
	if (status == GNP_OK && path)
		status = gnp_buffer_append(&json, "\n", 1, error);
	if (status == GNP_OK && path)
		status = gnp_file_write(path, json.data, json.size, error);
	gnp_buffer_clear(&json);
	return status;
}

static enum gnp_exit run_job(struct job *job, struct gnp_error *error)
{
	struct gnp_session session;
	struct gnp_buffer answer = {0};
	bool remote = job->url != NULL;
	gnp_status status = gnp_session_open(&session, remote ? GNP_NO_WORKERS : (unsigned)job->workers, error);
	if (status != GNP_OK)
		return gnp_exit_of(status, false);
	status = (job->job ? run_as_job : remote ? run_remote : run_local)(job, &session, &answer, error);
	gnp_session_close(&session);
	if (status == GNP_OK) {
		status = gnp_file_write(job->job && !job->wait ? "-" : job->output, answer.data, answer.size, error);
		remote = false;
	}
	if (status == GNP_OK)
		status = tell(job, error);
	gnp_buffer_clear(&answer);
	return gnp_exit_of(status, remote);
}

static enum gnp_exit run(const struct gnp_command *command, const struct gnp_arguments *arguments, struct gnp_error *error)
{
	struct job job = {.operation = command->operation, .arguments = arguments};
	enum gnp_exit code = GNP_EXIT_USAGE;
	if (parse_job(arguments, &job, error) != GNP_OK)
		goto done;
	code = GNP_EXIT_DATA;
	if (gnp_file_read(job.input, &job.body, error) != GNP_OK)
		goto done;
	if (gnp_file_format_in(job.input_format_name, job.input, &job.body, &job.input_format, error) != GNP_OK)
		goto done;
	code = run_job(&job, error);
done:
	gnp_values_clear(&job.parameters);
	gnp_values_clear(&job.report);
	gnp_buffer_clear(&job.body);
	return code;
}

gnp_status gnp_command_for_operation(const struct gnp_operation *operation,
                                     struct gnp_option options[GNP_OPERATION_OPTIONS_MAX], struct gnp_command *command,
                                     struct gnp_error *error)
{
	if (CLIENT_OPTIONS + operation->parameter_count > GNP_OPERATION_OPTIONS_MAX)
		return gnp_error_set(error, GNP_INTERNAL, "%s: got %zu parameters, room for %zu", operation->name,
		                     operation->parameter_count, GNP_OPERATION_OPTIONS_MAX - CLIENT_OPTIONS);
	memcpy(options, client_options, sizeof client_options);
	for (size_t i = 0; i < operation->parameter_count; i++) {
		const struct gnp_parameter *parameter = &operation->parameters[i];
		options[CLIENT_OPTIONS + i] = (struct gnp_option){
			.name = parameter->name, .value = parameter->type == GNP_PARAMETER_BOOL ? "[=true|false]" : "a value"};
	}
	*command = (struct gnp_command){
		.name = operation->name, .operands = "IN [--local | --url URL [--job [--wait]]] [OPTIONS] -o OUT", .help = operation->help,
		.options = options, .option_count = CLIENT_OPTIONS + operation->parameter_count, .operands_least = 1,
		.operands_most = 1, .run = run, .operation = operation};
	return GNP_OK;
}
