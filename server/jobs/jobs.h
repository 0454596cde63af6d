/* The jobs: work that outlives the request that asked for it. A job that was acknowledged is on disk, and is run until
 * its end is on disk too, by this process or, when the store is a folder of its own (jobs-dir), by a later one. */
#ifndef GNPD_JOBS_H
#define GNPD_JOBS_H

#include <stdbool.h>

#include "server/jobs/job_view.h"
#include "server/work/work.h"

struct gnpd_engine;
struct gnpd_job;
struct gnpd_jobs;
struct gnpd_watchers;

/* Opens the store and takes up what it holds; runs nothing yet. The engine must be complete; watchers are told of
 * every change and may be NULL. */
gnp_status gnpd_jobs_create(const struct gnpd_engine *engine, struct gnpd_watchers *watchers, struct gnpd_jobs **out,
                            struct gnp_error *error);
/* Begins to run them. */
gnp_status gnpd_jobs_start(struct gnpd_jobs *jobs, struct gnp_error *error);
/* No job begins any more, those that run are stopped at once and left for the next process, new ones are refused. */
void gnpd_jobs_park(struct gnpd_jobs *jobs);
/* A request is about to be computed: should the process die, a suspected job that runs alone is not to blame as if nothing else had run. */
void gnpd_jobs_keep_company(struct gnpd_jobs *jobs);
/* Parks and waits for the end of what runs. No reference may be held any more. NULL is allowed. */
void gnpd_jobs_free(struct gnpd_jobs *jobs);

/* Keeps the call of a checked work as a job: when this returns GNP_OK it is on disk. key: Idempotency-Key, or NULL: where the principal
 * has a job with that key, *job is that one and *existing true if it was asked for the same, else GNP_CONFLICT; GNP_IN_PROGRESS while
 * another request with the key is being taken. Full: GNP_NO_SPACE, GNP_OVERLOADED, GNP_STORAGE or, where no run of it could have the
 * memory, GNP_TOO_LARGE naming the limit, and nothing is kept. *job is a reference. */
gnp_status gnpd_jobs_submit(struct gnpd_jobs *jobs, const struct gnpd_work *work, const char *principal, const char *key,
                            struct gnpd_job **job, bool *existing, struct gnp_error *error);

/* A reference to a principal's job. Somebody else's answers GNP_NOT_FOUND, like one that does not exist. */
gnp_status gnpd_jobs_find(struct gnpd_jobs *jobs, const char *principal, const char *id, struct gnpd_job **job, struct gnp_error *error);
/* References to at most `most` jobs, newest first; *more: there are further ones. Returns their number. */
size_t gnpd_jobs_list(struct gnpd_jobs *jobs, const struct gnpd_job_filter *filter, struct gnpd_job **out, size_t most, bool *more);

/* Cancels a job that waits, runs or was parked, removes one that is over. Needs no room on disk: that one that runs is to end is written
 * into its record, for the next process, and holds in this one when it cannot be. */
gnp_status gnpd_jobs_delete(struct gnpd_jobs *jobs, struct gnpd_job *job, enum gnpd_job_deletion *what, struct gnp_error *error);

/* The answer's body, open for reading: the caller's. GNP_CONFLICT before there is one, the job's own error where it failed, GNP_GONE
 * when it was let go. */
gnp_status gnpd_jobs_open_result(struct gnpd_jobs *jobs, const struct gnpd_job_view *view, int *fd, struct gnp_error *error);

/* Most memory jobs that run may hold together. */
size_t gnpd_jobs_memory_most(const struct gnpd_jobs *jobs);

/* What the metrics tell. */
void gnpd_jobs_count(struct gnpd_jobs *jobs, struct gnpd_jobs_counts *counts);

/* Appends the families gnpd_jobs_*. */
gnp_status gnpd_jobs_metrics_write(struct gnpd_jobs *jobs, struct gnp_buffer *buffer, struct gnp_error *error);

#endif
