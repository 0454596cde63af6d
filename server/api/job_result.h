/* GET /v1/jobs/{id}/result: the body of a job's answer, or a part of it, with the headers the call's own answer
 * would have had. */
#ifndef GNPD_JOB_RESULT_H
#define GNPD_JOB_RESULT_H

#include "core/base/status.h"
#include "server/api/request.h"

gnp_status gnpd_job_result(struct gnpd_request *request, struct gnp_error *error);

#endif
