#include "server/jobs/jobs.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "server/base/clock.h"
#include "server/base/log.h"
#include "server/config/config.h"
#include "server/jobs/job.h"
#include "server/work/engine.h"

/* ---- Results ---- */

gnp_status gnpd_jobs_open_result(struct gnpd_jobs *jobs, const struct gnpd_job_view *view, int *fd, struct gnp_error *error)
{
	const struct gnpd_job_record *record = &view->record;
	size_t size = 0;
	switch (record->state) {
	case GNPD_JOB_QUEUED:
	case GNPD_JOB_RUNNING:
		return gnp_error_set(error, GNP_CONFLICT,
		                     "job %s: is %s, there is no result yet; GET /v1/jobs/%s?wait=30s waits for it", record->id,
		                     gnpd_job_state_name(record->state), record->id);
	case GNPD_JOB_FAILED: return gnp_error_set(error, record->error, "%s", record->error_text);
	case GNPD_JOB_CANCELLED: return gnp_error_set(error, GNP_GONE, "job %s: was cancelled and has no result", record->id);
	case GNPD_JOB_EXPIRED:
		return gnp_error_set(error, GNP_GONE, "job %s: its result was kept for %.15g s (jobs-ttl-seconds) and is gone", record->id,
		                     jobs->engine->config->jobs_ttl_seconds);
	default: break;
	}
	*fd = gnpd_job_store_open_file(&jobs->store, record->id, GNPD_JOB_RESULT_FILE, &size);
	if (*fd >= 0)
		return GNP_OK;
	return errno == ENOENT ? gnp_error_set(error, GNP_GONE, "job %s: its result is gone", record->id)
	                       : gnpd_disk_failure(errno, "cannot open the result of", record->id, error);
}

/* ---- Deleting ---- */

/* The job is the caller's. A record that cannot be written for want of room is removed, which needs none. */
static void cancel(struct gnpd_job *job)
{
	struct gnpd_jobs *jobs = job->jobs;
	struct gnpd_job_record next = gnpd_job_record_now(job);
	struct gnp_error error = {0};
	next.state = GNPD_JOB_CANCELLED;
	next.finished = gnpd_clock_now();
	if (gnpd_job_commit(job, &next, &error) != GNP_OK) {
		pthread_mutex_lock(&jobs->disk);
		bool removed = gnpd_job_remove(job, NULL) == GNP_OK;
		pthread_mutex_unlock(&jobs->disk);
		gnpd_log_event(jobs->engine->log, GNPD_LOG_ERROR, "job %s is cancelled, which could not be written%s: %s",
		               next.id, removed ? ", and is removed" : "", error.text);
		gnpd_job_publish(job, &next);
	}
	gnpd_job_let_go(job, GNPD_JOB_BODY_FILE, NULL);
	gnpd_job_let_go(job, GNPD_JOB_CHECKPOINT_FILE, NULL);
}

void gnpd_job_leave(struct gnpd_job *job)
{
	pthread_mutex_lock(&job->jobs->lock);
	bool cancelled = job->cancelled;
	job->parked = !cancelled;
	pthread_mutex_unlock(&job->jobs->lock);
	if (cancelled)
		cancel(job);
}

/* Whether the job was nobody's and is the caller's now; else, when it is not over (*final), its runner is told to end it. */
static bool claim(struct gnpd_jobs *jobs, struct gnpd_job *job, bool *final)
{
	*final = false;
	if (gnpd_queue_remove(jobs->queue, &job->queued)) {
		gnpd_job_release(job); /* the runner's */
		return true;
	}
	pthread_mutex_lock(&jobs->lock);
	bool parked = job->parked;
	job->parked = false;
	*final = gnpd_job_state_is_final(job->record.state);
	job->cancelled = !*final;
	if (job->cancelled && job->work)
		gnp_task_cancel(&job->work->task);
	gnpd_jobs_changed(jobs);
	pthread_mutex_unlock(&jobs->lock);
	return parked;
}

/* So that the job does not run again should the process not live to see its end. The wish holds when it cannot be written, too. */
static void note_wish(struct gnpd_jobs *jobs, struct gnpd_job *job)
{
	struct gnp_error error = {0};
	if (gnpd_job_write_again(job, &error) != GNP_OK)
		gnpd_log_event(jobs->engine->log, GNPD_LOG_WARNING, "job %s is being cancelled, which could not be written: %s",
		               gnpd_job_record_now(job).id, error.text);
}

gnp_status gnpd_jobs_delete(struct gnpd_jobs *jobs, struct gnpd_job *job, enum gnpd_job_deletion *what, struct gnp_error *error)
{
	bool final;
	if (claim(jobs, job, &final)) {
		cancel(job);
		*what = GNPD_JOB_WAS_CANCELLED;
		return GNP_OK;
	}
	*what = final ? GNPD_JOB_WAS_REMOVED : GNPD_JOB_IS_BEING_CANCELLED;
	if (!final) {
		note_wish(jobs, job);
		return GNP_OK;
	}
	pthread_mutex_lock(&jobs->disk);
	gnp_status status = gnpd_job_remove(job, error);
	pthread_mutex_unlock(&jobs->disk);
	return status;
}

/* ---- Life ---- */

/* Of the queue that others give bytes back to. */
static void tell_of_bytes(void *context)
{
	struct gnpd_jobs *jobs = context;
	if (atomic_load(&jobs->patient) == 0)
		return;
	pthread_mutex_lock(&jobs->lock);
	gnpd_jobs_changed(jobs);
	pthread_mutex_unlock(&jobs->lock);
}

void gnpd_jobs_changed(struct gnpd_jobs *jobs)
{
	jobs->changes++;
	pthread_cond_broadcast(&jobs->change);
}

