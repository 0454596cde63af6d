/* Stops jobs that run too long, and lets go of those that have been over for long enough. */
#include <string.h>

#include "server/base/clock.h"
#include "server/base/log.h"
#include "server/base/metrics.h"
#include "server/config/config.h"
#include "server/jobs/job.h"
#include "server/work/engine.h"

/* Seconds until a job that could not be let go is tried again, and from one complaint of such to the next. */
static const double AGAIN = 30, SILENCE = 60;

/* Lock held. */
static void stop_if_overdue(struct gnpd_jobs *jobs, struct gnpd_work *work)
{
	if (gnp_clock() <= atomic_load(&work->deadline) || gnp_task_check(&work->task, NULL) != GNP_OK)
		return;
	gnp_task_stop(&work->task, GNP_DEADLINE);
	gnpd_jobs_changed(jobs);
	gnpd_metrics_cancel(jobs->engine->metrics, GNPD_CANCEL_DEADLINE);
}

/* Lock held. Looks at the jobs that run, also when nobody asks how far they are: their pace is measured from look to look. */
static void look_about(struct gnpd_jobs *jobs)
{
	for (size_t i = 0; i < jobs->count; i++) {
		struct gnpd_job *job = jobs->items[i];
		if (!job->work)
			continue;
		stop_if_overdue(jobs, job->work);
		gnpd_job_look_progress(job);
	}
}

/* lock is held. A reference to the job, whose id is where the search goes on: without the lock its record may be written by who runs it. */
static struct gnpd_job *take(struct gnpd_job *job, char after[GNPD_JOB_ID + 1])
{
	job->references++;
	memcpy(after, job->record.id, GNPD_JOB_ID + 1);
	return job;
}

/* A reference to the next job after the id whose time has come, or NULL. *remove: its second time. The id becomes that job's. */
static struct gnpd_job *find_due(struct gnpd_jobs *jobs, char after[GNPD_JOB_ID + 1], bool *remove)
{
	int64_t ttl = (int64_t)(jobs->engine->config->jobs_ttl_seconds * 1e6), now = gnpd_clock_now();
	struct gnpd_job *due = NULL;
	pthread_mutex_lock(&jobs->lock);
	for (size_t i = 0; i < jobs->count && !due && !jobs->stopping; i++) {
		struct gnpd_job *job = jobs->items[i];
		const struct gnpd_job_record *record = &job->record;
		if (strcmp(record->id, after) <= 0 || !gnpd_job_state_is_final(record->state) || gnp_clock() < job->again)
			continue;
		*remove = record->state == GNPD_JOB_EXPIRED;
		if (now - record->finished >= (*remove ? 2 * ttl : ttl))
			due = take(job, after);
	}
	pthread_mutex_unlock(&jobs->lock);
	return due;
}

/* disk is held. */
static gnp_status let_files_go(struct gnpd_job *job, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	for (int file = GNPD_JOB_RECORD_FILE + 1; file < GNPD_JOB_FILES && status == GNP_OK; file++)
		status = gnpd_job_let_go(job, (enum gnpd_job_file)file, error);
	return status;
}

/* disk is held. Written before the files go, so that a start in between takes the job for one that expired and not for one that lost
 * its result; where there is no room for the record, they make it. */
static gnp_status write_expired(struct gnpd_job *job, const struct gnpd_job_record *next, struct gnp_error *error)
{
	struct gnpd_job_store *store = &job->jobs->store;
	gnp_status status = gnpd_job_store_put_record(store, next, error);
	if (status != GNP_NO_SPACE || let_files_go(job, NULL) != GNP_OK)
		return status;
	return gnpd_job_store_put_record(store, next, NULL);
}

/* disk is held. A job that cannot be called expired is removed; one that cannot be removed either, or whose files stay, has not expired
 * and is tried again. */
static gnp_status expire(struct gnpd_job *job, struct gnp_error *error)
{
	struct gnpd_jobs *jobs = job->jobs;
	struct gnpd_job_record next = gnpd_job_record_now(job);
	struct gnp_error cause = {0};
	if (job->removed)
		return GNP_OK;
	next.state = GNPD_JOB_EXPIRED;
	gnp_status status = write_expired(job, &next, &cause);
	if (status != GNP_OK && gnpd_job_remove(job, NULL) == GNP_OK) {
		gnpd_log_event(jobs->engine->log, GNPD_LOG_ERROR,
		               "job %s: removed, for that it expired could not be written: %s", next.id, cause.text);
		return GNP_OK;
	}
	if (status != GNP_OK)
		return gnp_error_set(error, status, "%s", cause.text);
	status = let_files_go(job, error);
	if (status == GNP_OK)
		gnpd_job_publish(job, &next);
	return status;
}

