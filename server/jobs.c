#include "jobs.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <time.h>

#include "job.h"
#include "server.h"

int64_t gnpd_jobs_now(void)
{
	struct timespec now;
	clock_gettime(CLOCK_REALTIME, &now);
	return (int64_t)now.tv_sec * 1000000 + now.tv_nsec / 1000;
}

/* ---- The table ---- */

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

/* Lock held. Gives the table's reference up. */
static void take_out(struct gnpd_jobs *jobs, struct gnpd_job *job)
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

/* ---- Records ---- */

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
	job->record = *next;
	job->version++;
	pthread_mutex_unlock(&jobs->lock);
	gnpd_watchers_notify(jobs->server->watchers);
}

static gnp_status put_record(struct gnpd_job *job, const struct gnpd_job_record *next, struct gnp_error *error)
{
	struct gnpd_jobs *jobs = job->jobs;
	pthread_mutex_lock(&jobs->disk);
	gnp_status status = gnpd_job_store_put_record(&jobs->store, next, error);
	pthread_mutex_unlock(&jobs->disk);
	return status;
}

gnp_status gnpd_job_commit(struct gnpd_job *job, const struct gnpd_job_record *next, struct gnp_error *error)
{
	gnp_status status = put_record(job, next, error);
	if (status == GNP_OK)
		gnpd_job_publish(job, next);
	return status;
}

void gnpd_job_commit_anyway(struct gnpd_job *job, const struct gnpd_job_record *next)
{
	struct gnp_error error = {0};
	if (put_record(job, next, &error) != GNP_OK)
		gnpd_log_event(&job->jobs->server->log, "error", "job %s is %s, which could not be written: %s", next->id,
		               gnpd_job_state_name(next->state), error.text);
	gnpd_job_publish(job, next);
}

gnp_status gnpd_job_account(struct gnpd_job *job, enum gnpd_job_file file, size_t bytes, struct gnp_error *error)
{
	struct gnpd_jobs *jobs = job->jobs;
	size_t most = jobs->server->config->jobs_bytes;
	gnp_status status = GNP_OK;
	pthread_mutex_lock(&jobs->lock);
	size_t before = job->bytes[file], others = jobs->bytes - before;
	if (bytes > before && (others > most || bytes > most - others)) {
		status = gnp_error_set(error, GNP_NO_SPACE, "jobs: they hold %zu bytes and %zu more are needed, at most %zu may be held (jobs-bytes)",
		                       others, bytes, most);
		jobs->counts.refused_bytes++;
	} else if (!job->removed) {
		jobs->bytes = others + bytes;
		job->bytes[file] = bytes;
	}
	pthread_mutex_unlock(&jobs->lock);
	return status;
}

void gnpd_job_let_go(struct gnpd_job *job, enum gnpd_job_file file)
{
	gnpd_job_store_remove(&job->jobs->store, job->record.id, file, NULL);
	gnpd_job_account(job, file, 0, NULL);
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
	take_out(jobs, job);
	pthread_mutex_unlock(&jobs->lock);
	gnpd_watchers_notify(jobs->server->watchers);
	return GNP_OK;
}

/* ---- Submitting ---- */

