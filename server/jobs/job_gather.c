#include "server/jobs/job_gather.h"

#include <inttypes.h>

#include "server/base/log.h"
#include "server/work/engine.h"

static uint64_t changes_now(struct gnpd_jobs *jobs)
{
	pthread_mutex_lock(&jobs->lock);
	uint64_t changes = jobs->changes;
	pthread_mutex_unlock(&jobs->lock);
	return changes;
}

static void wait_change(struct gnpd_jobs *jobs, uint64_t seen)
{
	pthread_mutex_lock(&jobs->lock);
	while (jobs->changes == seen)
		pthread_cond_wait(&jobs->change, &jobs->lock);
	pthread_mutex_unlock(&jobs->lock);
}

typedef gnp_status (*take_function)(struct gnpd_run *run, size_t bytes, struct gnp_error *error);

/* Asks `take` again after every change while the answer is that others hold what is needed. */
static gnp_status be_patient(struct gnpd_run *run, take_function take, size_t bytes, struct gnp_error *error)
{
	struct gnpd_jobs *jobs = run->jobs;
	struct gnp_error cause;
	gnp_status status;
	atomic_fetch_add(&jobs->patient, 1); /* before the first look: who releases later sees it */
	for (;;) {
		uint64_t seen = changes_now(jobs);
		cause = (struct gnp_error){0};
		status = gnp_task_check(&run->work.task, &cause);
		if (status == GNP_OK)
			status = take(run, bytes, &cause);
		if (status != GNP_OVERLOADED)
			break;
		wait_change(jobs, seen);
	}
	atomic_fetch_sub(&jobs->patient, 1);
	return status == GNP_OK ? GNP_OK : gnp_error_set(error, status, "%s", cause.text);
}

static gnp_status take_turn(struct gnpd_run *run, size_t none, struct gnp_error *error)
{
	struct gnpd_jobs *jobs = run->jobs;
	(void)none;
	pthread_mutex_lock(&jobs->lock);
	bool taken = !jobs->gathering;
	jobs->gathering = true;
	pthread_mutex_unlock(&jobs->lock);
	return taken ? GNP_OK : gnp_error_set(error, GNP_OVERLOADED, "another job's turn");
}

static void give_turn(struct gnpd_jobs *jobs)
{
	pthread_mutex_lock(&jobs->lock);
	jobs->gathering = false;
	gnpd_jobs_changed(jobs);
	pthread_mutex_unlock(&jobs->lock);
}

/* Of the share of jobs. */
static gnp_status reserve_share(struct gnpd_run *run, size_t bytes, struct gnp_error *error)
{
	struct gnpd_jobs *jobs = run->jobs;
	size_t most = gnpd_jobs_memory_most(jobs);
	gnp_status status = GNP_OK;
	pthread_mutex_lock(&jobs->lock);
	if (bytes > most || run->memory > most - bytes)
		status = gnp_error_set(error, GNP_TOO_LARGE,
		                       "memory: the job holds %zu bytes and needs %zu more, need at most %zu "
		                       "(jobs-memory-bytes)", run->memory, bytes, most);
	else if (jobs->memory > most - bytes)
		status = gnp_error_set(error, GNP_OVERLOADED, "other jobs hold the memory");
	else {
		jobs->memory += bytes;
		run->memory += bytes;
	}
	pthread_mutex_unlock(&jobs->lock);
	return status;
}

static void release_share(struct gnpd_run *run, size_t bytes)
{
	pthread_mutex_lock(&run->jobs->lock);
	run->jobs->memory -= bytes;
	run->memory -= bytes;
	gnpd_jobs_changed(run->jobs);
	pthread_mutex_unlock(&run->jobs->lock);
}

/* Of the share and of the queue's bytes. */
static gnp_status take_bytes(struct gnpd_run *run, size_t bytes, struct gnp_error *error)
{
	gnp_status status = reserve_share(run, bytes, error);
	if (status != GNP_OK)
		return status;
	/* Asked again, it is no refusal. */
	status = gnpd_queue_reserve(run->jobs->engine->queue, run->work.reserved, bytes, error);
	if (status == GNP_OK)
		run->work.reserved += bytes;
	else
		release_share(run, bytes);
	return status;
}

