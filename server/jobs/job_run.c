/* Runs a job on its runner: from its files to its answer in a file. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "proto/operation/operations.h"
#include "proto/tensor/warnings.h"
#include "server/base/clock.h"
#include "server/base/container.h"
#include "server/base/log.h"
#include "server/base/metrics.h"
#include "server/base/queue.h"
#include "server/config/config.h"
#include "server/jobs/job_gather.h"
#include "server/jobs/jobs.h"
#include "server/work/codec_file.h"
#include "server/work/codec_oip.h"
#include "server/work/engine.h"

/* ---- Checkpoints ---- */

static size_t sum(const struct gnp_piece *pieces, size_t count)
{
	size_t size = 0;
	for (size_t i = 0; i < count; i++)
		size += pieces[i].size;
	return size;
}

/* A run that got further than those a process died in has paid for them. Where others are suspected it makes way for them, so that they
 * have no other beside them either. */
static void prove(struct gnpd_run *run)
{
	struct gnpd_job *job = run->job;
	struct gnpd_jobs *jobs = run->jobs;
	struct gnpd_job_record next = gnpd_job_record_now(job);
	bool further = !run->had_checkpoint || atomic_load(&run->work.task.skipped) > 0;
	if (next.attempts <= 1 || !further)
		return;
	next.attempts = 1;
	if (gnpd_job_commit(job, &next, NULL) != GNP_OK)
		return;
	pthread_mutex_lock(&jobs->lock);
	gnpd_job_trust(job);
	if (jobs->suspects)
		gnp_task_stop(&run->work.task, GNP_DRAINING);
	pthread_mutex_unlock(&jobs->lock);
}

/* While the new one is written the old one is there as well, but the quota counts one. */
static gnp_status save_checkpoint(void *context, const struct gnp_piece *pieces, size_t count, struct gnp_error *error)
{
	struct gnpd_run *run = context;
	size_t size = sum(pieces, count);
	struct gnp_error cause = {0};
	gnp_status status = gnpd_job_account(run->job, GNPD_JOB_CHECKPOINT_FILE, size, &cause);
	if (status == GNP_OK) {
		status = gnpd_job_store_put(&run->jobs->store, run->job->record.id, GNPD_JOB_CHECKPOINT_FILE, pieces, count, &cause);
		if (status == GNP_OK)
			run->checkpoint_bytes = size;
		else
			gnpd_job_account(run->job, GNPD_JOB_CHECKPOINT_FILE, run->checkpoint_bytes, NULL);
	}
	pthread_mutex_lock(&run->jobs->lock);
	run->jobs->counts.checkpoints += status == GNP_OK;
	pthread_mutex_unlock(&run->jobs->lock);
	if (status == GNP_OK) {
		prove(run);
		return GNP_OK;
	}
	gnpd_log_event(run->jobs->engine->log, GNPD_LOG_WARNING, "job %s: no checkpoint: %s", run->job->record.id,
	               cause.text);
	return gnp_error_set(error, status, "%s", cause.text);
}

/* ---- Beginning ---- */

static void set_work(struct gnpd_run *run)
{
	const struct gnpd_job_record *record = &run->job->record;
	struct gnpd_work *work = &run->work;
	const struct gnpd_config *config = run->jobs->engine->config;
	gnpd_work_init(work, run->jobs->engine, &run->reply);
	gnpd_job_gather_budget(run);
	work->codec = strcmp(record->codec, gnpd_codec_oip.name) == 0 ? &gnpd_codec_oip : &gnpd_codec_file;
	work->operation = gnp_operation_find(record->operation);
	work->query = record->query;
	work->content_type = record->content_type;
	work->content_encoding = record->content_encoding;
	work->accept = record->accept;
	work->inference_length = record->inference_length;
	run->checkpoint = (struct gnp_checkpoint){.seconds = config->jobs_checkpoint_seconds, .save = save_checkpoint, .context = run};
	work->checkpoint = &run->checkpoint;
	gnpd_work_begin(work, config->jobs_seconds, "jobs-seconds", NULL);
}

/* From here on the job can be stopped; what was asked for before holds. */
static void show_work(struct gnpd_run *run)
{
	struct gnpd_job *job = run->job;
	pthread_mutex_lock(&run->jobs->lock);
	job->began = gnp_clock();
	job->progress = (struct gnpd_job_progress){.eta = -1};
	job->work = &run->work;
	if (run->jobs->parking)
		gnp_task_stop(&run->work.task, GNP_DRAINING);
	if (job->cancelled)
		gnp_task_stop(&run->work.task, GNP_CANCELLED);
	pthread_mutex_unlock(&run->jobs->lock);
}

static void hide_work(struct gnpd_run *run)
{
	pthread_mutex_lock(&run->jobs->lock);
	run->job->work = NULL;
	pthread_mutex_unlock(&run->jobs->lock);
}

