/* /v1/jobs: the verbs of one job. Submitting, which checks the body, and deleting wait for the disk and are done by
 * the disk queue; the rest is answered at once. */
#ifndef GNPD_JOB_ROUTES_H
#define GNPD_JOB_ROUTES_H

#include "core/base/status.h"
#include "server/api/request.h"

/* POST /v1/jobs/{operation} */
gnp_status gnpd_job_routes_post(struct gnpd_request *request, struct gnp_error *error);

/* GET /v1/jobs/{id}: may leave the request without a reply but with a watch: then it waits, and
 * gnpd_job_routes_polled fills the reply. */
gnp_status gnpd_job_routes_get(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_job_routes_polled(struct gnpd_request *request, struct gnp_error *error);

/* GET /v1/jobs/{id}/events */
gnp_status gnpd_job_routes_events(struct gnpd_request *request, struct gnp_error *error);

/* DELETE /v1/jobs/{id} */
gnp_status gnpd_job_routes_remove(struct gnpd_request *request, struct gnp_error *error);

#endif
