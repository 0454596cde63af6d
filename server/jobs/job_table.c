/* The table of jobs, sorted by id: taking in and out, finding, listing, references and how a job looks. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "server/jobs/job.h"

/* Lock held. Where the id is, or would be. */
static size_t place_of(const struct gnpd_jobs *jobs, const char *id)
{
	size_t low = 0, high = jobs->count;
	while (low < high) {
		size_t middle = low + (high - low) / 2;
		if (strcmp(jobs->items[middle]->record.id, id) < 0)
			low = middle + 1;
		else
			high = middle;
	}
	return low;
}

gnp_status gnpd_jobs_insert(struct gnpd_jobs *jobs, struct gnpd_job *job, struct gnp_error *error)
{
	if (jobs->count == jobs->capacity) {
		size_t capacity = jobs->capacity ? 2 * jobs->capacity : 64;
		struct gnpd_job **items = realloc(jobs->items, capacity * sizeof *items);
		if (!items)
			return gnp_error_set(error, GNP_OUT_OF_MEMORY, "jobs: no memory for %zu", capacity);
		jobs->items = items;
		jobs->capacity = capacity;
	}
	size_t place = place_of(jobs, job->record.id);
	memmove(jobs->items + place + 1, jobs->items + place, (jobs->count - place) * sizeof *jobs->items);
	jobs->items[place] = job;
	jobs->count++;
	for (int file = 0; file < GNPD_JOB_FILES; file++)
		jobs->bytes += job->bytes[file];
	job->references++;
	return GNP_OK;
}

void gnpd_job_free(struct gnpd_job *job)
{
	gnpd_job_record_clear(&job->record);
	free(job);
}

void gnpd_jobs_take_out(struct gnpd_jobs *jobs, struct gnpd_job *job)
{
	size_t place = place_of(jobs, job->record.id);
	memmove(jobs->items + place, jobs->items + place + 1, (jobs->count - place - 1) * sizeof *jobs->items);
	jobs->count--;
	for (int file = 0; file < GNPD_JOB_FILES; file++) {
		jobs->bytes -= job->bytes[file];
		job->bytes[file] = 0;
	}
	job->removed = true;
	job->version++;
	job->references--;
}

struct gnpd_job *gnpd_job_retain(struct gnpd_job *job)
{
	pthread_mutex_lock(&job->jobs->lock);
	job->references++;
	pthread_mutex_unlock(&job->jobs->lock);
	return job;
}

void gnpd_job_release(struct gnpd_job *job)
{
	if (!job)
		return;
	struct gnpd_jobs *jobs = job->jobs;
	pthread_mutex_lock(&jobs->lock);
	bool last = --job->references == 0;
	pthread_mutex_unlock(&jobs->lock);
	if (last)
		gnpd_job_free(job);
}

gnp_status gnpd_jobs_find(struct gnpd_jobs *jobs, const char *principal, const char *id, struct gnpd_job **out, struct gnp_error *error)
{
	struct gnpd_job *job = NULL;
	pthread_mutex_lock(&jobs->lock);
	size_t place = place_of(jobs, id);
	if (place < jobs->count && strcmp(jobs->items[place]->record.id, id) == 0)
		job = jobs->items[place];
	if (job && (job->arriving || strcmp(job->record.principal, principal) != 0))
		job = NULL;
	if (job)
		job->references++;
	pthread_mutex_unlock(&jobs->lock);
	if (!job)
		return gnp_error_set(error, GNP_NOT_FOUND, "job: there is no \"%.64s\"", id);
	*out = job;
	return GNP_OK;
}

/* Lock held. */
static bool passes(const struct gnpd_job *job, const struct gnpd_job_filter *filter)
{
	return !job->arriving && strcmp(job->record.principal, filter->principal) == 0 &&
	       (filter->state < 0 || (int)job->record.state == filter->state) &&
	       (!filter->operation || strcmp(job->record.operation, filter->operation) == 0);
}

size_t gnpd_jobs_list(struct gnpd_jobs *jobs, const struct gnpd_job_filter *filter, struct gnpd_job **out, size_t most, bool *more)
{
	size_t count = 0;
	*more = false;
	pthread_mutex_lock(&jobs->lock);
	for (size_t i = filter->after ? place_of(jobs, filter->after) : jobs->count; i > 0 && !*more; i--) {
		struct gnpd_job *job = jobs->items[i - 1];
		if (!passes(job, filter))
			continue;
		*more = count == most;
		if (*more)
			break;
		job->references++;
		out[count++] = job;
	}
	pthread_mutex_unlock(&jobs->lock);
	return count;
}

void gnpd_job_look_progress(struct gnpd_job *job)
{
	if (job->work)
		job->progress = gnpd_job_progress_of(&job->work->task, gnp_clock() - job->began, &job->progress);
}

void gnpd_job_look(struct gnpd_job *job, struct gnpd_job_view *view)
{
	struct gnpd_jobs *jobs = job->jobs;
	pthread_mutex_lock(&jobs->lock);
	gnpd_job_look_progress(job);
	*view = (struct gnpd_job_view){.record = job->record, .progress = job->progress, .version = job->version, .removed = job->removed};
	pthread_mutex_unlock(&jobs->lock);
	struct gnpd_job_record *record = &view->record;
	record->query = record->content_type = record->content_encoding = record->accept = record->inference_length = NULL;
}

void gnpd_jobs_count(struct gnpd_jobs *jobs, struct gnpd_jobs_counts *counts)
{
	pthread_mutex_lock(&jobs->lock);
	*counts = jobs->counts;
	counts->bytes = jobs->bytes;
	counts->memory = jobs->memory;
	counts->suspects = jobs->suspects;
	for (size_t i = 0; i < jobs->count; i++)
		counts->states[jobs->items[i]->record.state]++;
	pthread_mutex_unlock(&jobs->lock);
}
