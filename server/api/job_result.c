#include "server/api/job_result.h"

#include <stdio.h>
#include <string.h>

#include "proto/file/formats.h"
#include "proto/tensor/warnings.h"
#include "server/api/server.h"
#include "server/jobs/jobs.h"
#include "server/parse/range.h"

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

/* What the call would have named, the synonym that was asked for among it: records hold a copy, which does not live
 * as long as the reply. */
static const char *type_of(const struct gnpd_job_record *record)
{
	const char *type = gnp_format_media_type_spelled(record->result_type);
	return type ? type : gnp_format_generic_media_type;
}

/* The headers that the call's own answer would have had. */
static gnp_status add_report(struct gnpd_reply *reply, const struct gnpd_job_record *record, struct gnp_error *error)
{
	const char *warnings = record->result_warnings ? record->result_warnings : "";
	const char *parameters = record->result_parameters;
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

gnp_status gnpd_job_result(struct gnpd_request *request, struct gnp_error *error)
{
	struct gnpd_job *job;
	struct gnpd_job_view view;
	gnp_status status = gnpd_request_no_query(request, error);
	if (status == GNP_OK)
		status = gnpd_jobs_find(request->server->jobs, request->principal, request->job_id, &job, error);
	if (status != GNP_OK)
		return status;
	gnpd_job_look(job, &view);
	status = send_result(request, &view, error);
	gnpd_job_release(job);
	return status;
}
