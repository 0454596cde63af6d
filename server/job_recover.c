/* Jobs an earlier process left: those that waited or ran are to run again, in the order they came, the rest is kept. */
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#include "clock.h"
#include "job.h"
#include "server.h"

static size_t file_bytes(struct gnpd_jobs *jobs, const char *id, enum gnpd_job_file file)
{
	size_t size = 0;
	int fd = gnpd_job_store_open_file(&jobs->store, id, file, &size);
	if (fd < 0)
		return 0;
	close(fd);
	return size;
}

static void give_up(struct gnpd_jobs *jobs, struct gnpd_job_record *record)
{
	record->state = GNPD_JOB_FAILED;
	record->error = GNP_INTERNAL;
	record->finished = gnpd_clock_now();
	snprintf(record->error_text, sizeof record->error_text, "the daemon ended %llu times while it ran, need at most %zu (jobs-attempts)",
	         (unsigned long long)record->attempts, jobs->server->config->jobs_attempts);
}

/* The record is the job's from then on. */
static gnp_status take_up(struct gnpd_jobs *jobs, struct gnpd_job_record *record, struct gnp_error *error)
{
	struct gnpd_job *job = calloc(1, sizeof *job);
	if (!job)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "jobs: no memory");
	bool was_running = record->state == GNPD_JOB_RUNNING, failed = record->state == GNPD_JOB_FAILED;
	if (was_running && record->attempts >= jobs->server->config->jobs_attempts) {
		give_up(jobs, record);
		failed = true;
	} else if (was_running) {
		record->state = GNPD_JOB_QUEUED;
	}
	job->record = *record;
	*record = (struct gnpd_job_record){0};
	job->jobs = jobs;
	job->queued.run = gnpd_job_run;
	if (failed) {
		gnpd_job_store_put_record(&jobs->store, &job->record, NULL);
		gnpd_job_store_remove(&jobs->store, job->record.id, GNPD_JOB_BODY_FILE, NULL);
		gnpd_job_store_remove(&jobs->store, job->record.id, GNPD_JOB_CHECKPOINT_FILE, NULL);
	}
	for (int file = GNPD_JOB_RECORD_FILE + 1; file < GNPD_JOB_FILES; file++)
		job->bytes[file] = file_bytes(jobs, job->record.id, (enum gnpd_job_file)file);
	gnp_status status = gnpd_jobs_insert(jobs, job, error);
	if (status != GNP_OK)
		gnpd_job_free(job);
	else if (!gnpd_job_state_is_final(job->record.state))
		jobs->counts.recovered++;
	return status;
}

gnp_status gnpd_jobs_recover(struct gnpd_jobs *jobs, struct gnp_error *error)
{
	struct gnpd_job_found found = {0};
	gnp_status status = gnpd_job_store_scan(&jobs->store, &jobs->server->log, &found, error);
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
	if (status == GNP_OK && (jobs->count || found.damaged))
		gnpd_log_event(&jobs->server->log, "info", "jobs-dir: %s holds %zu jobs, %llu of them to be run, and %zu damaged records",
		               jobs->store.path, jobs->count, (unsigned long long)jobs->counts.recovered, found.damaged);
	return status;
}