/* Lock held. Ids sort by age, also when the clock was set back. */
static gnp_status make_id(struct gnpd_jobs *jobs, struct gnpd_job_record *record, struct gnp_error *error)
{
	unsigned long long chance;
	record->created = gnpd_jobs_now();
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

/* Lock held. The principal's job with the key, or NULL. */
static struct gnpd_job *with_key(const struct gnpd_jobs *jobs, const char *principal, const char *key)
{
	for (size_t i = 0; i < jobs->count; i++)
		if (strcmp(jobs->items[i]->record.key, key) == 0 && strcmp(jobs->items[i]->record.principal, principal) == 0)
			return jobs->items[i];
	return NULL;
}

/* Lock held. */
static gnp_status check_same(const struct gnpd_job *old, const struct gnpd_job *job, struct gnp_error *error)
{
	const char *key = job->record.key;
	if (strcmp(old->record.fingerprint, job->record.fingerprint) != 0)
		return gnp_error_set(error, GNP_CONFLICT,
		                     "Idempotency-Key: \"%s\" is that of job %s, which was asked for something else (operation, query, headers or body)",
		                     key, old->arriving ? "to be" : old->record.id);
	if (old->arriving)
		return gnp_error_set(error, GNP_CONFLICT, "Idempotency-Key: a request with \"%s\" is being taken, try again", key);
	return GNP_OK;
}

/* Lock held. */
static gnp_status check_room(struct gnpd_jobs *jobs, size_t bytes, struct gnp_error *error)
{
	const struct gnpd_config *config = jobs->server->config;
	size_t waiting = 0;
	if (jobs->parking)
		return gnp_error_set(error, GNP_DRAINING, "%s", gnp_status_text(GNP_DRAINING));
	for (size_t i = 0; i < jobs->count; i++)
		waiting += jobs->items[i]->record.state == GNPD_JOB_QUEUED;
	if (waiting >= config->jobs_queue_count) {
		jobs->counts.refused_queue++;
		return gnp_error_set(error, GNP_OVERLOADED, "jobs: %zu wait, at most %zu may (jobs-queue-count)", waiting, config->jobs_queue_count);
	}
	if (jobs->count >= config->jobs_count) {
		jobs->counts.refused_count++;
		return gnp_error_set(error, GNP_NO_SPACE, "jobs: %zu are kept, at most %zu may be (jobs-count); DELETE those that are over",
		                     jobs->count, config->jobs_count);
	}
	if (jobs->bytes > config->jobs_bytes || bytes > config->jobs_bytes - jobs->bytes) {
		jobs->counts.refused_bytes++;
		return gnp_error_set(error, GNP_NO_SPACE,
		                     "jobs: they hold %zu bytes and %zu more are needed, at most %zu may be held (jobs-bytes); DELETE those that are over",
		                     jobs->bytes, bytes, config->jobs_bytes);
	}
	return GNP_OK;
}

/* Takes the job in as one that arrives, or finds the one that is there already (*existing, a reference). */
static gnp_status admit(struct gnpd_jobs *jobs, struct gnpd_job *job, struct gnpd_job **existing, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	*existing = NULL;
	pthread_mutex_lock(&jobs->lock);
	struct gnpd_job *old = *job->record.key ? with_key(jobs, job->record.principal, job->record.key) : NULL;
	if (old) {
		status = check_same(old, job, error);
		if (status == GNP_OK) {
			old->references++;
			jobs->counts.replayed++;
			*existing = old;
		}
	} else {
		status = check_room(jobs, job->bytes[GNPD_JOB_BODY_FILE], error);
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
		status = put_record(job, &job->record, error);
	if (status != GNP_OK)
		gnpd_job_store_remove(&jobs->store, id, GNPD_JOB_BODY_FILE, NULL);
	return status;
}

/* The runner's reference goes with it; a queue that was closed leaves the job to the next process. */
static void enqueue(struct gnpd_jobs *jobs, struct gnpd_job *job)
{
	gnpd_job_retain(job);
	if (gnpd_queue_submit(jobs->queue, &job->queued, NULL) != GNP_OK)
		gnpd_job_release(job);
}

gnp_status gnpd_jobs_submit(struct gnpd_jobs *jobs, const struct gnpd_work *work, const char *principal, const char *key,
                            struct gnpd_job **out, bool *existing, struct gnp_error *error)
{
	struct gnpd_job *old = NULL, *job = make_job(jobs, work, principal, key);
	if (!job)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "jobs: no memory");
	gnpd_job_clerk_make_room(jobs);
	gnp_status status = admit(jobs, job, &old, error);
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
		take_out(jobs, job);
	}
	pthread_mutex_unlock(&jobs->lock);
	if (status != GNP_OK) {
		gnpd_job_release(job);
		return status;
	}
	enqueue(jobs, job);
	*out = job;
	*existing = false;
	return GNP_OK;
}

/* ---- Finding ---- */

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

