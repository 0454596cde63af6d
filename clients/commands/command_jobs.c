/* gnp jobs: lists, shows, cancels and fetches the jobs of a server. */
#include <stdio.h>
#include <string.h>

#include "clients/answer.h"
#include "clients/command.h"
#include "clients/file_io.h"
#include "clients/job_client.h"
#include "clients/notices.h"
#include "clients/server_options.h"
#include "clients/session.h"
#include "proto/file/sniff.h"

static const struct gnp_option options[] = {
	{"url", 0, "URL", "the server, for example http://127.0.0.1:8080"},
	GNP_SERVER_OPTIONS,
	{"output", 'o', "FILE", "fetch: where to write (default: standard output)"},
	{"wait", 0, NULL, "show, fetch: wait for the end of the job first"},
	{"state", 0, "NAME", "list: only those queued, running, succeeded, failed, cancelled or expired"},
	{"timeout", 0, "SECONDS", "how long the server may take for an answer (default: no limit)"},
};

static void print_job(const struct json_t *job)
{
	char id[GNP_JOB_ID_MAX], operation[33], state[16], created[40];
	gnp_answer_string(job, "id", id, sizeof id);
	gnp_answer_string(job, "operation", operation, sizeof operation);
	gnp_answer_string(job, "state", state, sizeof state);
	gnp_answer_string(job, "created", created, sizeof created);
	printf("%s  %-10s %-10s %s\n", id, state, operation, created);
}

static void print_list(const struct gnp_buffer *json)
{
	struct json_t *answer = gnp_answer_parse(json);
	const struct json_t *jobs = gnp_answer_member(answer, "jobs"), *job;
	for (size_t i = 0; (job = gnp_answer_at(jobs, i)); i++)
		print_job(job);
	gnp_answer_free(answer);
}

static gnp_status list(const struct gnp_job_server *server, const struct gnp_arguments *arguments, struct gnp_error *error)
{
	const char *state = gnp_arguments_get(arguments, "state", NULL);
	struct gnp_buffer path = {0}, json = {0};
	gnp_status status = gnp_buffer_printf(&path, error, "?limit=1000%s", state ? "&state=" : "");
	if (status == GNP_OK && state)
		status = gnp_http_escape(state, &path, error);
	if (status == GNP_OK)
		status = gnp_buffer_append(&path, "", 1, error);
	if (status == GNP_OK)
		status = gnp_job_call(server, "GET", (const char *)path.data, &json, error);
	if (status == GNP_OK)
		print_list(&json);
	gnp_buffer_clear(&path);
	gnp_buffer_clear(&json);
	return status;
}

static gnp_status show(const struct gnp_job_server *server, const char *id, struct gnp_error *error)
{
	char path[GNP_JOB_ID_MAX + 2];
	struct gnp_buffer json = {0};
	snprintf(path, sizeof path, "/%.*s", GNP_JOB_ID_MAX - 1, id);
	gnp_status status = gnp_job_call(server, "GET", path, &json, error);
	if (status == GNP_OK && json.size)
		fwrite(json.data, 1, json.size, stdout);
	gnp_buffer_clear(&json);
	return status;
}

static gnp_status cancel(const struct gnp_job_server *server, const char *id, struct gnp_error *error)
{
	char path[GNP_JOB_ID_MAX + 2], state[16];
	struct gnp_buffer json = {0};
	snprintf(path, sizeof path, "/%.*s", GNP_JOB_ID_MAX - 1, id);
	gnp_status status = gnp_job_call(server, "DELETE", path, &json, error);
	struct json_t *job = gnp_answer_parse(&json);
	gnp_answer_string(job, "state", state, sizeof state);
	gnp_answer_free(job);
	if (status == GNP_OK)
		puts(!*state ? "removed" : strcmp(state, "cancelled") == 0 ? "cancelled" : "being cancelled");
	gnp_buffer_clear(&json);
	return status;
}

