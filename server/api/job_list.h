/* GET /v1/jobs: the caller's jobs, newest first, a page at a time. */
#ifndef GNPD_JOB_LIST_H
#define GNPD_JOB_LIST_H

#include "core/base/status.h"
#include "server/api/request.h"

gnp_status gnpd_job_list(struct gnpd_request *request, struct gnp_error *error);

#endif
