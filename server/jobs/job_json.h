/* Writes a job as JSON, as its clients see it. */
#ifndef GNPD_JOB_JSON_H
#define GNPD_JOB_JSON_H

#include "core/base/status.h"
#include "proto/tensor/message.h"
#include "server/jobs/job_view.h"

/* Appends {"id","operation","state",...} in one line. */
gnp_status gnpd_job_write_json(const struct gnpd_job_view *view, struct gnp_buffer *buffer, struct gnp_error *error);

#endif
