/* /v1/jobs: the verbs of jobs. Submitting, which checks the body, and deleting wait for the disk and are done by the disk queue; the rest is
 * answered at once. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/names.h"
#include "proto/tensor/warnings.h"
#include "server/api/routes.h"
#include "server/api/server.h"
#include "server/config/config.h"
#include "server/jobs/job_json.h"
#include "server/jobs/job_watch.h"
#include "server/jobs/jobs.h"
#include "server/parse/duration.h"
#include "server/parse/range.h"

enum { LIST_DEFAULT = 100, LIST_MOST = 1000 };

/* ---- Queries ---- */

static gnp_status unknown_parameter(const char *name, const char *const *known, struct gnp_error *error)
{
	struct gnp_names list;
	gnp_names_begin(&list, name, strlen(name));
	for (size_t k = 0; known[k]; k++)
		gnp_names_add(&list, known[k]);
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "unknown parameter \"%.60s\", known: %s", name, gnp_names_end(&list));
}

gnp_status gnpd_query_read(struct gnpd_request *request, const char *const *known, struct gnp_values *values, struct gnp_error *error)
{
	gnp_status status = gnpd_query_parse(request->target.query, values, error);
	for (size_t i = 0; i < values->count && status == GNP_OK; i++) {
		const char *name = values->items[i].name;
		size_t k = 0;
		while (known[k] && strcmp(name, known[k]) != 0)
			k++;
		if (!known[k])
			status = unknown_parameter(name, known, error);
	}
	return status;
}

static gnp_status take_no_query(struct gnpd_request *request, struct gnp_error *error)
{
	static const char *const none[] = {NULL};
	struct gnp_values values = {0};
	gnp_status status = gnpd_query_read(request, none, &values, error);
	gnp_values_clear(&values);
	return status;
}

static const char *text_of(const struct gnp_values *values, const char *name)
{
	const struct gnp_value *value = gnp_values_find(values, name);
	return value ? value->string : NULL;
}

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

gnp_status gnpd_jobs_post(struct gnpd_request *request, struct gnp_error *error)
{
	struct gnpd_job *job = NULL;
	bool existing = false;
	gnp_status status = check_key(request->idempotency_key, error);
	if (status == GNP_OK)
		status = gnpd_work_check(&request->work, error);
	gnp_task_stage(&request->work.task, GNP_STAGE_DONE, 0);
	if (status == GNP_OK)
		status = gnpd_jobs_submit(request->server->jobs, &request->work, request->principal, request->idempotency_key, &job, &existing, error);
	if (status != GNP_OK)
		return status;
	struct gnpd_job_view view;
	gnpd_job_look(job, &view);
	gnpd_reply_header(request, "Location", "/v1/jobs/%s", view.record.id);
	status = reply_view(request, &view, existing ? 200 : 202, error);
	gnpd_job_release(job);
	return status;
}

/* ---- GET /v1/jobs ---- */

static gnp_status read_limit(const char *text, size_t *limit, struct gnp_error *error)
{
	char *end;
	*limit = LIST_DEFAULT;
	if (!text)
		return GNP_OK;
	unsigned long value = strtoul(text, &end, 10);
	if (*text < '0' || *text > '9' || *end || value < 1 || value > LIST_MOST)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "limit: got \"%.60s\", need 1..%d", text, LIST_MOST);
	*limit = value;
	return GNP_OK;
}

static gnp_status read_filter(const struct gnp_values *values, struct gnpd_job_filter *filter, struct gnp_error *error)
{
	enum gnpd_job_state state;
	const char *name = text_of(values, "state");
	filter->operation = text_of(values, "operation");
	filter->after = text_of(values, "after");
	filter->state = -1;
	if (name && !gnpd_job_state_find(name, &state))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "state: got \"%.60s\", known: queued, running, succeeded, failed, cancelled, expired", name);
	if (name)
		filter->state = (int)state;
	if (filter->operation && !gnp_operation_find(filter->operation))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "operation: there is no \"%.60s\"", filter->operation);
	if (filter->after && !gnpd_job_id_valid(filter->after))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "after: got \"%.60s\", need the id of a job", filter->after);
	return GNP_OK;
}

/* What asks for the jobs that come after the last one, with what was asked for now: names out of tables and a number, which need no
 * escapes. */