static gnp_status begin(struct gnpd_run *run, struct gnp_error *error)
{
	struct gnpd_job_record next = gnpd_job_record_now(run->job);
	size_t size = 0;
	next.state = GNPD_JOB_RUNNING;
	next.started = gnpd_clock_now();
	next.attempts++;
	int fd = gnpd_job_store_open_file(&run->jobs->store, next.id, GNPD_JOB_CHECKPOINT_FILE, &size);
	if (fd >= 0) {
		close(fd);
		run->checkpoint_bytes = size;
		run->had_checkpoint = true;
	}
	return gnpd_job_commit(run->job, &next, error);
}

/* ---- Ending ---- */

/* Every end is committed after its files are there and before those it no longer needs go. */
static void clean(struct gnpd_run *run)
{
	gnpd_job_let_go(run->job, GNPD_JOB_BODY_FILE, NULL);
	gnpd_job_let_go(run->job, GNPD_JOB_CHECKPOINT_FILE, NULL);
}

static const char *header_of(const struct gnpd_reply *reply, const char *name)
{
	for (size_t i = 0; i < reply->header_count; i++)
		if (strcmp(reply->headers[i].name, name) == 0)
			return reply->headers[i].value;
	return "";
}

static void hash_pieces(const struct gnp_piece *pieces, size_t count, const void **data, size_t *size, char text[GNP_SHA256_TEXT])
{
	for (size_t i = 0; i < count; i++) {
		data[i] = pieces[i].data;
		size[i] = pieces[i].size;
	}
	gnp_sha256_text(data, size, count, text);
}

/* What the answer says of itself; the strings become the record's with it. */
static gnp_status keep_report(const struct gnpd_run *run, struct gnpd_job_record *next, struct gnp_error *error)
{
	const char *warnings = gnp_warnings_of(&run->work.response.parameters);
	const struct gnp_buffer *parameters = &run->reply.parameters;
	next->result_warnings = *warnings ? strdup(warnings) : NULL;
	next->result_parameters = parameters->size ? strdup((const char *)parameters->data) : NULL;
	if ((*warnings && !next->result_warnings) || (parameters->size && !next->result_parameters))
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "result: no memory for its parameters");
	return GNP_OK;
}

static void drop_report(struct gnpd_job_record *next)
{
	free(next->result_warnings);
	free(next->result_parameters);
}

/* Writes the answer's body; next: receives what the record says of it. */
static gnp_status store_result(struct gnpd_run *run, struct gnpd_job_record *next, struct gnp_error *error)
{
	const struct gnpd_reply *reply = &run->reply;
	size_t count = reply->tail_count + 1;
	struct gnp_piece *pieces = calloc(count, sizeof *pieces);
	const void **data = calloc(count, sizeof *data);
	size_t *size = calloc(count, sizeof *size);
	gnp_status status = GNP_OUT_OF_MEMORY;
	if (!pieces || !data || !size) {
		gnp_error_set(error, status, "result: no memory for %zu pieces", count);
		goto done;
	}
	pieces[0] = (struct gnp_piece){reply->body.data, reply->body.size};
	for (size_t i = 1; i < count; i++)
		pieces[i] = (struct gnp_piece){reply->tails[i - 1]->data, reply->tails[i - 1]->size};
	hash_pieces(pieces, count, data, size, next->result_hash);
	next->result_bytes = sum(pieces, count);
	snprintf(next->result_type, sizeof next->result_type, "%s", reply->content_type);
	snprintf(next->result_inference_length, sizeof next->result_inference_length, "%.23s",
	         header_of(reply, "Inference-Header-Content-Length"));
	snprintf(next->result_timing, sizeof next->result_timing, "%s", header_of(reply, "Server-Timing"));
	status = gnpd_job_account(run->job, GNPD_JOB_RESULT_FILE, next->result_bytes, error);
	if (status != GNP_OK)
		goto done;
	status = gnpd_job_store_put(&run->jobs->store, next->id, GNPD_JOB_RESULT_FILE, pieces, count, error);
	if (status != GNP_OK)
		gnpd_job_account(run->job, GNPD_JOB_RESULT_FILE, 0, NULL);
done:
	free(pieces);
	free(data);
	free(size);
	return status;
}

static gnp_status succeed(struct gnpd_run *run, struct gnp_error *error)
{
	struct gnpd_job_record next = gnpd_job_record_now(run->job);
	gnp_status status = keep_report(run, &next, error);
	if (status == GNP_OK)
		status = store_result(run, &next, error);
	if (status != GNP_OK) {
		drop_report(&next);
		return status;
	}
	next.state = GNPD_JOB_SUCCEEDED;
	next.finished = gnpd_clock_now();
	next.attempts = 0;
	status = gnpd_job_commit(run->job, &next, error);
	if (status == GNP_OK)
		return GNP_OK;
	drop_report(&next);
	gnpd_job_let_go(run->job, GNPD_JOB_RESULT_FILE, NULL);
	return status;
}

