/* Waits for the jobs of a gnpd server and fetches what they answer. */
#ifndef GNP_CLIENTS_JOB_CLIENT_H
#define GNP_CLIENTS_JOB_CLIENT_H

#include "clients/http_client.h"

enum { GNP_JOB_ID_MAX = 64 };

struct gnp_job_server {
	const char *url;  /* as --url gives it: the root, slashes at its end allowed */
	struct gnp_http_request with; /* what every exchange comes with: its timeout; the rest is set by each */
	struct gnp_progress *progress;
};

/* Any exchange with METHOD URL/v1/jobs + path; response (empty on entry) receives the body. */
gnp_status gnp_job_call(const struct gnp_job_server *server, const char *method, const char *path, struct gnp_buffer *response,
                        struct gnp_error *error);

/* The id in a job's JSON. GNP_INTERNAL when there is none: whoever answered is no gnpd. */
gnp_status gnp_job_id(const struct gnp_buffer *json, char id[GNP_JOB_ID_MAX], struct gnp_error *error);

/* Returns when the job has succeeded. The progress shows its own. Else what became of it: its error, GNP_CANCELLED, GNP_NOT_FOUND. A
 * cancelled task ends the waiting and leaves the job alone. */
gnp_status gnp_job_wait(const struct gnp_job_server *server, const char *id, struct gnp_error *error);

/* parameters (empty on entry): receives what the result's header says of it, as text. */
gnp_status gnp_job_fetch(const struct gnp_job_server *server, const char *id, struct gnp_buffer *result, struct gnp_buffer *parameters,
                         struct gnp_error *error);

#endif