void gnpd_job_look(struct gnpd_job *job, struct gnpd_job_view *view)
{
	struct gnpd_jobs *jobs = job->jobs;
	pthread_mutex_lock(&jobs->lock);
	if (job->work)
		job->progress = gnpd_job_progress_of(&job->work->task, gnp_clock() - job->began, &job->progress);
	*view = (struct gnpd_job_view){.record = job->record, .progress = job->progress, .version = job->version, .removed = job->removed};
	pthread_mutex_unlock(&jobs->lock);
	struct gnpd_job_record *record = &view->record;
	record->query = record->content_type = record->content_encoding = record->accept = record->inference_length = NULL;
}

gnp_status gnpd_jobs_open_result(struct gnpd_jobs *jobs, const struct gnpd_job_view *view, int *fd, struct gnp_error *error)
{
	const struct gnpd_job_record *record = &view->record;
	size_t size = 0;
	switch (record->state) {
	case GNPD_JOB_QUEUED:
	case GNPD_JOB_RUNNING:
		return gnp_error_set(error, GNP_CONFLICT, "job %s: is %s, there is no result yet; GET /v1/jobs/%s?wait=30s waits for it", record->id,
		                     gnpd_job_state_name(record->state), record->id);
	case GNPD_JOB_FAILED: return gnp_error_set(error, record->error, "%s", record->error_text);
	case GNPD_JOB_CANCELLED: return gnp_error_set(error, GNP_GONE, "job %s: was cancelled and has no result", record->id);
	case GNPD_JOB_EXPIRED:
		return gnp_error_set(error, GNP_GONE, "job %s: its result was kept for %.15g s (jobs-ttl-seconds) and is gone", record->id,
		                     jobs->server->config->jobs_ttl_seconds);
	default: break;
	}
	*fd = gnpd_job_store_open_file(&jobs->store, record->id, GNPD_JOB_RESULT_FILE, &size);
	if (*fd >= 0)
		return GNP_OK;
	return errno == ENOENT ? gnp_error_set(error, GNP_GONE, "job %s: its result is gone", record->id)
	                       : gnpd_disk_failure(errno, "cannot open the result of", record->id, error);
}

/* ---- Deleting ---- */

/* Taken out of the queue: nobody else owns it. A record that cannot be written for want of room is removed, which needs none. */
static void cancel_queued(struct gnpd_jobs *jobs, struct gnpd_job *job)
{
	struct gnpd_job_record next = gnpd_job_record_now(job);
	struct gnp_error error = {0};
	next.state = GNPD_JOB_CANCELLED;
	next.finished = gnpd_jobs_now();
	if (put_record(job, &next, &error) != GNP_OK) {
		gnpd_log_event(&jobs->server->log, "error", "job %s: removed, for that it was cancelled could not be written: %s", next.id, error.text);
		pthread_mutex_lock(&jobs->disk);
		gnpd_job_remove(job, NULL);
		pthread_mutex_unlock(&jobs->disk);
	}
	gnpd_job_let_go(job, GNPD_JOB_BODY_FILE);
	gnpd_job_let_go(job, GNPD_JOB_CHECKPOINT_FILE);
	gnpd_job_publish(job, &next);
}

gnp_status gnpd_jobs_delete(struct gnpd_jobs *jobs, struct gnpd_job *job, enum gnpd_job_deletion *what, struct gnp_error *error)
{
	if (gnpd_queue_remove(jobs->queue, &job->queued)) {
		cancel_queued(jobs, job);
		gnpd_job_release(job); /* the runner's */
		*what = GNPD_JOB_WAS_CANCELLED;
		return GNP_OK;
	}
	pthread_mutex_lock(&jobs->lock);
	bool final = gnpd_job_state_is_final(job->record.state);
	if (!final) {
		job->cancelled = true;
		if (job->work)
			gnp_task_cancel(&job->work->task);
	}
	pthread_mutex_unlock(&jobs->lock);
	*what = final ? GNPD_JOB_WAS_REMOVED : GNPD_JOB_IS_BEING_CANCELLED;
	if (!final)
		return GNP_OK;
	pthread_mutex_lock(&jobs->disk);
	gnp_status status = gnpd_job_remove(job, error);
	pthread_mutex_unlock(&jobs->disk);
	return status;
}

