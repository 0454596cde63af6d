/* What the OpenAPI document says of jobs: the paths beneath /v1/jobs that no operation owns, and a job's JSON. */
#ifndef GNPD_OPENAPI_JOBS_H
#define GNPD_OPENAPI_JOBS_H

#include "proto/tensor/writer.h"

void gnpd_openapi_jobs_paths(struct gnp_writer *w);
/* The schema `job`, among the components. */
void gnpd_openapi_jobs_schema(struct gnp_writer *w);

#endif
