#include "job_client.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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
	gnp_http_json_string(json, "id", id, GNP_JOB_ID_MAX);
	return *id ? GNP_OK : gnp_error_set(error, GNP_INTERNAL, "job: the server's answer has no \"id\"");
}

/* The share of a job that is done, in thousandths, for the progress. */
static void show(const struct gnp_job_server *server, const struct gnp_buffer *json)
{
	static const char key[] = "\"fraction\":";
	const char *at = json->size ? memmem(json->data, json->size, key, sizeof key - 1) : NULL;
	double fraction = at ? strtod(at + sizeof key - 1, NULL) : 0; /* a comma or a brace ends it */
	atomic_store(&server->progress->phase, "job");
	atomic_store(&server->progress->task->total, 1000);
	atomic_store(&server->progress->task->done, (size_t)(1000 * fraction));
}

static gnp_status failure_of(const struct gnp_buffer *json, const char *id, const char *state, struct gnp_error *error)
{
	char code[48], text[256];
	if (strcmp(state, "cancelled") == 0)
		return gnp_error_set(error, GNP_CANCELLED, "job %s: was cancelled", id);
	if (strcmp(state, "failed") != 0)
		return gnp_error_set(error, GNP_NOT_FOUND, "job %s: has %s", id, *state ? state : "no state");
	gnp_http_json_string(json, "code", code, sizeof code);
	gnp_http_json_string(json, "text", text, sizeof text);
	return gnp_error_set(error, gnp_http_status_of(code), "job %s: %s", id, text);
}

gnp_status gnp_job_wait(const struct gnp_job_server *server, const char *id, struct gnp_error *error)
{
	char path[GNP_JOB_ID_MAX + 16], state[16];
	snprintf(path, sizeof path, "/%.*s?wait=2s", GNP_JOB_ID_MAX - 1, id);
	for (;;) {
		struct gnp_buffer json = {0};
		gnp_status status = gnp_job_call(server, "GET", path, &json, error);
		gnp_http_json_string(&json, "state", state, sizeof state);
		bool waits = status == GNP_OK && (strcmp(state, "queued") == 0 || strcmp(state, "running") == 0);
		if (waits)
			show(server, &json);
		else if (status == GNP_OK && strcmp(state, "succeeded") != 0)
			status = failure_of(&json, id, state, error);
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
