/* What others may know of a job: a reference to it, how it looks at this moment, and what is asked and told of jobs.
 * What a job is made of (job.h) stays in this folder. */
#ifndef GNPD_JOB_VIEW_H
#define GNPD_JOB_VIEW_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "server/jobs/job_progress.h"
#include "server/jobs/job_record.h"

struct gnpd_job;

/* A further reference to a job. */
struct gnpd_job *gnpd_job_retain(struct gnpd_job *job);
/* NULL is allowed. */
void gnpd_job_release(struct gnpd_job *job);

/* A job as it is now. */
struct gnpd_job_view {
	struct gnpd_job_record record; /* nothing of it is owned: what the answer says of itself is the job's, as long as
	                                  that is held; the other strings are NULL */
	struct gnpd_job_progress progress;
	unsigned version;              /* grows with every change of state */
	bool removed;
};
void gnpd_job_look(struct gnpd_job *job, struct gnpd_job_view *view);

/* Which jobs are asked for. */
struct gnpd_job_filter {
	const char *principal;
	int state;             /* enum gnpd_job_state, or -1: any */
	const char *operation; /* NULL: any */
	const char *after;     /* an id: older ones; NULL: from the newest */
};
/* What became of a job that was to be deleted. */
enum gnpd_job_deletion { GNPD_JOB_WAS_CANCELLED, GNPD_JOB_IS_BEING_CANCELLED, GNPD_JOB_WAS_REMOVED };

/* What the metrics tell. */
struct gnpd_jobs_counts {
	size_t states[GNPD_JOB_STATES], suspects, bytes, memory;
	uint64_t submitted, replayed, recovered, damaged, checkpoints, resumed;
	uint64_t ended[GNPD_JOB_STATES];
	uint64_t refused_count, refused_queue, refused_bytes, refused_disk, refused_memory;
};
#endif