void gnpd_job_trust(struct gnpd_job *job)
{
	struct gnpd_jobs *jobs = job->jobs;
	if (!job->suspect)
		return;
	job->suspect = false;
	jobs->suspects--;
	if (jobs->alone == job) {
		jobs->alone = NULL;
		atomic_store(&jobs->has_alone, false);
	}
	gnpd_jobs_changed(jobs);
}

gnp_status gnpd_jobs_create(const struct gnpd_engine *engine, struct gnpd_watchers *watchers, struct gnpd_jobs **out,
                            struct gnp_error *error)
{
	struct gnpd_jobs *jobs = calloc(1, sizeof *jobs);
	if (!jobs)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "jobs: no memory");
	jobs->engine = engine;
	jobs->watchers = watchers;
	gnpd_clock_init(&jobs->wake);
	pthread_cond_init(&jobs->change, NULL);
	pthread_mutex_init(&jobs->disk, NULL);
	pthread_mutex_init(&jobs->lock, NULL);
	gnpd_queue_tell(engine->queue, tell_of_bytes, jobs);
	gnp_status status = gnpd_job_store_open(engine->config->jobs_dir, &jobs->store, error);
	if (status == GNP_OK)
		status = gnpd_jobs_recover(jobs, error);
	if (status != GNP_OK) {
		gnpd_jobs_free(jobs);
		return status;
	}
	*out = jobs;
	return GNP_OK;
}

void gnpd_jobs_keep_company(struct gnpd_jobs *jobs)
{
	if (!atomic_load(&jobs->has_alone))
		return;
	pthread_mutex_lock(&jobs->lock);
	struct gnpd_job *job = jobs->alone && !jobs->alone->company ? jobs->alone : NULL;
	if (job) {
		job->company = true;
		job->references++;
	}
	pthread_mutex_unlock(&jobs->lock);
	if (!job)
		return;
	struct gnp_error error = {0};
	if (gnpd_job_write_again(job, &error) != GNP_OK)
		gnpd_log_event(jobs->engine->log, GNPD_LOG_WARNING,
		               "job %s is not alone any more, which could not be written: %s",
		               gnpd_job_record_now(job).id, error.text);
	gnpd_job_release(job);
}

/* What an earlier process left, in the order it came. */
static void enqueue_left(struct gnpd_jobs *jobs, bool suspects)
{
	for (size_t i = 0; i < jobs->count; i++) {
		struct gnpd_job *job = jobs->items[i];
		if (!gnpd_job_state_is_final(job->record.state) && job->suspect == suspects)
			gnpd_job_enqueue(job);
	}
}

gnp_status gnpd_jobs_start(struct gnpd_jobs *jobs, struct gnp_error *error)
{
	jobs->opening = true;
	gnp_status status = gnpd_queue_create(jobs->engine->config->job_runners, SIZE_MAX, 1, &jobs->queue, error);
	if (status != GNP_OK)
		return status;
	enqueue_left(jobs, true);
	enqueue_left(jobs, false);
	pthread_mutex_lock(&jobs->lock);
	jobs->opening = false;
	gnpd_jobs_changed(jobs);
	pthread_mutex_unlock(&jobs->lock);
	int fault = pthread_create(&jobs->expiry, NULL, gnpd_job_expiry, jobs);
	if (fault)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "jobs: no thread: %s", strerror(fault));
	jobs->expiry_runs = true;
	return GNP_OK;
}

void gnpd_job_enqueue(struct gnpd_job *job)
{
	gnpd_job_retain(job);
	if (gnpd_queue_submit(job->jobs->queue, &job->queued, NULL) == GNP_OK)
		return;
	gnpd_job_leave(job);
	gnpd_job_release(job);
}

void gnpd_jobs_park(struct gnpd_jobs *jobs)
{
	if (!jobs)
		return;
	if (jobs->queue)
		gnpd_queue_close(jobs->queue);
	pthread_mutex_lock(&jobs->lock);
	jobs->parking = true;
	for (size_t i = 0; i < jobs->count; i++)
		if (jobs->items[i]->work)
			gnp_task_stop(&jobs->items[i]->work->task, GNP_DRAINING);
	gnpd_jobs_changed(jobs);
	pthread_cond_signal(&jobs->wake);
	pthread_mutex_unlock(&jobs->lock);
}

static void stop_expiry(struct gnpd_jobs *jobs)
{
	if (!jobs->expiry_runs)
		return;
	pthread_mutex_lock(&jobs->lock);
	jobs->stopping = true;
	pthread_cond_signal(&jobs->wake);
	pthread_mutex_unlock(&jobs->lock);
	pthread_join(jobs->expiry, NULL);
}

void gnpd_jobs_free(struct gnpd_jobs *jobs)
{
	if (!jobs)
		return;
	gnpd_jobs_park(jobs);
	gnpd_queue_free(jobs->queue);
	stop_expiry(jobs);
	gnpd_queue_tell(jobs->engine->queue, NULL, NULL);
	for (size_t i = 0; i < jobs->count; i++)
		gnpd_job_free(jobs->items[i]);
	free(jobs->items);
	gnpd_job_store_close(&jobs->store);
	pthread_cond_destroy(&jobs->wake);
	pthread_cond_destroy(&jobs->change);
	pthread_mutex_destroy(&jobs->lock);
	pthread_mutex_destroy(&jobs->disk);
	free(jobs);
}

size_t gnpd_jobs_memory_most(const struct gnpd_jobs *jobs)
{
	const struct gnpd_config *config = jobs->engine->config;
	size_t share = config->queue_bytes - config->queue_bytes / 4;
	return config->jobs_memory_bytes ? config->jobs_memory_bytes : share;
}