/* Waits with what it holds: only one job gathers at a time, and those that compute end. */
static gnp_status reserve(struct gnpd_run *run, size_t bytes, struct gnp_error *error)
{
	return be_patient(run, take_bytes, bytes, error);
}

/* The budget of its decoding. */
static gnp_status reserve_decoded(void *context, size_t bytes, struct gnp_error *error)
{
	struct gnpd_run *run = context;
	gnp_status status = reserve(run, bytes, error);
	run->work.out_of_bytes = status != GNP_OK;
	return status;
}

static void release_decoded(void *context, size_t bytes)
{
	struct gnpd_run *run = context;
	release_share(run, bytes);
	gnpd_work_release(&run->work, bytes);
}

static gnp_status read_body(struct gnpd_run *run, struct gnp_error *error)
{
	const struct gnpd_job_record *record = &run->job->record;
	gnp_status status = gnpd_job_store_get(&run->jobs->store, record->id, GNPD_JOB_BODY_FILE, record->body_bytes,
	                                       &run->work.body, error);
	if (status == GNP_OK && run->work.body.size != record->body_bytes)
		status = gnp_error_set(error, GNP_STORAGE, "body: got %zu bytes, need %" PRIu64, run->work.body.size,
		                       record->body_bytes);
	return status;
}

static void read_checkpoint(struct gnpd_run *run)
{
	struct gnpd_job_store *store = &run->jobs->store;
	if (gnpd_job_store_get(store, run->job->record.id, GNPD_JOB_CHECKPOINT_FILE, run->checkpoint_bytes, &run->kept,
	                       NULL) != GNP_OK)
		return;
	run->checkpoint.kept = run->kept.data;
	run->checkpoint.size = run->kept.size;
	pthread_mutex_lock(&run->jobs->lock);
	run->jobs->counts.resumed++;
	pthread_mutex_unlock(&run->jobs->lock);
}

/* Memory for a checkpoint was not asked for when the job was taken: where it does not fit beside the rest, the job
 * begins anew. */
static gnp_status take_checkpoint(struct gnpd_run *run, struct gnp_error *error)
{
	struct gnp_error cause = {0};
	if (!run->checkpoint_bytes)
		return GNP_OK;
	gnp_status status = reserve(run, run->checkpoint_bytes, &cause);
	if (status == GNP_OK)
		read_checkpoint(run);
	if (status != GNP_TOO_LARGE)
		return status == GNP_OK ? GNP_OK : gnp_error_set(error, status, "%s", cause.text);
	gnpd_log_event(run->jobs->engine->log, GNPD_LOG_WARNING, "job %s: begins anew without its checkpoint: %s",
	               run->job->record.id, cause.text);
	gnpd_job_let_go(run->job, GNPD_JOB_CHECKPOINT_FILE, NULL);
	run->checkpoint_bytes = 0;
	return GNP_OK;
}

/* Holds nothing while it waits for its turn; once it has all, others have theirs. */
gnp_status gnpd_job_gather(struct gnpd_run *run, struct gnp_error *error)
{
	gnp_status status = be_patient(run, take_turn, 0, error);
	if (status != GNP_OK)
		return status;
	status = reserve(run, run->job->record.body_bytes, error);
	if (status == GNP_OK)
		status = read_body(run, error);
	if (status == GNP_OK)
		status = gnpd_work_check(&run->work, error);
	if (status == GNP_OK)
		status = reserve(run, run->work.call.memory, error);
	if (status == GNP_OK)
		status = take_checkpoint(run, error);
	give_turn(run->jobs);
	return status;
}

void gnpd_job_gather_budget(struct gnpd_run *run)
{
	run->work.budget = (struct gnp_budget){reserve_decoded, release_decoded, run};
}

void gnpd_job_gather_release(struct gnpd_run *run)
{
	release_share(run, run->memory);
}
