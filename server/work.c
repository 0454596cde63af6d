#include "work.h"

#include <stdio.h>
#include <string.h>

#include "content_encoding.h"
#include "server.h"

/* No deflate stream expands more than 1032 times. */
enum { EXPANSION_MAX = 1032 };

/* Undoes the content encoding. The most it can become is reserved first and what was not needed given back. */
static gnp_status decompress(struct gnpd_request *request, struct gnp_error *error)
{
	struct gnpd_server *server = request->server;
	size_t limit = server->config->max_decoded_bytes ? server->config->max_decoded_bytes : server->config->max_body_bytes, most = limit;
	if (request->body.size < limit / EXPANSION_MAX)
		most = (request->body.size + 1) * EXPANSION_MAX;
	gnp_status status = gnpd_request_reserve(request, most, error);
	if (status != GNP_OK)
		return status;
	status = gnp_content_decode(request->content_encoding, request->body.data, request->body.size, limit,
	                            &request->decoded, error);
	if (status == GNP_TOO_LARGE)
		gnpd_metrics_reject(&server->metrics, GNPD_REJECT_BODY_LIMIT);
	if (status == GNP_OK && request->decoded.capacity < most)
		gnpd_request_release(request, most - request->decoded.capacity);
	return status;
}

/* Counts a refusal for too many points, or too much around them. */
static gnp_status count_points(struct gnpd_request *request, gnp_status status)
{
	if (status == GNP_TOO_LARGE)
		gnpd_metrics_reject(&request->server->metrics, GNPD_REJECT_POINTS);
	return status;
}

static gnp_status decode(struct gnpd_request *request, const struct gnpd_codec *codec, struct gnp_error *error)
{
	gnp_task_stage(&request->task, GNP_STAGE_DECODE, 0);
	if (request->body.size == 0)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "body: got 0 bytes, need a point cloud");
	if (!request->content_encoding)
		return count_points(request, codec->decode(request, request->body.data, request->body.size, error));
	gnp_status status = decompress(request, error);
	return status == GNP_OK ? count_points(request, codec->decode(request, request->decoded.data, request->decoded.size, error))
	                        : status;
}

/* Seconds of each stage, for whoever asks where the time goes. */
static void add_timing(struct gnpd_request *request)
{
	char text[256] = "";
	size_t size = 0;
	for (int i = 0; i < GNP_STAGE_DONE; i++)
		if (request->task.seconds[i] > 0 && size < sizeof text - 1)
			size += (size_t)snprintf(text + size, sizeof text - size, "%s%s;dur=%.3f", size ? ", " : "",
			                         gnp_stage_name((enum gnp_stage)i), 1e3 * request->task.seconds[i]);
	gnpd_reply_header(request, "Server-Timing", "%s", text);
}

gnp_status gnpd_work_run(struct gnpd_request *request, const struct gnpd_codec *codec, struct gnp_error *error)
{
	struct gnpd_server *server = request->server;
	const struct gnp_operation *operation = gnp_operation_find(request->model);
	const struct gnp_limits limits = {.points = server->config->max_points, .models = request->models,
	                                 .cache = server->cache};
	gnp_status status = decode(request, codec, error);
	if (status == GNP_OK)
		status = count_points(request, gnp_call_prepare(operation, &request->message, &limits, &request->call, error));
	if (status == GNP_OK)
		status = gnpd_request_reserve(request, request->call.memory, error);
	if (status == GNP_OK)
		status = gnp_call_run(&request->call, server->pool, &request->task, &request->response, error);
	gnp_task_stage(&request->task, GNP_STAGE_ENCODE, 0);
	if (status == GNP_OK)
		status = gnp_task_check(&request->task, error);
	if (status == GNP_OK)
		status = codec->encode(request, error);
	gnp_task_stage(&request->task, GNP_STAGE_DONE, 0);
	if (status == GNP_OK) {
		request->reply.code = 200;
		add_timing(request);
	}
	return status;
}
