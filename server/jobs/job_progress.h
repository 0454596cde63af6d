/* Tells how far a job is, as a share of the whole of it. */
#ifndef GNPD_JOB_PROGRESS_H
#define GNPD_JOB_PROGRESS_H

#include "core/base/task.h"

struct gnpd_job_progress {
	double fraction;    /* 0..1, never less than before */
	const char *stage;  /* NULL: it has not run */
	size_t step, steps; /* work items of the stage; 0, 0: not counted */
	double eta;         /* seconds; < 0: not known */
	/* Where the pace of a flow's steps is measured from: the first look at them, in seconds of this run, and how many of its own the run
	 * had taken then. */
	double since;
	size_t from;
};

/* task: of a job that has run for `elapsed` seconds; before: what was last said of this run, zeroed at its beginning. Of a task that was
 * stopped, or is done, it stays what it was, with no time to come. */
struct gnpd_job_progress gnpd_job_progress_of(const struct gnp_task *task, double elapsed, const struct gnpd_job_progress *before);

#endif
