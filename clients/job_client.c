#include "clients/job_client.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "clients/answer.h"

static gnp_status build_url(const char *root, const char *path, struct gnp_buffer *url, struct gnp_error *error)
{
	size_t length = strlen(root);
	while (length && root[length - 1] == '/')
		length--;
	gnp_status status = gnp_buffer_printf(url, error, "%.*s/v1/jobs%s", (int)length, root, path);
	return status == GNP_OK ? gnp_buffer_append(url, "", 1, error) : status;
}

gnp_status gnp_job_call(const struct gnp_job_server *server, const char *method, const char *path, struct gnp_buffer *response,
                        struct gnp_error *error)
{
	struct gnp_buffer url = {0};
	gnp_status status = build_url(server->url, path, &url, error);
	if (status == GNP_OK) {
		struct gnp_http_request request = server->with;
		request.method = method;
		request.url = (const char *)url.data;
		status = gnp_http_post(&request, server->progress, response, error);
	}
	gnp_buffer_clear(&url);
	return status;
}

gnp_status gnp_job_id(const struct gnp_buffer *json, char id[GNP_JOB_ID_MAX], struct gnp_error *error)
{
	struct json_t *job = gnp_answer_parse(json);
	gnp_answer_string(job, "id", id, GNP_JOB_ID_MAX);
	gnp_answer_free(job);
	return *id ? GNP_OK : gnp_error_set(error, GNP_INTERNAL, "job: the server's answer has no \"id\"");
}

/* The share of a job that is done, in thousandths, for the progress. */
static void show(const struct gnp_job_server *server, const struct json_t *job)
{
	double fraction = fmin(fmax(gnp_answer_number(gnp_answer_member(job, "progress"), "fraction"), 0), 1);
	atomic_store(&server->progress->phase, "job");
	atomic_store(&server->progress->task->total, 1000);
	atomic_store(&server->progress->task->done, (size_t)(1000 * fraction));
}

static gnp_status failure_of(const struct json_t *job, const char *id, const char *state, struct gnp_error *error)
{
	char code[48], text[GNP_ERROR_TEXT - 64];
	const struct json_t *cause = gnp_answer_member(job, "error");
	if (strcmp(state, "cancelled") == 0)
		return gnp_error_set(error, GNP_CANCELLED, "job %s: was cancelled", id);
	if (strcmp(state, "failed") != 0)
		return gnp_error_set(error, GNP_NOT_FOUND, "job %s: has %s", id, *state ? state : "no state");
	gnp_answer_string(cause, "code", code, sizeof code);
	gnp_answer_string(cause, "text", text, sizeof text);
	return gnp_error_set(error, gnp_http_status_of(code), "job %s: %s", id, text);
}

gnp_status gnp_job_wait(const struct gnp_job_server *server, const char *id, struct gnp_error *error)
{
	char path[GNP_JOB_ID_MAX + 16], state[16];
	snprintf(path, sizeof path, "/%.*s?wait=2s", GNP_JOB_ID_MAX - 1, id);
	for (;;) {
		struct gnp_buffer json = {0};
		gnp_status status = gnp_job_call(server, "GET", path, &json, error);
		struct json_t *job = gnp_answer_parse(&json);
		gnp_answer_string(job, "state", state, sizeof state);
		bool waits = status == GNP_OK && (strcmp(state, "queued") == 0 || strcmp(state, "running") == 0);
		if (waits)
			show(server, job);
		else if (status == GNP_OK && strcmp(state, "succeeded") != 0)
			status = failure_of(job, id, state, error);
		gnp_answer_free(job);
		gnp_buffer_clear(&json);
		if (!waits)
			return status;
	}
}

gnp_status gnp_job_fetch(const struct gnp_job_server *server, const char *id, struct gnp_buffer *result, struct gnp_buffer *parameters,
                         struct gnp_error *error)
{
	struct gnp_job_server asks = *server;
	char path[GNP_JOB_ID_MAX + 16];
	snprintf(path, sizeof path, "/%.*s/result", GNP_JOB_ID_MAX - 1, id);
	asks.with.parameters = parameters;
	return gnp_job_call(&asks, "GET", path, result, error);
}