/* ---- Life ---- */

gnp_status gnpd_jobs_create(struct gnpd_server *server, struct gnpd_jobs **out, struct gnp_error *error)
{
	const struct gnpd_config *config = server->config;
	struct gnpd_jobs *jobs = calloc(1, sizeof *jobs);
	if (!jobs)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "jobs: no memory");
	jobs->server = server;
	pthread_condattr_t monotonic;
	pthread_condattr_init(&monotonic);
	pthread_condattr_setclock(&monotonic, CLOCK_MONOTONIC);
	pthread_cond_init(&jobs->wake, &monotonic);
	pthread_condattr_destroy(&monotonic);
	pthread_mutex_init(&jobs->disk, NULL);
	pthread_mutex_init(&jobs->lock, NULL);
	pthread_mutex_init(&jobs->turn, NULL);
	gnp_status status = gnpd_job_store_open(config->jobs_dir, &jobs->store, error);
	if (status == GNP_OK)
		status = gnpd_jobs_recover(jobs, error);
	if (status != GNP_OK) {
		gnpd_jobs_free(jobs);
		return status;
	}
	*out = jobs;
	return GNP_OK;
}

gnp_status gnpd_jobs_start(struct gnpd_jobs *jobs, struct gnp_error *error)
{
	gnp_status status = gnpd_queue_create(jobs->server->config->job_runners, SIZE_MAX, 1, &jobs->queue, error);
	if (status != GNP_OK)
		return status;
	for (size_t i = 0; i < jobs->count; i++)
		if (!gnpd_job_state_is_final(jobs->items[i]->record.state))
			enqueue(jobs, jobs->items[i]);
	int fault = pthread_create(&jobs->clerk, NULL, gnpd_job_clerk, jobs);
	if (fault)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "jobs: no thread: %s", strerror(fault));
	jobs->clerk_runs = true;
	return GNP_OK;
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
	pthread_mutex_unlock(&jobs->lock);
}

static void stop_clerk(struct gnpd_jobs *jobs)
{
	if (!jobs->clerk_runs)
		return;
	pthread_mutex_lock(&jobs->lock);
	jobs->stopping = true;
	pthread_cond_signal(&jobs->wake);
	pthread_mutex_unlock(&jobs->lock);
	pthread_join(jobs->clerk, NULL);
}

void gnpd_jobs_free(struct gnpd_jobs *jobs)
{
	if (!jobs)
		return;
	gnpd_jobs_park(jobs);
	gnpd_queue_free(jobs->queue);
	stop_clerk(jobs);
	for (size_t i = 0; i < jobs->count; i++)
		gnpd_job_free(jobs->items[i]);
	free(jobs->items);
	gnpd_job_store_close(&jobs->store);
	pthread_cond_destroy(&jobs->wake);
	pthread_mutex_destroy(&jobs->turn);
	pthread_mutex_destroy(&jobs->lock);
	pthread_mutex_destroy(&jobs->disk);
	free(jobs);
}

void gnpd_jobs_count(struct gnpd_jobs *jobs, struct gnpd_jobs_counts *counts)
{
	pthread_mutex_lock(&jobs->lock);
	*counts = jobs->counts;
	counts->bytes = jobs->bytes;
	counts->memory = jobs->memory;
	for (size_t i = 0; i < jobs->count; i++)
		counts->states[jobs->items[i]->record.state]++;
	pthread_mutex_unlock(&jobs->lock);
}

struct gnpd_server *gnpd_jobs_server(struct gnpd_jobs *jobs)
{
	return jobs->server;
}

size_t gnpd_jobs_memory_most(const struct gnpd_jobs *jobs)
{
	const struct gnpd_config *config = jobs->server->config;
	size_t share = config->queue_bytes - config->queue_bytes / 4;
	return config->jobs_memory_bytes ? config->jobs_memory_bytes : share;
}
