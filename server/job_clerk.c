/* What time does to jobs: those that run too long are stopped, those that are over are let go. */
#include "clock.h"
#include "job.h"
#include "server.h"

/* Lock held. */
static void stop_overdue(struct gnpd_jobs *jobs)
{
	double now = gnp_clock();
	for (size_t i = 0; i < jobs->count; i++) {
		struct gnpd_work *work = jobs->items[i]->work;
		if (work && now > atomic_load(&work->deadline))
			gnp_task_stop(&work->task, GNP_DEADLINE);
	}
}

/* A reference to a job whose time has come, or NULL. *remove: its second time. */
static struct gnpd_job *find_due(struct gnpd_jobs *jobs, bool *remove)
{
	int64_t ttl = (int64_t)(jobs->server->config->jobs_ttl_seconds * 1e6), now = gnpd_clock_now();
	struct gnpd_job *due = NULL;
	pthread_mutex_lock(&jobs->lock);
	for (size_t i = 0; i < jobs->count && !due; i++) {
		struct gnpd_job *job = jobs->items[i];
		const struct gnpd_job_record *record = &job->record;
		*remove = record->state == GNPD_JOB_EXPIRED;
		if (gnpd_job_state_is_final(record->state) && now - record->finished >= (*remove ? 2 * ttl : ttl)) {
			job->references++;
			due = job;
		}
	}
	pthread_mutex_unlock(&jobs->lock);
	return due;
}

/* disk is held. Its files go first: their room may be what the record needs. A job that cannot even be called expired is removed. */
static void expire(struct gnpd_jobs *jobs, struct gnpd_job *job)
{
	struct gnpd_job_record next = gnpd_job_record_now(job);
	struct gnp_error error = {0};
	if (job->removed)
		return;
	next.state = GNPD_JOB_EXPIRED;
	for (int file = GNPD_JOB_RECORD_FILE + 1; file < GNPD_JOB_FILES; file++)
		gnpd_job_let_go(job, (enum gnpd_job_file)file);
	if (gnpd_job_store_put_record(&jobs->store, &next, &error) == GNP_OK) {
		gnpd_job_publish(job, &next);
		return;
	}
	gnpd_log_event(&jobs->server->log, "error", "job %s: removed, for that it expired could not be written: %s", next.id, error.text);
	gnpd_job_remove(job, NULL);
}

static void let_go(struct gnpd_jobs *jobs)
{
	struct gnpd_job *job;
	bool remove = false;
	while ((job = find_due(jobs, &remove))) {
		gnp_status status = GNP_OK;
		pthread_mutex_lock(&jobs->disk);
		if (remove)
			status = gnpd_job_remove(job, NULL);
		else
			expire(jobs, job);
		pthread_mutex_unlock(&jobs->disk);
		gnpd_job_release(job);
		if (status != GNP_OK)
			return; /* the next time */
	}
}

bool gnpd_job_clerk_make_room(struct gnpd_jobs *jobs)
{
	struct gnpd_job *oldest = NULL;
	pthread_mutex_lock(&jobs->lock);
	for (size_t i = 0; i < jobs->count && !oldest && jobs->count >= jobs->server->config->jobs_count; i++)
		if (jobs->items[i]->record.state == GNPD_JOB_EXPIRED)
			oldest = jobs->items[i];
	if (oldest)
		oldest->references++;
	pthread_mutex_unlock(&jobs->lock);
	if (!oldest)
		return false;
	pthread_mutex_lock(&jobs->disk);
	bool made = gnpd_job_remove(oldest, NULL) == GNP_OK;
	pthread_mutex_unlock(&jobs->disk);
	gnpd_job_release(oldest);
	return made;
}

void *gnpd_job_clerk(void *argument)
{
	struct gnpd_jobs *jobs = argument;
	pthread_mutex_lock(&jobs->lock);
	while (!jobs->stopping) {
		stop_overdue(jobs);
		pthread_mutex_unlock(&jobs->lock);
		let_go(jobs);
		pthread_mutex_lock(&jobs->lock);
		if (!jobs->stopping)
			gnpd_clock_tick(&jobs->wake, &jobs->lock);
	}
	pthread_mutex_unlock(&jobs->lock);
	return NULL;
}
