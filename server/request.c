#include "request.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "oip.h"
#include "routes.h"
#include "server.h"

/* For the body of an error with its status's own sentence. */
enum { SPARE_BYTES = 512 };

struct gnpd_request *gnpd_request_create(struct gnpd_server *server, const char *uri)
{
	struct gnpd_request *request = calloc(1, sizeof *request);
	if (!request)
		return NULL;
	request->server = server;
	request->started = gnp_clock();
	gnp_task_init(&request->task);
	gnpd_request_set_id(request, NULL);
	if (gnp_buffer_reserve(&request->spare, SPARE_BYTES, NULL) != GNP_OK || gnpd_target_parse(uri, &request->target) != GNP_OK) {
		gnp_buffer_clear(&request->spare);
		free(request);
		return NULL;
	}
	request->models = gnpd_loader_models(server->loader);
	return request;
}

static void reply_clear(struct gnpd_reply *reply)
{
	gnp_buffer_clear(&reply->body);
	free(reply->tails);
	memset(reply, 0, sizeof *reply);
}

void gnpd_request_leave(struct gnpd_request *request)
{
	if (request->entered)
		gnpd_principal_leave(request->who);
	request->entered = false;
}

void gnpd_request_free(struct gnpd_request *request)
{
	if (!request)
		return;
	gnpd_request_release(request, request->reserved);
	gnpd_request_leave(request);
	gnpd_principal_release(request->who);
	reply_clear(&request->reply);
	gnp_buffer_clear(&request->spare);
	gnp_response_clear(&request->response);
	gnp_request_clear(&request->message);
	gnp_buffer_clear(&request->decoded);
	gnp_buffer_clear(&request->body);
	gnpd_target_clear(&request->target);
	gnp_models_release(request->models);
	free(request);
}

void gnpd_request_set_id(struct gnpd_request *request, const char *id)
{
	static const char allowed[] = "0123456789abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ._:-";
	size_t length = id ? strlen(id) : 0;
	if (length >= 1 && length <= GNPD_ID_MAX && strspn(id, allowed) == length) {
		memcpy(request->id, id, length + 1);
		return;
	}
	if (request->id[0])
		return;
	snprintf(request->id, sizeof request->id, "%08x-%08llx", request->server->boot,
	         (unsigned long long)atomic_fetch_add(&request->server->requests, 1));
}

gnp_status gnpd_request_reserve(struct gnpd_request *request, size_t bytes, struct gnp_error *error)
{
	size_t limit = request->server->config->request_memory_bytes;
	if (bytes > limit - request->reserved) {
		gnpd_metrics_reject(&request->server->metrics, GNPD_REJECT_REQUEST_MEMORY);
		return gnp_error_set(error, GNP_TOO_LARGE,
		                     "memory: the request holds %zu bytes and needs %zu more, need at most %zu (request-memory-bytes)",
		                     request->reserved, bytes, limit);
	}
	gnp_status status = gnpd_queue_reserve(request->server->queue, request->reserved, bytes, error);
	if (status == GNP_OK)
		request->reserved += bytes;
	else
		gnpd_metrics_reject(&request->server->metrics, GNPD_REJECT_QUEUE_BYTES);
	return status;
}

void gnpd_request_release(struct gnpd_request *request, size_t bytes)
{
	gnpd_queue_release(request->server->queue, bytes);
	request->reserved -= bytes;
}

void gnpd_reply_header(struct gnpd_request *request, const char *name, const char *format, ...)
{
	struct gnpd_reply *reply = &request->reply;
	if (reply->header_count == GNPD_REPLY_HEADERS_MAX)
		return;
	va_list arguments;
	va_start(arguments, format);
	vsnprintf(reply->headers[reply->header_count].value, sizeof reply->headers[0].value, format, arguments);
	va_end(arguments);
	reply->headers[reply->header_count++].name = name;
}

void gnpd_reply_error(struct gnpd_request *request, const struct gnp_error *error)
{
	gnp_status status = error->status == GNP_OK ? GNP_INTERNAL : error->status;
	bool close = request->reply.close;
	reply_clear(&request->reply);
	request->status = status;
	request->reply.close = close;
	request->reply.code = gnp_status_http(status);
	request->reply.content_type = "application/json";
	if (request->reply.code == 503 || request->reply.code == 429)
		gnpd_reply_header(request, "Retry-After", "%.0f",
		                  request->retry_after > 0 ? ceil(request->retry_after) : request->server->config->retry_after_seconds);
	if (status == GNP_UNAUTHORIZED)
		gnpd_reply_header(request, "WWW-Authenticate", "Bearer");
	if (status == GNP_METHOD_NOT_ALLOWED) {
		char allowed[64];
		gnpd_routes_allow(request, allowed, sizeof allowed);
		gnpd_reply_header(request, "Allow", "%s", allowed);
	}
	if (gnp_oip_error_body(status, error->text[0] ? error->text : gnp_status_text(status), request->id, &request->reply.body) == GNP_OK)
		return;
	gnp_buffer_clear(&request->reply.body);
	request->reply.body = request->spare;
	request->spare = (struct gnp_buffer){0};
	gnp_oip_error_body(status, gnp_status_text(status), request->id, &request->reply.body);
}

size_t gnpd_reply_size(const struct gnpd_request *request)
{
	size_t size = request->reply.body.size;
	for (size_t i = 0; i < request->reply.tail_count; i++)
		size += request->reply.tails[i]->size;
	return size;
}