static gnp_status fetch(const struct gnp_job_server *server, const char *id, const struct gnp_arguments *arguments, struct gnp_error *error)
{
	struct gnp_buffer result = {0}, header = {0};
	struct gnp_values parameters = {0};
	const struct gnp_format *format = NULL;
	gnp_status status = gnp_job_fetch(server, id, &result, &header, error);
	if (status == GNP_OK)
		status = gnp_file_write(gnp_arguments_get(arguments, "output", "-"), result.data, result.size, error);
	if (status == GNP_OK) {
		gnp_format_by_magic(result.data, result.size, &format);
		gnp_notices_of_answer(format, &result, &header, &parameters);
		gnp_notices_warn(&parameters, arguments);
	}
	gnp_values_clear(&parameters);
	gnp_buffer_clear(&header);
	gnp_buffer_clear(&result);
	return status;
}

static gnp_status act(const struct gnp_job_server *server, const struct gnp_arguments *arguments, struct gnp_error *error)
{
	const char *verb = arguments->operand_count ? arguments->operands[0] : "list";
	const char *id = arguments->operand_count > 1 ? arguments->operands[1] : NULL;
	gnp_status status = GNP_OK;
	if (strcmp(verb, "list") == 0)
		return list(server, arguments, error);
	if (gnp_arguments_has(arguments, "wait") && strcmp(verb, "cancel") != 0)
		status = gnp_job_wait(server, id, error);
	if (status != GNP_OK)
		return status;
	if (strcmp(verb, "show") == 0)
		return show(server, id, error);
	if (strcmp(verb, "cancel") == 0)
		return cancel(server, id, error);
	return fetch(server, id, arguments, error);
}

/* Only characters of ids, so that none becomes a path. */
static gnp_status check(const struct gnp_arguments *arguments, struct gnp_error *error)
{
	static const char *const verbs[] = {"show", "cancel", "fetch"};
	const char *verb = arguments->operand_count ? arguments->operands[0] : "list";
	if (!gnp_arguments_get(arguments, "url", NULL))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "--url: is missing, jobs are those of a server");
	if (strcmp(verb, "list") == 0)
		return arguments->operand_count < 2 ? GNP_OK : gnp_error_set(error, GNP_INVALID_ARGUMENT, "list: takes no id");
	bool known = false;
	for (size_t i = 0; i < sizeof verbs / sizeof verbs[0]; i++)
		known = known || strcmp(verbs[i], verb) == 0;
	if (!known)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "got \"%.40s\", need list, show, cancel or fetch", verb);
	if (arguments->operand_count < 2)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: the id of a job is missing", verb);
	const char *id = arguments->operands[1];
	if (!*id || strlen(id) >= GNP_JOB_ID_MAX || id[strspn(id, "0123456789abcdefghijklmnopqrstuvwxyz-")])
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: got \"%.70s\", need the id of a job", verb, id);
	return GNP_OK;
}

static enum gnp_exit run(const struct gnp_command *command, const struct gnp_arguments *arguments, struct gnp_error *error)
{
	struct gnp_session session;
	struct gnp_job_server server = {.url = gnp_arguments_get(arguments, "url", NULL), .progress = &session.progress};
	(void)command;
	if (check(arguments, error) != GNP_OK || gnp_server_options_take(arguments, true, &server.with, error) != GNP_OK ||
	    gnp_arguments_number(arguments, "timeout", 0.001, 1e6, &server.with.timeout, error) != GNP_OK)
		return GNP_EXIT_USAGE;
	gnp_status status = gnp_session_open(&session, GNP_NO_WORKERS, error);
	if (status != GNP_OK)
		return gnp_exit_of(status, false);
	status = act(&server, arguments, error);
	gnp_session_close(&session);
	return gnp_exit_of(status, true);
}

const struct gnp_command gnp_command_jobs = {
	.name = "jobs", .operands = "--url URL [list | show ID | cancel ID | fetch ID -o FILE]", .help = "the jobs of a server, newest first, and their results",
	.details = "`gnp OPERATION IN --url URL --job` makes one. cancel stops a job that waits or runs and removes one that is over.",
	.options = options, .option_count = sizeof options / sizeof options[0], .operands_least = 0, .operands_most = 2, .run = run};
