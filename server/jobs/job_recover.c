/* Takes up the jobs that an earlier process left: those that waited or ran are to run again, in the order they came,
 * the rest is kept. */
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "server/base/clock.h"
#include "server/base/log.h"
#include "server/config/config.h"
#include "server/jobs/job.h"
#include "server/jobs/job_store_scan.h"
#include "server/work/engine.h"

static size_t file_bytes(struct gnpd_jobs *jobs, const char *id, enum gnpd_job_file file)
{
	size_t size = 0;
	int fd = gnpd_job_store_open_file(&jobs->store, id, file, &size);
	if (fd < 0)
		return 0;
	close(fd);
	return size;
}

/* What an earlier process left is over: its record is written and what belongs to a job that is to run goes. */
static void end(struct gnpd_jobs *jobs, struct gnpd_job_record *record, enum gnpd_job_state state)
{
	record->state = state;
	record->cancelled = record->company = false;
	record->finished = gnpd_clock_now();
	jobs->counts.ended[state]++;
	gnpd_job_store_put_record(&jobs->store, record, NULL);
	gnpd_job_store_remove(&jobs->store, record->id, GNPD_JOB_BODY_FILE, NULL);
	gnpd_job_store_remove(&jobs->store, record->id, GNPD_JOB_CHECKPOINT_FILE, NULL);
}

static void give_up(struct gnpd_jobs *jobs, struct gnpd_job_record *record)
{
	record->error = GNP_INTERNAL;
	snprintf(record->error_text, sizeof record->error_text,
	         "the process died %llu time%s while this job ran%s (jobs-attempts: %zu); the job may be what ends it: make it smaller, or ask "
	         "the operator before it is submitted again",
	         (unsigned long long)record->attempts, record->attempts == 1 ? "" : "s",
	         record->attempts == 1 ? "" : ", at last with no other job beside it", jobs->engine->config->jobs_attempts);
	gnpd_log_event(jobs->engine->log, GNPD_LOG_ERROR, "job %s: failed: %s", record->id, record->error_text);
	end(jobs, record, GNPD_JOB_FAILED);
}

/* Deaths in company may have been others' doing, such as a request that is sent again whenever it ended the process; not for ever. */
static uint64_t deaths_allowed(const struct gnpd_jobs *jobs, const struct gnpd_job_record *record)
{
	enum { COMPANY = 3 };
	return jobs->engine->config->jobs_attempts + (record->company ? COMPANY : 0);
}

/* Decides what becomes of a job that was not over. */
static void decide(struct gnpd_jobs *jobs, struct gnpd_job_record *record)
{
	if (record->cancelled)
		end(jobs, record, GNPD_JOB_CANCELLED);
	else if (record->state == GNPD_JOB_RUNNING && record->attempts >= deaths_allowed(jobs, record))
		give_up(jobs, record);
	else
		record->state = GNPD_JOB_QUEUED;
}

/* The record is the job's from then on. */
static gnp_status take_up(struct gnpd_jobs *jobs, struct gnpd_job_record *record, struct gnp_error *error)
{
	struct gnpd_job *job = calloc(1, sizeof *job);
	if (!job)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "jobs: no memory");
	if (!gnpd_job_state_is_final(record->state))
		decide(jobs, record);
	job->record = *record;
	*record = (struct gnpd_job_record){0};
	job->jobs = jobs;
	job->queued.run = gnpd_job_run;
	for (int file = GNPD_JOB_RECORD_FILE + 1; file < GNPD_JOB_FILES; file++)
		job->bytes[file] = file_bytes(jobs, job->record.id, (enum gnpd_job_file)file);
	gnp_status status = gnpd_jobs_insert(jobs, job, error);
	if (status != GNP_OK) {
		gnpd_job_free(job);
	} else if (!gnpd_job_state_is_final(job->record.state)) {
		jobs->counts.recovered++;
		job->suspect = job->record.attempts > 0;
		jobs->suspects += job->suspect;
	}
	return status;
}

gnp_status gnpd_jobs_recover(struct gnpd_jobs *jobs, struct gnp_error *error)
{
	struct gnpd_job_found found = {0};
	gnp_status status = gnpd_job_store_scan(&jobs->store, jobs->engine->log, &found, error);
	if (status != GNP_OK)
		return status;
	jobs->counts.damaged = found.damaged;
	for (size_t i = 0; i < found.count && status == GNP_OK; i++) {
		char digits[15];
		snprintf(digits, sizeof digits, "%.14s", found.records[i].id);
		jobs->last = (int64_t)strtoull(digits, NULL, 16); /* they are sorted */
		status = take_up(jobs, &found.records[i], error);
	}
	for (size_t i = 0; i < found.count; i++)
		gnpd_job_record_clear(&found.records[i]);
	free(found.records);
	if (jobs->suspects)
		gnpd_log_event(jobs->engine->log, GNPD_LOG_WARNING,
		               "jobs-dir: the process before died while %zu jobs ran, which run first and each "
		               "with no other beside it", jobs->suspects);
	if (status == GNP_OK && (jobs->count || found.damaged))
		gnpd_log_event(jobs->engine->log, GNPD_LOG_INFO,
		               "jobs-dir: %s holds %zu jobs, %llu of them to be run, and %zu damaged records",
		               jobs->store.path, jobs->count, (unsigned long long)jobs->counts.recovered, found.damaged);
	return status;
}
