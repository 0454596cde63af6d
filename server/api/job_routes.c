#include "server/api/job_routes.h"

#include <math.h>
#include <string.h>

#include "server/api/server.h"
#include "server/config/config.h"
#include "server/jobs/job_json.h"
#include "server/jobs/jobs.h"
#include "server/parse/duration.h"

/* ---- Answers ---- */

static gnp_status reply_view(struct gnpd_request *request, const struct gnpd_job_view *view, int code, struct gnp_error *error)
{
	request->reply.content_type = "application/json";
	gnp_status status = gnpd_job_write_json(view, &request->reply.body, error);
	if (status == GNP_OK)
		status = gnp_buffer_append(&request->reply.body, "\n", 1, error);
	if (status == GNP_OK)
		request->reply.code = code;
	if (!gnpd_job_state_is_final(view->record.state))
		gnpd_reply_header(request, "Retry-After", "%.0f", request->server->engine.config->retry_after_seconds);
	gnpd_reply_header(request, "Cache-Control", "no-store");
	return status;
}

static gnp_status reply_job(struct gnpd_request *request, struct gnpd_job *job, int code, struct gnp_error *error)
{
	struct gnpd_job_view view;
	gnpd_job_look(job, &view);
	return reply_view(request, &view, code, error);
}

static gnp_status find(struct gnpd_request *request, struct gnpd_job **job, struct gnp_error *error)
{
	return gnpd_jobs_find(request->server->jobs, request->principal, request->job_id, job, error);
}

/* ---- POST /v1/jobs/{operation} ---- */

static gnp_status check_key(const char *key, struct gnp_error *error)
{
	size_t length = key ? strlen(key) : 1;
	for (size_t i = 0; key && i < length; i++)
		if (key[i] < 0x20 || key[i] > 0x7e)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "Idempotency-Key: character %zu is not printable ASCII", i + 1);
	if (length < 1 || length > GNPD_JOB_KEY_MAX)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "Idempotency-Key: got %zu characters, need 1..%d", length, GNPD_JOB_KEY_MAX);
	return GNP_OK;
}

gnp_status gnpd_job_routes_post(struct gnpd_request *request, struct gnp_error *error)
{
	struct gnpd_job *job = NULL;
	bool existing = false;
	gnp_status status = check_key(request->idempotency_key, error);
	if (status == GNP_OK)
		status = gnpd_work_check(&request->work, error);
	gnp_task_stage(&request->work.task, GNP_STAGE_DONE, 0);
	if (status == GNP_OK)
		status = gnpd_jobs_submit(request->server->jobs, &request->work, request->principal, request->idempotency_key,
		                          &job, &existing, error);
	if (status != GNP_OK)
		return status;
	struct gnpd_job_view view;
	gnpd_job_look(job, &view);
	gnpd_reply_header(request, "Location", "/v1/jobs/%s", view.record.id);
	status = reply_view(request, &view, existing ? 200 : 202, error);
	gnpd_job_release(job);
	return status;
}

/* ---- GET /v1/jobs/{id} ---- */

/* Seconds to wait: no more than the configuration allows. */
static gnp_status read_wait(struct gnpd_request *request, double *seconds, struct gnp_error *error)
{
	static const char *const known[] = {"wait", NULL};
	struct gnp_values values = {0};
	*seconds = 0;
	gnp_status status = gnpd_request_query(request, known, &values, error);
	const struct gnp_value *wait = status == GNP_OK ? gnp_values_find(&values, "wait") : NULL;
	if (wait)
		status = gnpd_duration_parse("wait", wait->string, seconds, error);
	gnp_values_clear(&values);
	*seconds = fmin(*seconds, request->server->engine.config->jobs_wait_seconds);
	return status;
}

gnp_status gnpd_job_routes_get(struct gnpd_request *request, struct gnp_error *error)
{
	struct gnpd_job *job;
	struct gnpd_job_view view;
	double seconds;
	gnp_status status = read_wait(request, &seconds, error);
	if (status == GNP_OK)
		status = find(request, &job, error);
	if (status != GNP_OK)
		return status;
	gnpd_job_look(job, &view);
	if (seconds <= 0 || gnpd_job_state_is_final(view.record.state) || atomic_load(&request->server->draining)) {
		status = reply_view(request, &view, 200, error);
		gnpd_job_release(job);
		return status;
	}
	status = gnpd_watch_init(request->server->watchers, &request->watch, GNPD_WATCH_POLL, job, error);
	if (status != GNP_OK)
		gnpd_job_release(job);
	request->watch.until = gnp_clock() + seconds;
	return status;
}

gnp_status gnpd_job_routes_polled(struct gnpd_request *request, struct gnp_error *error)
{
	return reply_job(request, request->watch.job, 200, error);
}

/* ---- GET /v1/jobs/{id}/events ---- */

/* A browser asks again when a stream ends, until it is told that nothing follows what it has. */
static bool has_seen_end(const struct gnpd_request *request, struct gnpd_job *job)
{
	struct gnpd_job_view view;
	char id[GNPD_EVENT_ID];
	gnpd_job_look(job, &view);
	gnpd_watch_event_id(&view, id);
	return request->last_event_id && gnpd_job_state_is_final(view.record.state) && strcmp(request->last_event_id, id) == 0;
}

gnp_status gnpd_job_routes_events(struct gnpd_request *request, struct gnp_error *error)
{
	struct gnpd_job *job;
	gnp_status status = gnpd_request_no_query(request, error);
	if (status == GNP_OK)
		status = find(request, &job, error);
	if (status != GNP_OK)
		return status;
	if (has_seen_end(request, job)) {
		gnpd_job_release(job);
		request->reply.code = 204;
		return GNP_OK;
	}
	status = gnpd_watch_init(request->server->watchers, &request->watch, GNPD_WATCH_STREAM, job, error);
	if (status != GNP_OK) {
		gnpd_job_release(job);
		return status;
	}
	request->reply.code = 200;
	request->reply.content_type = "text/event-stream";
	request->reply.stream = true;
	gnpd_reply_header(request, "X-Accel-Buffering", "no"); /* nginx passes events on as they come */
	gnpd_reply_header(request, "Cache-Control", "no-store");
	return GNP_OK;
}

/* ---- DELETE /v1/jobs/{id} ---- */

gnp_status gnpd_job_routes_remove(struct gnpd_request *request, struct gnp_error *error)
{
	struct gnpd_job *job;
	enum gnpd_job_deletion what;
	gnp_status status = gnpd_request_no_query(request, error);
	if (status == GNP_OK)
		status = find(request, &job, error);
	if (status != GNP_OK)
		return status;
	status = gnpd_jobs_delete(request->server->jobs, job, &what, error);
	if (status == GNP_OK && what == GNPD_JOB_WAS_REMOVED)
		request->reply.code = 204;
	else if (status == GNP_OK)
		status = reply_job(request, job, what == GNPD_JOB_WAS_CANCELLED ? 200 : 202, error);
	gnpd_job_release(job);
	return status;
}
