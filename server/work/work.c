#include "server/work/work.h"

#include <stdio.h>
#include <string.h>

#include "proto/file/content_encoding.h"
#include "proto/file/formats.h"
#include "proto/oip/oip.h"
#include "proto/operation/call.h"
#include "proto/tensor/warnings.h"
#include "server/base/metrics.h"
#include "server/base/queue.h"
#include "server/config/config.h"
#include "server/parse/duration.h"
#include "server/parse/target.h"
#include "server/work/codec_file.h"
#include "server/work/codec_oip.h"
#include "server/work/engine.h"
#include "server/work/loader.h"

/* No deflate stream expands more than 1032 times. */
enum { EXPANSION_MAX = 1032 };

static gnp_status take_bytes(void *context, size_t bytes, struct gnp_error *error)
{
	struct gnpd_work *work = context;
	gnp_status status = gnpd_work_reserve(work, bytes, error);
	work->out_of_bytes = status != GNP_OK;
	return status;
}

static void give_bytes(void *context, size_t bytes)
{
	gnpd_work_release(context, bytes);
}

void gnpd_work_init(struct gnpd_work *work, const struct gnpd_engine *engine, struct gnpd_reply *reply)
{
	memset(work, 0, sizeof *work);
	work->engine = engine;
	work->reply = reply;
	work->models = gnpd_loader_models(engine->loader);
	work->budget = (struct gnp_budget){take_bytes, give_bytes, work};
	gnp_task_init(&work->task);
}

void gnpd_work_clear(struct gnpd_work *work)
{
	gnpd_work_release(work, work->reserved);
	gnp_response_clear(&work->response);
	gnp_request_clear(&work->message);
	gnp_buffer_clear(&work->decoded);
	gnp_buffer_clear(&work->body);
	gnp_models_release(work->models);
	work->models = NULL;
}

gnp_status gnpd_work_reserve(struct gnpd_work *work, size_t bytes, struct gnp_error *error)
{
	size_t limit = work->engine->config->request_memory_bytes;
	if (work->reserved > limit || bytes > limit - work->reserved) {
		gnpd_metrics_reject(work->engine->metrics, GNPD_REJECT_REQUEST_MEMORY);
		return gnp_error_set(error, GNP_TOO_LARGE,
		                     "memory: the request holds %zu bytes and needs %zu more, need at most %zu (request-memory-bytes)",
		                     work->reserved, bytes, limit);
	}
	gnp_status status = gnpd_queue_reserve(work->engine->queue, work->reserved, bytes, error);
	if (status == GNP_OK)
		work->reserved += bytes;
	else
		gnpd_metrics_reject(work->engine->metrics, GNPD_REJECT_QUEUE_BYTES);
	if (work->reserved > work->peak)
		work->peak = work->reserved;
	return status;
}

void gnpd_work_release(struct gnpd_work *work, size_t bytes)
{
	gnpd_queue_release(work->engine->queue, bytes);
	work->reserved -= bytes;
}

/* ---- Time limits ---- */

static void lower_deadline(struct gnpd_work *work, double seconds)
{
	double until = work->begun + seconds;
	if (!(seconds > 0 && until < atomic_load(&work->deadline)))
		return;
	atomic_store(&work->deadline, until);
	work->allowed = seconds;
	work->limit = "timeout";
}

/* What is wrong with the query, decoding says. */
static double query_timeout(const char *query)
{
	struct gnp_values values = {0};
	double seconds = 0;
	if (gnpd_query_parse(query, &values, NULL) == GNP_OK) {
		const struct gnp_value *value = gnp_values_find(&values, "timeout");
		if (value)
			gnpd_duration_parse("timeout", value->string, &seconds, NULL);
	}
	gnp_values_clear(&values);
	return seconds;
}

void gnpd_work_begin(struct gnpd_work *work, double seconds, const char *limit, const char *query)
{
	work->begun = gnp_clock();
	work->allowed = seconds;
	work->limit = limit;
	atomic_store(&work->deadline, work->begun + seconds);
	if (query)
		lower_deadline(work, query_timeout(query));
}

void gnpd_work_overdue(const struct gnpd_work *work, struct gnp_error *error)
{
	*error = (struct gnp_error){0};
	gnp_error_set(error, GNP_DEADLINE, "time: not done after %.3g s, need it in %.3g s (%s)", gnp_clock() - work->begun,
	              work->allowed, work->limit);
}

static gnp_status apply_timeout(struct gnpd_work *work, struct gnp_error *error)
{
	const struct gnp_value *value = gnp_values_find(&work->message.parameters, "timeout");
	double seconds = 0;
	gnp_status status = value ? work->codec->timeout(value, &seconds, error) : GNP_OK;
	if (status == GNP_OK)
		lower_deadline(work, seconds);
	return status;
}

/* ---- The way through ---- */

