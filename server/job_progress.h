/* How far a job is, as a share of the whole of it. */
#ifndef GNPD_JOB_PROGRESS_H
#define GNPD_JOB_PROGRESS_H

#include "task.h"

struct gnpd_job_progress {
	double fraction;    /* 0..1, never less than before */
	const char *stage;
	size_t step, steps; /* work items of the stage; 0, 0: not counted */
	double eta;         /* seconds; < 0: not known yet */
};

/* task: of a job that has run for `elapsed` seconds; before: what was last said of this run, zeroed at its beginning. */
struct gnpd_job_progress gnpd_job_progress_of(const struct gnp_task *task, double elapsed, const struct gnpd_job_progress *before);

#endif