static gnp_status write_next(const struct gnp_values *values, const char *last, struct gnp_buffer *body, struct gnp_error *error)
{
	static const char *const kept[] = {"state", "operation", "limit"};
	gnp_status status = gnp_buffer_printf(body, error, "/v1/jobs?");
	for (size_t i = 0; i < sizeof kept / sizeof kept[0] && status == GNP_OK; i++) {
		const char *text = text_of(values, kept[i]);
		if (text)
			status = gnp_buffer_printf(body, error, "%s=%s&", kept[i], text);
	}
	return status == GNP_OK ? gnp_buffer_printf(body, error, "after=%s", last) : status;
}

static gnp_status write_list(struct gnpd_request *request, const struct gnp_values *values, struct gnpd_job **found, size_t count,
                             bool more, struct gnp_error *error)
{
	struct gnp_buffer *body = &request->reply.body;
	struct gnpd_job_view view = {0};
	gnp_status status = gnp_buffer_printf(body, error, "{\"jobs\":[");
	for (size_t i = 0; i < count && status == GNP_OK; i++) {
		gnpd_job_look(found[i], &view);
		if (i)
			status = gnp_buffer_append(body, ",", 1, error);
		if (status == GNP_OK)
			status = gnpd_job_write_json(&view, body, error);
	}
	if (status != GNP_OK || !more)
		return status == GNP_OK ? gnp_buffer_printf(body, error, "],\"more\":false,\"next\":null}\n") : status;
	status = gnp_buffer_printf(body, error, "],\"more\":true,\"next\":\"");
	if (status == GNP_OK)
		status = write_next(values, view.record.id, body, error);
	return status == GNP_OK ? gnp_buffer_printf(body, error, "\"}\n") : status;
}

static gnp_status list(struct gnpd_request *request, const struct gnp_values *values, struct gnp_error *error)
{
	struct gnpd_job_filter filter = {.principal = request->principal};
	size_t limit;
	bool more;
	gnp_status status = read_filter(values, &filter, error);
	if (status == GNP_OK)
		status = read_limit(text_of(values, "limit"), &limit, error);
	if (status != GNP_OK)
		return status;
	struct gnpd_job **found = calloc(limit, sizeof *found);
	if (!found)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "jobs: no memory for a list of %zu", limit);
	size_t count = gnpd_jobs_list(request->server->jobs, &filter, found, limit, &more);
	status = write_list(request, values, found, count, more, error);
	for (size_t i = 0; i < count; i++)
		gnpd_job_release(found[i]);
	free(found);
	if (status == GNP_OK)
		request->reply.code = 200;
	request->reply.content_type = "application/json";
	gnpd_reply_header(request, "Cache-Control", "no-store");
	return status;
}

gnp_status gnpd_jobs_list_all(struct gnpd_request *request, struct gnp_error *error)
{
	static const char *const known[] = {"state", "operation", "limit", "after", NULL};
	struct gnp_values values = {0};
	gnp_status status = gnpd_query_read(request, known, &values, error);
	if (status == GNP_OK)
		status = list(request, &values, error);
	gnp_values_clear(&values);
	return status;
}

/* ---- GET /v1/jobs/{id} ---- */

/* Seconds to wait: no more than the configuration allows. */
static gnp_status read_wait(struct gnpd_request *request, double *seconds, struct gnp_error *error)
{
	static const char *const known[] = {"wait", NULL};
	struct gnp_values values = {0};
	*seconds = 0;
	gnp_status status = gnpd_query_read(request, known, &values, error);
	const char *text = status == GNP_OK ? text_of(&values, "wait") : NULL;
	if (text)
		status = gnpd_duration_parse("wait", text, seconds, error);
	gnp_values_clear(&values);
	*seconds = fmin(*seconds, request->server->engine.config->jobs_wait_seconds);
	return status;
}

gnp_status gnpd_jobs_get(struct gnpd_request *request, struct gnp_error *error)
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

gnp_status gnpd_jobs_polled(struct gnpd_request *request, struct gnp_error *error)
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