/* Undoes the content encoding. The most it can become is reserved first and what was not needed given back. */
static gnp_status decompress(struct gnpd_work *work, struct gnp_error *error)
{
	const struct gnpd_engine *engine = work->engine;
	const struct gnpd_config *config = engine->config;
	size_t limit = config->max_decoded_bytes ? config->max_decoded_bytes : config->max_body_bytes, most = limit;
	if (work->body.size < limit / EXPANSION_MAX)
		most = (work->body.size + 1) * EXPANSION_MAX;
	gnp_status status = gnp_budget_reserve(&work->budget, most, error);
	if (status != GNP_OK)
		return status;
	status = gnp_content_decode(work->content_encoding, work->body.data, work->body.size, most, &work->decoded, error);
	if (status == GNP_TOO_LARGE)
		gnpd_metrics_reject(engine->metrics, GNPD_REJECT_BODY_LIMIT);
	if (status == GNP_OK && work->decoded.capacity < most)
		gnp_budget_release(&work->budget, most - work->decoded.capacity);
	return status;
}

/* The Open Inference Protocol where its header is there, or a body is one of its requests that is called JSON or no format at all, as by
 * clients that say nothing or what they say of any body; files else. */
static const struct gnpd_codec *choose_codec(const struct gnpd_work *work, const unsigned char *body, size_t size)
{
	const struct gnp_format *format;
	bool named = work->content_type && gnp_format_by_media_type(work->content_type, &format);
	if (work->inference_length || ((!named || format == &gnp_format_json) && gnp_oip_is_request(body, size)))
		return &gnpd_codec_oip;
	return &gnpd_codec_file;
}

/* Counts a refusal for too many points, or too much around them; one for memory was counted when it was asked for. */
static gnp_status count_points(const struct gnpd_work *work, gnp_status status)
{
	if (status == GNP_TOO_LARGE && !work->out_of_bytes)
		gnpd_metrics_reject(work->engine->metrics, GNPD_REJECT_POINTS);
	return status;
}

static gnp_status decode(struct gnpd_work *work, struct gnp_error *error)
{
	const struct gnp_buffer *body = &work->body;
	gnp_status status = GNP_OK;
	gnp_task_stage(&work->task, GNP_STAGE_DECODE, 0);
	if (body->size == 0)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "body: got 0 bytes, need a point cloud");
	if (work->content_encoding) {
		status = decompress(work, error);
		body = &work->decoded;
	}
	if (status != GNP_OK)
		return status;
	if (!work->codec)
		work->codec = choose_codec(work, body->data, body->size);
	work->message.inputs.budget = &work->budget;
	return count_points(work, work->codec->decode(work, body->data, body->size, error));
}

/* Seconds of each stage, for whoever asks where the time goes. */
static void add_timing(struct gnpd_work *work)
{
	char text[256] = "";
	size_t size = 0;
	for (int i = 0; i < GNP_STAGE_DONE; i++)
		if (work->task.seconds[i] > 0 && size < sizeof text - 1)
			size += (size_t)snprintf(text + size, sizeof text - size, "%s%s;dur=%.3f", size ? ", " : "",
			                         gnp_stage_name((enum gnp_stage)i), 1e3 * work->task.seconds[i]);
	gnpd_reply_add(work->reply, "Server-Timing", "%s", text);
}

gnp_status gnpd_work_check(struct gnpd_work *work, struct gnp_error *error)
{
	const struct gnpd_engine *engine = work->engine;
	const struct gnp_limits limits = {.points = engine->config->max_points, .models = work->models,
	                                  .cache = engine->cache};
	gnp_status status = decode(work, error);
	if (status == GNP_OK)
		status = apply_timeout(work, error);
	if (status == GNP_OK)
		status = count_points(work, gnp_call_prepare(work->operation, &work->message, &limits, &work->call, error));
	if (status == GNP_OK && work->codec->plan)
		status = work->codec->plan(work, error);
	work->call.checkpoint = work->checkpoint;
	return status;
}

gnp_status gnpd_work_prepare(struct gnpd_work *work, struct gnp_error *error)
{
	gnp_status status = gnpd_work_check(work, error);
	return status == GNP_OK ? gnpd_work_reserve(work, work->call.memory, error) : status;
}

gnp_status gnpd_work_finish(struct gnpd_work *work, struct gnp_error *error)
{
	gnp_status status = gnp_call_run(&work->call, work->engine->pool, &work->task, &work->response, error);
	gnp_task_stage(&work->task, GNP_STAGE_ENCODE, 0);
	if (status == GNP_OK)
		status = gnp_task_check(&work->task, error);
	if (status == GNP_OK)
		status = work->codec->encode(work, error);
	gnp_task_stage(&work->task, GNP_STAGE_DONE, 0);
	if (status == GNP_OK) {
		work->reply->code = 200;
		add_timing(work);
		gnpd_reply_add(work->reply, "X-Gnpd-Warnings", "%zu", gnp_warnings_joined_count(gnp_warnings_of(&work->response.parameters)));
	}
	return status;
}

gnp_status gnpd_work_run(struct gnpd_work *work, struct gnp_error *error)
{
	gnp_status status = gnpd_work_prepare(work, error);
	if (status == GNP_OK)
		return gnpd_work_finish(work, error);
	gnp_task_stage(&work->task, GNP_STAGE_DONE, 0);
	return status;
}
