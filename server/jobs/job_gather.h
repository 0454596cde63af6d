/* What a run of a job needs before it computes: memory out of the share of jobs, the body, the checkpoint. One job
 * gathers at a time, and waits for what others hold: two that each hold a part would wait for each other. For this
 * folder alone. */
#ifndef GNPD_JOB_GATHER_H
#define GNPD_JOB_GATHER_H

#include "core/base/checkpoint.h"
#include "core/base/status.h"
#include "server/jobs/job.h"
#include "server/work/reply.h"
#include "server/work/work.h"

/* One run of a job. */
struct gnpd_run {
	struct gnpd_job *job;
	struct gnpd_jobs *jobs;
	struct gnpd_work work;
	struct gnpd_reply reply;
	struct gnp_checkpoint checkpoint;
	struct gnp_buffer kept;  /* the checkpoint it begins from */
	size_t checkpoint_bytes; /* of the file */
	bool had_checkpoint;     /* when it began */
	size_t memory;           /* reserved of what jobs may hold */
};

/* The memory that the decoding of its body asks for is the run's from then on. */
void gnpd_job_gather_budget(struct gnpd_run *run);
/* Waits until all is there: body and checkpoint are read, the call is checked and its memory reserved. */
gnp_status gnpd_job_gather(struct gnpd_run *run, struct gnp_error *error);
/* Gives its part of the share of jobs back. */
void gnpd_job_gather_release(struct gnpd_run *run);

#endif