/* Where even that it failed cannot be written the body stays, for a later process to try again; what was cancelled is not tried again, so
 * that its body may make room for the record. */
static void fail(struct gnpd_run *run, gnp_status status, const struct gnp_error *error)
{
	struct gnpd_job_record next = gnpd_job_record_now(run->job);
	next.finished = gnpd_clock_now();
	if (status == GNP_CANCELLED) {
		next.state = GNPD_JOB_CANCELLED;
	} else {
		next.state = GNPD_JOB_FAILED;
		next.error = status;
		snprintf(next.error_text, sizeof next.error_text, "%s", error->text);
	}
	bool written = gnpd_job_commit(run->job, &next, NULL) == GNP_OK;
	if (written || status == GNP_CANCELLED)
		clean(run);
	if (!written)
		gnpd_job_commit_anyway(run->job, &next);
}

/* As if this run had never been, but for its checkpoint: for the next process, or for when those it made way for are over. */
static void park(struct gnpd_run *run)
{
	struct gnpd_job_record next = gnpd_job_record_now(run->job);
	next.state = GNPD_JOB_QUEUED;
	next.started = 0;
	next.attempts--;
	gnpd_job_commit_anyway(run->job, &next);
}

static void end(struct gnpd_run *run, gnp_status status, struct gnp_error *error)
{
	const struct gnpd_engine *engine = run->jobs->engine;
	if (status == GNP_OK)
		status = succeed(run, error);
	if (status == GNP_OK)
		clean(run);
	else if (status == GNP_DRAINING)
		park(run);
	else
		fail(run, status, error);
	gnpd_metrics_stages(engine->metrics, &run->work.task);
	if (status == GNP_OK)
		atomic_fetch_add(&engine->metrics->points, run->work.call.points);
	enum gnpd_job_state state = gnpd_job_record_now(run->job).state;
	gnpd_log_event(engine->log, GNPD_LOG_INFO, "job %s: %s %s in %.3f s%s%s", run->job->record.id,
	               run->job->record.operation,
	               state == GNPD_JOB_QUEUED ? "parked" : gnpd_job_state_name(state), gnp_clock() - run->work.begun,
	               *error->text ? ": " : "", error->text);
}

/* ---- The run ---- */

static void run_job(struct gnpd_job *job)
{
	struct gnpd_run run = {.job = job, .jobs = job->jobs};
	struct gnp_error error = {0};
	gnp_status status = begin(&run, &error);
	set_work(&run);
	if (status == GNP_OK && !run.work.operation)
		status = gnp_error_set(&error, GNP_NOT_FOUND, "operation: there is no \"%s\" any more", job->record.operation);
	if (status == GNP_OK) {
		show_work(&run);
		status = gnpd_job_gather(&run, &error);
	}
	if (status == GNP_OK)
		status = gnpd_work_finish(&run.work, &error);
	if (status == GNP_DEADLINE)
		gnpd_work_overdue(&run.work, &error);
	hide_work(&run);
	end(&run, status, &error);
	gnpd_work_clear(&run.work);
	gnpd_job_gather_release(&run);
	gnpd_reply_clear(&run.reply);
	gnp_buffer_clear(&run.kept);
	if (status == GNP_DRAINING)
		gnpd_job_enqueue(job);
}

/* Lock held. In the order they came, of which the runners that hold them know nothing. */
static bool is_next_suspect(const struct gnpd_job *job)
{
	const struct gnpd_jobs *jobs = job->jobs;
	for (size_t i = 0; i < jobs->count && !jobs->alone; i++)
		if (jobs->items[i]->suspect)
			return jobs->items[i] == job;
	return false;
}

/* Waits while others have to be over first: a suspected job runs with no other beside it, so that of those that ran when a process died
 * only the one that did it is blamed again. False when it is not to run any more, or not here. */
static bool take_place(struct gnpd_job *job)
{
	struct gnpd_jobs *jobs = job->jobs;
	pthread_mutex_lock(&jobs->lock);
	while (!jobs->parking && !job->cancelled && (jobs->opening || (job->suspect ? !is_next_suspect(job) : jobs->suspects > 0)))
		pthread_cond_wait(&jobs->change, &jobs->lock);
	bool wanted = !jobs->parking && !job->cancelled;
	bool alone = wanted && job->suspect;
	if (alone) {
		jobs->alone = job;
		job->company = false;
		atomic_store(&jobs->has_alone, true);
	}
	pthread_mutex_unlock(&jobs->lock);
	if (alone && gnpd_queue_state(jobs->engine->queue).running > 0)
		gnpd_jobs_keep_company(jobs);
	return wanted;
}

void gnpd_job_run(struct gnpd_queued *queued)
{
	struct gnpd_job *job = GNPD_CONTAINER_OF(queued, struct gnpd_job, queued);
	if (take_place(job))
		run_job(job);
	else
		gnpd_job_leave(job);
	gnpd_job_release(job);
}
