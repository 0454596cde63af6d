/* The record of a job, as it is kept in a file: text, versioned, with a checksum.
 *
 *   gnpd-job 1 SHA256-OF-ALL-BELOW
 *   name value            one a line, values percent-encoded; a member that is empty has no line
 */
#ifndef GNPD_JOB_RECORD_H
#define GNPD_JOB_RECORD_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/sha256.h"
#include "core/base/status.h"
#include "proto/tensor/message.h"

enum gnpd_job_state {
	GNPD_JOB_QUEUED, GNPD_JOB_RUNNING, GNPD_JOB_SUCCEEDED, GNPD_JOB_FAILED, GNPD_JOB_CANCELLED,
	GNPD_JOB_EXPIRED, /* it is over and its result has been let go */
	GNPD_JOB_STATES
};
/* queued, running, succeeded, failed, cancelled, expired. */
const char *gnpd_job_state_name(enum gnpd_job_state state);
/* False when there is no such state. */
bool gnpd_job_state_find(const char *name, enum gnpd_job_state *state);
bool gnpd_job_state_is_final(enum gnpd_job_state state);

enum { GNPD_JOB_ID = 30, GNPD_JOB_KEY_MAX = 128 };

struct gnpd_job_record {
	char id[GNPD_JOB_ID + 1];      /* lower-case hexadecimal digits, the first 14 the microseconds it was made: ids sort by age */
	char operation[33];
	char codec[9];                 /* of struct gnpd_codec */
	char principal[65];
	char key[GNPD_JOB_KEY_MAX + 1];      /* Idempotency-Key */
	char fingerprint[GNP_SHA256_TEXT];   /* of all that makes the request what it is */
	char *query, *content_type, *content_encoding, *accept, *inference_length; /* as they came; owned; NULL: absent */
	uint64_t body_bytes;
	enum gnpd_job_state state;
	bool cancelled;                /* somebody asked for its end, which has not come yet */
	uint64_t attempts;             /* runs that began and whose end is not known */
	bool company;                  /* requests were computed beside the last of them */
	int64_t created, started, finished; /* microseconds since the epoch; 0: not yet */
	gnp_status error;              /* why it failed; GNP_OK else */
	char error_text[GNP_ERROR_TEXT];
	/* The answer, of a job that succeeded: */
	uint64_t result_bytes;
	char *result_warnings, *result_parameters; /* its warnings, joined, and the header X-Gnpd-Parameters; owned; NULL: none */
	char result_type[128], result_inference_length[24], result_timing[256], result_hash[GNP_SHA256_TEXT];
};

void gnpd_job_record_clear(struct gnpd_job_record *record);

gnp_status gnpd_job_record_write(const struct gnpd_job_record *record, struct gnp_buffer *buffer, struct gnp_error *error);

/* Reads what gnpd_job_record_write wrote. GNP_INVALID_ARGUMENT naming the line for anything else: another version, a wrong checksum, an
 * unknown, repeated or missing member, a value out of range. On failure *out is unchanged. Any bytes may be given. */
gnp_status gnpd_job_record_parse(const char *data, size_t size, struct gnpd_job_record *out, struct gnp_error *error);

/* Whether the text has the form of an id. */
bool gnpd_job_id_valid(const char *text);

#endif
