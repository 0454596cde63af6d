/* Sends the reply of a request, and is the one place that logs, counts and frees a request. */
#include "server/http/http_steps.h"

#include <stdlib.h>
#include <string.h>

#include "server/api/routes.h"
#include "server/api/server.h"
#include "server/base/log.h"
#include "server/config/config.h"
#include "server/http/connections.h"
#include "server/http/http_stream.h"

static struct MHD_Response *make_response(struct gnpd_request *request)
{
	struct gnpd_reply *reply = &request->reply;
	if (reply->stream)
		return gnpd_http_stream_response(request);
	if (reply->has_file) {
		struct MHD_Response *response = MHD_create_response_from_fd_at_offset64(reply->file_size, reply->file, reply->file_offset);
		reply->has_file = !response; /* the response closes it */
		return response;
	}
	if (reply->tail_count == 0)
		return MHD_create_response_from_buffer(reply->body.size, reply->body.data, MHD_RESPMEM_PERSISTENT);
	struct MHD_IoVec *pieces = calloc(reply->tail_count + 1, sizeof *pieces);
	if (!pieces)
		return NULL;
	unsigned count = 0;
	pieces[count++] = (struct MHD_IoVec){reply->body.data, reply->body.size};
	for (size_t i = 0; i < reply->tail_count; i++)
		if (reply->tails[i]->size)
			pieces[count++] = (struct MHD_IoVec){reply->tails[i]->data, reply->tails[i]->size};
	struct MHD_Response *response = MHD_create_response_from_iovec(pieces, count, NULL, NULL);
	free(pieces);
	return response;
}

/* False when there is no memory for one of them. */
static bool add_headers(struct MHD_Response *response, const struct gnpd_request *request)
{
	const struct gnpd_reply *reply = &request->reply;
	bool close = reply->close || atomic_load(&request->server->leaving);
	bool added = MHD_add_response_header(response, "X-Request-Id", request->id) == MHD_YES;
	if (reply->content_type)
		added &= MHD_add_response_header(response, MHD_HTTP_HEADER_CONTENT_TYPE, reply->content_type) == MHD_YES;
	for (size_t i = 0; i < reply->header_count; i++)
		added &= MHD_add_response_header(response, reply->headers[i].name, reply->headers[i].value) == MHD_YES;
	if (reply->parameters.size)
		added &= MHD_add_response_header(response, "X-Gnpd-Parameters", (const char *)reply->parameters.data) == MHD_YES;
	if (close)
		added &= MHD_add_response_header(response, MHD_HTTP_HEADER_CONNECTION, "close") == MHD_YES;
	return added;
}

/* The reply's data lives as long as the request, which outlives the response: completion comes after the last byte. */
enum MHD_Result gnpd_http_reply(struct gnpd_request *request)
{
	struct gnpd_reply *reply = &request->reply;
	struct MHD_Response *response = make_response(request);
	if (!response)
		return MHD_NO;
	if (!add_headers(response, request)) {
		MHD_destroy_response(response);
		return MHD_NO;
	}
	request->step = GNPD_STEP_SENT;
	gnpd_request_leave(request);
	gnpd_connection_enter(request->server->connections, request->connection, reply->stream ? GNPD_PHASE_STREAM : GNPD_PHASE_REPLY, request);
	enum MHD_Result result = MHD_queue_response(request->http, (unsigned)reply->code, response);
	MHD_destroy_response(response);
	return result;
}

gnp_status gnpd_http_reply_text(const struct gnpd_request *request, struct gnp_buffer *text)
{
	const struct gnpd_reply *reply = &request->reply;
	gnp_status status = gnp_buffer_printf(text, NULL, "HTTP/1.1 %d %s\r\nX-Request-Id: %s\r\nContent-Type: %s\r\n", reply->code,
	                                      MHD_get_reason_phrase_for((unsigned)reply->code), request->id, reply->content_type);
	for (size_t i = 0; i < reply->header_count && status == GNP_OK; i++)
		status = gnp_buffer_printf(text, NULL, "%s: %s\r\n", reply->headers[i].name, reply->headers[i].value);
	if (status == GNP_OK)
		status = gnp_buffer_printf(text, NULL, "Content-Length: %zu\r\nConnection: close\r\n\r\n", reply->body.size);
	if (status == GNP_OK && strcmp(request->method, "HEAD") != 0)
		status = gnp_buffer_append(text, reply->body.data, reply->body.size, NULL);
	return status;
}

static void log_request(const struct gnpd_request *request, double seconds)
{
	const struct gnpd_access access = {
		.id = request->id, .remote = gnpd_connection_remote(request->connection), .method = request->method,
		.path = request->target.path, .principal = request->principal, .code_name = gnp_status_name(request->status),
		.status = request->reply.code,
		.bytes_in = request->received, .bytes_out = gnpd_reply_size(&request->reply), .points = request->work.call.points,
		.seconds = seconds, .waited = request->waited};
	gnpd_log_access(request->server->engine.log, &access);
}

static bool is_sent(const struct gnpd_request *request)
{
	return request->step == GNPD_STEP_SENT || request->step == GNPD_STEP_LINGER;
}

/* The code of an answer the library gave by itself to what it could not read; 0: none. */
static int library_answered(const struct gnpd_request *request)
{
	const union MHD_ConnectionInfo *information = MHD_get_connection_info(request->http, MHD_CONNECTION_INFO_HTTP_STATUS);
	return !is_sent(request) && information ? (int)information->http_status : 0;
}

/* Only here is known whether the answer went out whole. A stream may end at any time; an error stays what it is. */
static void settle(struct gnpd_request *request, enum MHD_RequestTerminationCode end)
{
	struct gnpd_reply *reply = &request->reply;
	bool sent = is_sent(request) && reply->code;
	if (sent && (end == MHD_REQUEST_TERMINATED_COMPLETED_OK || reply->stream || request->status != GNP_OK))
		return;
	reply->code = library_answered(request);
	if (reply->code) {
		gnpd_metrics_reject(request->server->engine.metrics, GNPD_REJECT_FRAMING);
		request->status = reply->code == 413 ? GNP_TOO_LARGE : GNP_INVALID_ARGUMENT;
		return;
	}
	gnp_status reason = gnpd_connection_cut_reason(request->server->connections, request->connection);
	request->status = reason == GNP_OK ? GNP_CANCELLED : reason;
	reply->code = gnp_status_http(request->status);
}

void gnpd_http_finish(struct gnpd_request *request, enum MHD_RequestTerminationCode end)
{
	struct gnpd_server *server = request->server;
	double seconds = gnp_clock() - request->started;
	settle(request, end);
	gnpd_metrics_request(server->engine.metrics, request->label, request->reply.code, seconds);
	gnpd_metrics_stages(server->engine.metrics, &request->work.task);
	atomic_fetch_add(&server->engine.metrics->bytes_in, request->received);
	atomic_fetch_add(&server->engine.metrics->bytes_out, gnpd_reply_size(&request->reply));
	if (request->status == GNP_OK && request->route && request->route->work == GNPD_ON_RUNNER)
		atomic_fetch_add(&server->engine.metrics->points, request->work.call.points);
	if (request->who)
		gnpd_principal_count(request->who, request->reply.code, request->status == GNP_OK ? request->work.call.points : 0);
	if (server->engine.config->access_log)
		log_request(request, seconds);
	gnpd_connection_enter(server->connections, request->connection, GNPD_PHASE_IDLE, NULL);
	if (request->active)
		atomic_fetch_sub(&server->active, 1);
	gnpd_request_free(request);
}

