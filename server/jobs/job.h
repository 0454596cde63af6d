/* What a job is made of, and the table of all: for the files of this folder alone. Others see a job through
 * job_view.h and jobs.h.
 *
 * Locks, in the order they are taken: `disk` while records change on disk, `lock` for all that is in memory and
 * never while the disk is waited for. A record changes on disk first and in memory then, by the one that owns the
 * change: the submitter until the job is in the queue, the runner from there to its end, whoever took it out of the
 * queue or claimed it when it was parked, and after its end the holder of `disk`. Whoever holds `disk` may add the
 * request to cancel. */
#ifndef GNPD_JOB_H
#define GNPD_JOB_H

#include <pthread.h>
#include <stdatomic.h>

#include "server/base/queue.h"
#include "server/jobs/job_store.h"
#include "server/jobs/jobs.h"

struct gnpd_job {
	struct gnpd_queued queued;
	struct gnpd_jobs *jobs;
	struct gnpd_job_record record; /* its strings, id, operation, principal and key never change; those of the
	                                  answer are set once, with its end */
	size_t references;
	size_t bytes[GNPD_JOB_FILES];  /* of its files but the record, as the quota counts them */
	bool arriving;                 /* not yet on disk: nobody may know of it */
	bool cancelled;                /* somebody asked for its end; the record's member is that on disk */
	bool parked;                   /* left to the next process: in no queue and nobody's */
	bool removed;
	bool company;                  /* requests are computed beside its run; the record's member is that on disk */
	bool suspect;                  /* a process died while it ran, and it has not got further since */
	struct gnpd_work *work;        /* while it runs */
	double began;                  /* gnp_clock() */
	struct gnpd_job_progress progress;
	unsigned version;
	double again;                  /* gnp_clock() before which job_expiry does not try it again; its own */
};

struct gnpd_jobs {
	const struct gnpd_engine *engine;
	struct gnpd_watchers *watchers; /* told of every change; NULL: nobody watches */
	struct gnpd_job_store store;
	pthread_mutex_t disk, lock;
	bool gathering;                 /* a job gathers its memory: two that each hold a part would wait for each other */
	size_t suspects;                /* how many there are: they run first, and one at a time */
	struct gnpd_job *alone;         /* the one that runs */
	atomic_bool has_alone;          /* whether there is one, for those that only look */
	pthread_cond_t change;          /* of what jobs on their runners may wait for */
	uint64_t changes;
	atomic_size_t patient;          /* those that wait for memory */
	pthread_cond_t wake;            /* of the thread of job_expiry */
	struct gnpd_queue *queue;
	struct gnpd_job **items;        /* (count), by id */
	size_t count, capacity;
	size_t bytes;                   /* sum of theirs */
	size_t memory;                  /* that those that run have reserved */
	int64_t last;                   /* microseconds of the newest id */
	bool opening;                   /* what an earlier process left is still being queued, and none of it runs yet */
	bool parking, stopping, expiry_runs;
	double silent_until;            /* gnp_clock() before which job_expiry does not complain again; its own */
	pthread_t expiry;
	struct gnpd_jobs_counts counts; /* but for states and bytes */
};

/* Lock held, or nobody else about. Puts a job into the table, which holds a reference. */
gnp_status gnpd_jobs_insert(struct gnpd_jobs *jobs, struct gnpd_job *job, struct gnp_error *error);
/* Lock held. Takes it out again and gives the table's reference up. */
void gnpd_jobs_take_out(struct gnpd_jobs *jobs, struct gnpd_job *job);
void gnpd_job_free(struct gnpd_job *job);

/* job_recover.c: takes up what the store holds. */
gnp_status gnpd_jobs_recover(struct gnpd_jobs *jobs, struct gnp_error *error);

/* Lock held. Brings the progress of a job that runs up to date. */
void gnpd_job_look_progress(struct gnpd_job *job);

/* job_commit.c. To the store alone, with the wish that it end where there is one. */
gnp_status gnpd_job_put_record(struct gnpd_job *job, const struct gnpd_job_record *next, struct gnp_error *error);
/* Writes the record; on success it is the job's, else the job keeps its old one. */
gnp_status gnpd_job_commit(struct gnpd_job *job, const struct gnpd_job_record *next, struct gnp_error *error);
/* The same, and what cannot be written is the job's in memory nevertheless. Says so in the log. */
void gnpd_job_commit_anyway(struct gnpd_job *job, const struct gnpd_job_record *next);
/* Writes the record once more as it is, with what was asked for since; of a job that is over nothing. */
gnp_status gnpd_job_write_again(struct gnpd_job *job, struct gnp_error *error);
/* Makes a record that is written the job's, in memory. */
void gnpd_job_publish(struct gnpd_job *job, const struct gnpd_job_record *next);
/* A shallow copy. */
struct gnpd_job_record gnpd_job_record_now(struct gnpd_job *job);

/* Counts that a file of the job is about to have so many bytes: GNP_NO_SPACE, and nothing changed, when that is more than before and
 * does not fit jobs-bytes. */
gnp_status gnpd_job_account(struct gnpd_job *job, enum gnpd_job_file file, size_t bytes, struct gnp_error *error);

/* Removes a file the job has no more use for. What cannot be removed still counts. */
gnp_status gnpd_job_let_go(struct gnpd_job *job, enum gnpd_job_file file, struct gnp_error *error);

/* Removes the job, which is over, with its files. disk is held. */
gnp_status gnpd_job_remove(struct gnpd_job *job, struct gnp_error *error);

/* Lock held. What jobs on their runners wait for may have come. */
void gnpd_jobs_changed(struct gnpd_jobs *jobs);
/* Lock held. The job has ended or got further than the runs that a process died in: others may run beside it. */
void gnpd_job_trust(struct gnpd_job *job);

/* Into the runners' queue, with a reference of its own; a queue that was closed leaves the job to the next process. */
void gnpd_job_enqueue(struct gnpd_job *job);
/* Leaves the job, which is the caller's and not over, to the next process, unless its end is asked for: then it is cancelled. */
void gnpd_job_leave(struct gnpd_job *job);
/* job_run.c: what the queue calls. */
void gnpd_job_run(struct gnpd_queued *queued);
/* job_expiry.c: what its thread does until it is told to stop. */
void *gnpd_job_expiry(void *jobs);
/* Removes the oldest job that expired and can be removed, if the table is full. */
void gnpd_job_expiry_make_room(struct gnpd_jobs *jobs);

#endif