static void complain(struct gnpd_jobs *jobs, size_t failed, const struct gnp_error *error)
{
	double now = gnp_clock();
	if (now < jobs->silent_until)
		return;
	jobs->silent_until = now + SILENCE;
	gnpd_log_event(jobs->engine->log, GNPD_LOG_ERROR,
	               "jobs: %zu that are over could not be let go and are tried again in %.0f s: %s", failed,
	               AGAIN, error->text);
}

/* One that cannot be let go holds up neither the others nor the end of the process. */
static void let_go(struct gnpd_jobs *jobs)
{
	char after[GNPD_JOB_ID + 1] = "";
	struct gnp_error error = {0};
	struct gnpd_job *job;
	size_t failed = 0;
	bool remove = false;
	while ((job = find_due(jobs, after, &remove))) {
		pthread_mutex_lock(&jobs->disk);
		gnp_status status = remove ? gnpd_job_remove(job, &error) : expire(job, &error);
		pthread_mutex_unlock(&jobs->disk);
		if (status != GNP_OK) {
			failed++;
			job->again = gnp_clock() + AGAIN;
		}
		gnpd_job_release(job);
	}
	if (failed)
		complain(jobs, failed, &error);
}

/* A reference to the oldest job after the id that expired, or NULL; also when the table is not full. The id becomes that job's. */
static struct gnpd_job *find_expired(struct gnpd_jobs *jobs, char after[GNPD_JOB_ID + 1])
{
	struct gnpd_job *oldest = NULL;
	pthread_mutex_lock(&jobs->lock);
	for (size_t i = 0; i < jobs->count && !oldest && jobs->count >= jobs->engine->config->jobs_count; i++)
		if (jobs->items[i]->record.state == GNPD_JOB_EXPIRED && strcmp(jobs->items[i]->record.id, after) > 0)
			oldest = take(jobs->items[i], after);
	pthread_mutex_unlock(&jobs->lock);
	return oldest;
}

void gnpd_job_expiry_make_room(struct gnpd_jobs *jobs)
{
	char after[GNPD_JOB_ID + 1] = "";
	struct gnpd_job *job;
	bool made = false;
	while (!made && (job = find_expired(jobs, after))) {
		pthread_mutex_lock(&jobs->disk);
		made = gnpd_job_remove(job, NULL) == GNP_OK;
		pthread_mutex_unlock(&jobs->disk);
		gnpd_job_release(job);
	}
}

/* A reference to the next job after the id that runs, or NULL. The id becomes that job's. */
static struct gnpd_job *find_running(struct gnpd_jobs *jobs, char after[GNPD_JOB_ID + 1])
{
	struct gnpd_job *running = NULL;
	pthread_mutex_lock(&jobs->lock);
	for (size_t i = 0; i < jobs->count && !running; i++)
		if (jobs->items[i]->record.state == GNPD_JOB_RUNNING && strcmp(jobs->items[i]->record.id, after) > 0)
			running = take(jobs->items[i], after);
	pthread_mutex_unlock(&jobs->lock);
	return running;
}

/* Writes of those that run that their runs are no attempts: one that does not stop in time is killed with the process. */
static void excuse(struct gnpd_jobs *jobs)
{
	char after[GNPD_JOB_ID + 1] = "";
	struct gnp_error error = {0};
	struct gnpd_job *job;
	while ((job = find_running(jobs, after))) {
		if (gnpd_job_write_again(job, &error) != GNP_OK)
			gnpd_log_event(jobs->engine->log, GNPD_LOG_WARNING,
			               "job %s is being parked, which could not be written: %s", after, error.text);
		gnpd_job_release(job);
	}
}

void *gnpd_job_expiry(void *argument)
{
	struct gnpd_jobs *jobs = argument;
	bool excused = false;
	pthread_mutex_lock(&jobs->lock);
	while (!jobs->stopping) {
		bool parking = jobs->parking;
		look_about(jobs);
		pthread_mutex_unlock(&jobs->lock);
		if (parking && !excused)
			excuse(jobs);
		excused = parking;
		let_go(jobs);
		pthread_mutex_lock(&jobs->lock);
		if (!jobs->stopping)
			gnpd_clock_tick(&jobs->wake, &jobs->lock);
	}
	pthread_mutex_unlock(&jobs->lock);
	return NULL;
}
