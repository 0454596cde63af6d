#include "server/jobs/job_json.h"

#include <inttypes.h>
#include <stdio.h>
#include <time.h>

#include "proto/json/json_text.h"
#include "proto/tensor/warnings.h"

/* RFC 3339 in UTC, or null. */
static gnp_status write_time(const char *name, int64_t time, struct gnp_buffer *buffer, struct gnp_error *error)
{
	char text[32];
	struct tm utc;
	time_t seconds = (time_t)(time / 1000000);
	if (time <= 0 || !gmtime_r(&seconds, &utc) || !strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%S", &utc))
		return gnp_buffer_printf(buffer, error, ",\"%s\":null", name);
	return gnp_buffer_printf(buffer, error, ",\"%s\":\"%s.%06dZ\"", name, text, (int)(time % 1000000));
}

static gnp_status write_progress(const struct gnpd_job_view *view, struct gnp_buffer *buffer, struct gnp_error *error)
{
	const struct gnpd_job_progress *progress = &view->progress;
	enum gnpd_job_state state = view->record.state;
	bool expired = state == GNPD_JOB_EXPIRED && *view->record.result_hash; /* and had succeeded */
	bool succeeded = state == GNPD_JOB_SUCCEEDED || expired, final = gnpd_job_state_is_final(state);
	if (!progress->stage || succeeded || state == GNPD_JOB_QUEUED)
		return gnp_buffer_printf(buffer, error, ",\"progress\":{\"fraction\":%d,\"stage\":\"%s\",\"step\":0,"
		                         "\"steps\":0,\"eta_seconds\":null}", succeeded, final ? "done" : "waiting");
	gnp_status status = gnp_buffer_printf(buffer, error, ",\"progress\":{\"fraction\":%.4f,\"stage\":\"%s\",\"step\":%zu,\"steps\":%zu",
	                                      progress->fraction, progress->stage, progress->step, progress->steps);
	if (status != GNP_OK)
		return status;
	return progress->eta < 0 || final ? gnp_buffer_printf(buffer, error, ",\"eta_seconds\":null}")
	                         : gnp_buffer_printf(buffer, error, ",\"eta_seconds\":%.1f}", progress->eta);
}

static gnp_status write_error(const struct gnpd_job_record *record, struct gnp_buffer *buffer, struct gnp_error *error)
{
	gnp_status status = gnp_buffer_printf(buffer, error, ",\"error\":{\"code\":\"%s\",\"text\":", gnp_status_name(record->error));
	if (status == GNP_OK)
		status = gnp_json_write_string(record->error_text, buffer, error);
	return status == GNP_OK ? gnp_buffer_printf(buffer, error, "}") : status;
}

static gnp_status write_result(const struct gnpd_job_record *record, struct gnp_buffer *buffer, struct gnp_error *error)
{
	return gnp_buffer_printf(buffer, error, ",\"result\":{\"bytes\":%" PRIu64 ",\"content_type\":\"%s\","
	                         "\"href\":\"/v1/jobs/%s/result\",\"sha256\":\"%s\"}", record->result_bytes,
	                         record->result_type, record->id, record->result_hash);
}

static gnp_status write_warning(const char *text, size_t length, bool first, struct gnp_buffer *buffer, struct gnp_error *error)
{
	char copy[GNP_WARNING_TEXT_MAX];
	snprintf(copy, sizeof copy, "%.*s", (int)length, text);
	gnp_status status = first ? GNP_OK : gnp_buffer_append(buffer, ",", 1, error);
	return status == GNP_OK ? gnp_json_write_string(copy, buffer, error) : status;
}

static gnp_status write_warnings(const struct gnpd_job_record *record, struct gnp_buffer *buffer, struct gnp_error *error)
{
	const char *joined = record->result_warnings ? record->result_warnings : "", *text;
	size_t length;
	bool first = true;
	gnp_status status = gnp_buffer_printf(buffer, error, ",\"warnings\":[");
	while (status == GNP_OK && gnp_warnings_next(&joined, &text, &length)) {
		status = write_warning(text, length, first, buffer, error);
		first = false;
	}
	return status == GNP_OK ? gnp_buffer_append(buffer, "]", 1, error) : status;
}

gnp_status gnpd_job_write_json(const struct gnpd_job_view *view, struct gnp_buffer *buffer, struct gnp_error *error)
{
	const struct gnpd_job_record *record = &view->record;
	gnp_status status = gnp_buffer_printf(buffer, error, "{\"id\":\"%s\",\"operation\":\"%s\",\"state\":\"%s\"", record->id,
	                                      record->operation, gnpd_job_state_name(record->state));
	if (status == GNP_OK)
		status = write_time("created", record->created, buffer, error);
	if (status == GNP_OK)
		status = write_time("started", record->started, buffer, error);
	if (status == GNP_OK)
		status = write_time("finished", record->finished, buffer, error);
	if (status == GNP_OK)
		status = write_progress(view, buffer, error);
	if (status == GNP_OK && record->state == GNPD_JOB_FAILED)
		status = write_error(record, buffer, error);
	if (status == GNP_OK && record->state == GNPD_JOB_SUCCEEDED)
		status = write_result(record, buffer, error);
	if (status == GNP_OK && record->state == GNPD_JOB_SUCCEEDED)
		status = write_warnings(record, buffer, error);
	return status == GNP_OK ? gnp_buffer_printf(buffer, error, "}") : status;
}