gnp_status gnpd_jobs_events(struct gnpd_request *request, struct gnp_error *error)
{
	struct gnpd_job *job;
	gnp_status status = take_no_query(request, error);
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

/* ---- GET /v1/jobs/{id}/result ---- */

/* The part of the file that is asked for, or that nothing is to be sent. */
static gnp_status choose_part(struct gnpd_request *request, const char *tag, size_t size, struct gnp_error *error)
{
	struct gnpd_reply *reply = &request->reply;
	const char *range = request->range;
	size_t first = 0, count = size;
	if (request->if_range && strcmp(request->if_range, tag) != 0)
		range = NULL;
	switch (gnpd_range_parse(range, size, &first, &count)) {
	case GNPD_RANGE_OUTSIDE:
		return gnp_error_set(error, GNP_RANGE, "range: got \"%.60s\", the result has %zu bytes", range, size);
	case GNPD_RANGE_PART:
		reply->code = 206;
		gnpd_reply_add(reply, "Content-Range", "bytes %zu-%zu/%zu", first, first + count - 1, size);
		break;
	case GNPD_RANGE_WHOLE: reply->code = 200; break;
	}
	reply->file_offset = first;
	reply->file_size = count;
	return GNP_OK;
}

/* What the call would have named, the synonym that was asked for among it: records hold a copy, which does not live as long as the
 * reply. */
static const char *type_of(const struct gnpd_job_record *record)
{
	const char *type = gnp_format_media_type_spelled(record->result_type);
	return type ? type : gnp_format_media_type(GNP_FORMAT_COUNT);
}

/* The headers that the call's own answer would have had. */
static gnp_status add_report(struct gnpd_reply *reply, const struct gnpd_job_record *record, struct gnp_error *error)
{
	const char *warnings = record->result_warnings ? record->result_warnings : "", *parameters = record->result_parameters;
	gnpd_reply_add(reply, "X-Gnpd-Warnings", "%zu", gnp_warnings_joined_count(warnings));
	return parameters ? gnp_buffer_append(&reply->parameters, parameters, strlen(parameters) + 1, error) : GNP_OK;
}

static gnp_status send_result(struct gnpd_request *request, const struct gnpd_job_view *view, struct gnp_error *error)
{
	struct gnpd_reply *reply = &request->reply;
	const struct gnpd_job_record *record = &view->record;
	char tag[GNP_SHA256_TEXT + 2];
	int fd;
	gnp_status status = gnpd_jobs_open_result(request->server->jobs, view, &fd, error);
	if (status != GNP_OK)
		return status;
	snprintf(tag, sizeof tag, "\"%s\"", record->result_hash);
	gnpd_reply_add(reply, "ETag", "%s", tag);
	gnpd_reply_add(reply, "Accept-Ranges", "bytes");
	reply->content_type = type_of(record);
	reply->has_file = true;
	reply->file = fd;
	if (request->if_none_match && (strstr(request->if_none_match, tag) || strcmp(request->if_none_match, "*") == 0)) {
		gnpd_reply_clear(reply);
		gnpd_reply_add(reply, "ETag", "%s", tag);
		reply->code = 304;
		return GNP_OK;
	}
	if (*record->result_inference_length)
		gnpd_reply_add(reply, "Inference-Header-Content-Length", "%s", record->result_inference_length);
	if (*record->result_timing)
		gnpd_reply_add(reply, "Server-Timing", "%s", record->result_timing);
	status = add_report(reply, record, error);
	if (status == GNP_OK)
		status = choose_part(request, tag, record->result_bytes, error);
	if (status == GNP_RANGE) {
		gnpd_reply_error(request, error);
		gnpd_reply_add(reply, "Content-Range", "bytes */%zu", (size_t)record->result_bytes);
		return GNP_OK;
	}
	return status;
}

gnp_status gnpd_jobs_result(struct gnpd_request *request, struct gnp_error *error)
{
	struct gnpd_job *job;
	struct gnpd_job_view view;
	gnp_status status = take_no_query(request, error);
	if (status == GNP_OK)
		status = find(request, &job, error);
	if (status != GNP_OK)
		return status;
	gnpd_job_look(job, &view);
	status = send_result(request, &view, error);
	gnpd_job_release(job);
	return status;
}

/* ---- DELETE /v1/jobs/{id} ---- */

gnp_status gnpd_jobs_remove(struct gnpd_request *request, struct gnp_error *error)
{
	struct gnpd_job *job;
	enum gnpd_job_deletion what;
	gnp_status status = take_no_query(request, error);
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
