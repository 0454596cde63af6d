/* Submitting: a checked call becomes a job on disk and in the queue, unless one with its key is there or there is no
 * room. */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>

#include "server/base/clock.h"
#include "server/config/config.h"
#include "server/jobs/job.h"
#include "server/work/codec.h"
#include "server/work/engine.h"

/* Lock held. Ids sort by age, also when the clock was set back. */
static gnp_status make_id(struct gnpd_jobs *jobs, struct gnpd_job_record *record, struct gnp_error *error)
{
	unsigned long long chance;
	record->created = gnpd_clock_now();
	jobs->last = record->created > jobs->last ? record->created : jobs->last + 1;
	if (getrandom(&chance, sizeof chance, 0) != sizeof chance)
		return gnp_error_set(error, GNP_IO, "random numbers: %s", strerror(errno));
	snprintf(record->id, sizeof record->id, "%014llx%016llx", (unsigned long long)jobs->last & 0xffffffffffffffULL, chance);
	return GNP_OK;
}

static void make_fingerprint(const struct gnpd_work *work, char text[GNP_SHA256_TEXT])
{
	const char *parts[] = {work->operation->name, work->query, work->content_type, work->content_encoding, work->accept,
	                       work->inference_length};
	enum { PARTS = sizeof parts / sizeof parts[0] };
	const void *data[PARTS + 1];
	size_t size[PARTS + 1];
	for (size_t i = 0; i < PARTS; i++) {
		data[i] = parts[i] ? parts[i] : "";
		size[i] = strlen(data[i]) + 1;
	}
	data[PARTS] = work->body.data;
	size[PARTS] = work->body.size;
	gnp_sha256_text(data, size, PARTS + 1, text);
}

static bool copy_text(const char *from, char **to)
{
	*to = from ? strdup(from) : NULL;
	return *to || !from;
}

static struct gnpd_job *make_job(struct gnpd_jobs *jobs, const struct gnpd_work *work, const char *principal, const char *key)
{
	struct gnpd_job *job = calloc(1, sizeof *job);
	if (!job)
		return NULL;
	struct gnpd_job_record *record = &job->record;
	job->jobs = jobs;
	job->queued.run = gnpd_job_run;
	job->arriving = true;
	job->references = 1;
	job->bytes[GNPD_JOB_BODY_FILE] = work->body.size;
	record->body_bytes = work->body.size;
	snprintf(record->operation, sizeof record->operation, "%s", work->operation->name);
	snprintf(record->codec, sizeof record->codec, "%s", work->codec->name);
	snprintf(record->principal, sizeof record->principal, "%s", principal);
	snprintf(record->key, sizeof record->key, "%s", key ? key : "");
	make_fingerprint(work, record->fingerprint);
	if (copy_text(work->query, &record->query) && copy_text(work->content_type, &record->content_type) &&
	    copy_text(work->content_encoding, &record->content_encoding) && copy_text(work->accept, &record->accept) &&
	    copy_text(work->inference_length, &record->inference_length))
		return job;
	gnpd_job_free(job);
	return NULL;
}

/* Lock held. The principal's job with the same key, or NULL. */
static struct gnpd_job *same_key(const struct gnpd_jobs *jobs, const struct gnpd_job *job)
{
	const struct gnpd_job_record *record = &job->record;
	for (size_t i = 0; i < jobs->count && *record->key; i++)
		if (strcmp(jobs->items[i]->record.key, record->key) == 0 && strcmp(jobs->items[i]->record.principal, record->principal) == 0)
			return jobs->items[i];
	return NULL;
}

/* Lock held. */
static gnp_status check_same(const struct gnpd_job *old, const struct gnpd_job *job, struct gnp_error *error)
{
	const char *key = job->record.key;
	if (strcmp(old->record.fingerprint, job->record.fingerprint) != 0)
		return gnp_error_set(error, GNP_CONFLICT,
		                     "Idempotency-Key: \"%s\" is that of job %s, which was asked for something else "
		                     "(operation, query, headers or body)", key, old->arriving ? "to be" : old->record.id);
	if (old->arriving)
		return gnp_error_set(error, GNP_IN_PROGRESS, "Idempotency-Key: a request with \"%s\" is being taken, try again", key);
	return GNP_OK;
}

