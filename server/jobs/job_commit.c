/* How a job changes: its record on disk first, in memory then, and what its files are counted as. */
#include "server/base/log.h"
#include "server/config/config.h"
#include "server/jobs/job.h"
#include "server/jobs/job_watch.h"
#include "server/work/engine.h"

struct gnpd_job_record gnpd_job_record_now(struct gnpd_job *job)
{
	pthread_mutex_lock(&job->jobs->lock);
	struct gnpd_job_record copy = job->record;
	pthread_mutex_unlock(&job->jobs->lock);
	return copy;
}

void gnpd_job_publish(struct gnpd_job *job, const struct gnpd_job_record *next)
{
	struct gnpd_jobs *jobs = job->jobs;
	pthread_mutex_lock(&jobs->lock);
	if (gnpd_job_state_is_final(next->state) && next->state != job->record.state)
		jobs->counts.ended[next->state]++;
	if (gnpd_job_state_is_final(next->state))
		gnpd_job_trust(job);
	job->record = *next;
	job->version++;
	pthread_mutex_unlock(&jobs->lock);
	gnpd_watchers_notify(jobs->watchers);
}

/* disk is held. What becomes of a run once the process was told to end is not its fault: it is no attempt. */
static gnp_status put(struct gnpd_job *job, const struct gnpd_job_record *next, struct gnp_error *error)
{
	struct gnpd_jobs *jobs = job->jobs;
	struct gnpd_job_record record = *next;
	pthread_mutex_lock(&jobs->lock);
	record.cancelled = job->cancelled && !gnpd_job_state_is_final(next->state);
	record.company = job->company && next->state == GNPD_JOB_RUNNING;
	record.attempts -= jobs->parking && next->state == GNPD_JOB_RUNNING;
	pthread_mutex_unlock(&jobs->lock);
	return gnpd_job_store_put_record(&jobs->store, &record, error);
}

gnp_status gnpd_job_put_record(struct gnpd_job *job, const struct gnpd_job_record *next, struct gnp_error *error)
{
	struct gnpd_jobs *jobs = job->jobs;
	pthread_mutex_lock(&jobs->disk);
	gnp_status status = put(job, next, error);
	pthread_mutex_unlock(&jobs->disk);
	return status;
}

gnp_status gnpd_job_write_again(struct gnpd_job *job, struct gnp_error *error)
{
	struct gnpd_jobs *jobs = job->jobs;
	gnp_status status = GNP_OK;
	pthread_mutex_lock(&jobs->disk);
	struct gnpd_job_record record = gnpd_job_record_now(job);
	if (!gnpd_job_state_is_final(record.state) && !job->removed)
		status = put(job, &record, error);
	pthread_mutex_unlock(&jobs->disk);
	return status;
}

gnp_status gnpd_job_commit(struct gnpd_job *job, const struct gnpd_job_record *next, struct gnp_error *error)
{
	struct gnpd_jobs *jobs = job->jobs;
	pthread_mutex_lock(&jobs->disk);
	gnp_status status = put(job, next, error);
	if (status == GNP_OK)
		gnpd_job_publish(job, next);
	pthread_mutex_unlock(&jobs->disk);
	return status;
}

void gnpd_job_commit_anyway(struct gnpd_job *job, const struct gnpd_job_record *next)
{
	struct gnp_error error = {0};
	if (gnpd_job_commit(job, next, &error) == GNP_OK)
		return;
	gnpd_log_event(job->jobs->engine->log, GNPD_LOG_ERROR, "job %s is %s, which could not be written: %s", next->id,
	               gnpd_job_state_name(next->state), error.text);
	gnpd_job_publish(job, next);
}

gnp_status gnpd_job_account(struct gnpd_job *job, enum gnpd_job_file file, size_t bytes, struct gnp_error *error)
{
	struct gnpd_jobs *jobs = job->jobs;
	size_t most = jobs->engine->config->jobs_bytes;
	gnp_status status = GNP_OK;
	pthread_mutex_lock(&jobs->lock);
	size_t before = job->bytes[file], others = jobs->bytes - before;
	if (bytes > before && (others > most || bytes > most - others)) {
		status = gnp_error_set(error, GNP_NO_SPACE,
		                       "jobs: they hold %zu bytes and %zu more are needed, at most %zu may be held "
		                       "(jobs-bytes)", others, bytes, most);
		jobs->counts.refused_bytes++;
	} else if (!job->removed) {
		jobs->bytes = others + bytes;
		job->bytes[file] = bytes;
	}
	pthread_mutex_unlock(&jobs->lock);
	return status;
}

gnp_status gnpd_job_let_go(struct gnpd_job *job, enum gnpd_job_file file, struct gnp_error *error)
{
	gnp_status status = gnpd_job_store_remove(&job->jobs->store, job->record.id, file, error);
	return status == GNP_OK ? gnpd_job_account(job, file, 0, error) : status;
}

gnp_status gnpd_job_remove(struct gnpd_job *job, struct gnp_error *error)
{
	struct gnpd_jobs *jobs = job->jobs;
	if (job->removed)
		return GNP_OK;
	gnp_status status = gnpd_job_store_remove(&jobs->store, job->record.id, GNPD_JOB_RECORD_FILE, error);
	if (status != GNP_OK)
		return status;
	for (int file = GNPD_JOB_RECORD_FILE + 1; file < GNPD_JOB_FILES; file++)
		gnpd_job_store_remove(&jobs->store, job->record.id, (enum gnpd_job_file)file, NULL);
	pthread_mutex_lock(&jobs->lock);
	gnpd_jobs_take_out(jobs, job);
	pthread_mutex_unlock(&jobs->lock);
	gnpd_watchers_notify(jobs->watchers);
	return GNP_OK;
}
