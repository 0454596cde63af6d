#include "server/api/job_list.h"

#include <stdlib.h>
#include <string.h>

#include "proto/operation/operations.h"
#include "server/api/server.h"
#include "server/jobs/job_json.h"
#include "server/jobs/jobs.h"

enum { LIST_DEFAULT = 100, LIST_MOST = 1000 };

static const char *text_of(const struct gnp_values *values, const char *name)
{
	const struct gnp_value *value = gnp_values_find(values, name);
	return value ? value->string : NULL;
}

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
		                     "state: got \"%.60s\", known: queued, running, succeeded, failed, cancelled, expired",
		                     name);
	if (name)
		filter->state = (int)state;
	if (filter->operation && !gnp_operation_find(filter->operation))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "operation: there is no \"%.60s\"", filter->operation);
	if (filter->after && !gnpd_job_id_valid(filter->after))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "after: got \"%.60s\", need the id of a job", filter->after);
	return GNP_OK;
}

/* What asks for the jobs that come after the last one, with what was asked for now: names out of tables and a
 * number, which need no escapes. */
static gnp_status write_next(const struct gnp_values *values, const char *last, struct gnp_buffer *body,
                             struct gnp_error *error)
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

static gnp_status write_list(struct gnpd_request *request, const struct gnp_values *values, struct gnpd_job **found,
                             size_t count, bool more, struct gnp_error *error)
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

gnp_status gnpd_job_list(struct gnpd_request *request, struct gnp_error *error)
{
	static const char *const known[] = {"state", "operation", "limit", "after", NULL};
	struct gnp_values values = {0};
	gnp_status status = gnpd_request_query(request, known, &values, error);
	if (status == GNP_OK)
		status = list(request, &values, error);
	gnp_values_clear(&values);
	return status;
}