/* Lock held. */
static gnp_status check_room(struct gnpd_jobs *jobs, const struct gnpd_work *work, struct gnp_error *error)
{
	size_t bytes = work->body.size, memory = gnpd_jobs_memory_most(jobs);
	const struct gnpd_config *config = jobs->engine->config;
	size_t waiting = 0;
	if (jobs->parking)
		return gnp_error_set(error, GNP_DRAINING, "%s", gnp_status_text(GNP_DRAINING));
	if (work->peak > memory || work->call.memory > memory || work->reserved > memory - work->call.memory) {
		jobs->counts.refused_memory++;
		return gnp_error_set(error, GNP_TOO_LARGE,
		                     "memory: the job held %zu bytes to be decoded, holds %zu and needs %zu more, need at most "
		                     "%zu at any time (jobs-memory-bytes, queue-bytes)", work->peak, work->reserved, work->call.memory, memory);
	}
	for (size_t i = 0; i < jobs->count; i++)
		waiting += jobs->items[i]->record.state == GNPD_JOB_QUEUED;
	if (waiting >= config->jobs_queue_count) {
		jobs->counts.refused_queue++;
		return gnp_error_set(error, GNP_OVERLOADED, "jobs: %zu wait, at most %zu may (jobs-queue-count)", waiting,
		                     config->jobs_queue_count);
	}
	if (jobs->count >= config->jobs_count) {
		jobs->counts.refused_count++;
		return gnp_error_set(error, GNP_NO_SPACE, "jobs: %zu are kept, at most %zu may be (jobs-count); DELETE those that are over",
		                     jobs->count, config->jobs_count);
	}
	if (jobs->bytes > config->jobs_bytes || bytes > config->jobs_bytes - jobs->bytes) {
		jobs->counts.refused_bytes++;
		return gnp_error_set(error, GNP_NO_SPACE,
		                     "jobs: they hold %zu bytes and %zu more are needed, at most %zu may be held "
		                     "(jobs-bytes); DELETE those that are over", jobs->bytes, bytes, config->jobs_bytes);
	}
	return GNP_OK;
}

/* What expired goes for a new job, not for one that is there already. */
static void make_room(struct gnpd_jobs *jobs, const struct gnpd_job *job)
{
	pthread_mutex_lock(&jobs->lock);
	bool is_new = !same_key(jobs, job);
	pthread_mutex_unlock(&jobs->lock);
	if (is_new)
		gnpd_job_expiry_make_room(jobs);
}

/* Takes the job in as one that arrives, or finds the one that is there already (*existing, a reference). */
static gnp_status admit(struct gnpd_jobs *jobs, const struct gnpd_work *work, struct gnpd_job *job, struct gnpd_job **existing,
                        struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	*existing = NULL;
	pthread_mutex_lock(&jobs->lock);
	struct gnpd_job *old = same_key(jobs, job);
	if (old) {
		status = check_same(old, job, error);
		if (status == GNP_OK) {
			old->references++;
			jobs->counts.replayed++;
			*existing = old;
		}
	} else {
		status = check_room(jobs, work, error);
		if (status == GNP_OK)
			status = make_id(jobs, &job->record, error);
		if (status == GNP_OK)
			status = gnpd_jobs_insert(jobs, job, error);
	}
	pthread_mutex_unlock(&jobs->lock);
	return status;
}

static gnp_status store(struct gnpd_jobs *jobs, struct gnpd_job *job, const struct gnp_buffer *body, struct gnp_error *error)
{
	const char *id = job->record.id;
	gnp_status status = gnpd_job_store_put(&jobs->store, id, GNPD_JOB_BODY_FILE, &(struct gnp_piece){body->data, body->size}, 1, error);
	if (status == GNP_OK)
		status = gnpd_job_put_record(job, &job->record, error);
	if (status != GNP_OK)
		gnpd_job_store_remove(&jobs->store, id, GNPD_JOB_BODY_FILE, NULL);
	return status;
}

gnp_status gnpd_jobs_submit(struct gnpd_jobs *jobs, const struct gnpd_work *work, const char *principal, const char *key,
                            struct gnpd_job **out, bool *existing, struct gnp_error *error)
{
	struct gnpd_job *old = NULL, *job = make_job(jobs, work, principal, key);
	if (!job)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "jobs: no memory");
	make_room(jobs, job);
	gnp_status status = admit(jobs, work, job, &old, error);
	if (status != GNP_OK || old) {
		gnpd_job_release(job);
		*out = old;
		*existing = old != NULL;
		return status;
	}
	status = store(jobs, job, &work->body, error);
	pthread_mutex_lock(&jobs->lock);
	job->arriving = false;
	if (status == GNP_OK) {
		jobs->counts.submitted++;
	} else {
		jobs->counts.refused_disk++;
		gnpd_jobs_take_out(jobs, job);
	}
	pthread_mutex_unlock(&jobs->lock);
	if (status != GNP_OK) {
		gnpd_job_release(job);
		return status;
	}
	gnpd_job_enqueue(job);
	*out = job;
	*existing = false;
	return GNP_OK;
}
