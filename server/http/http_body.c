/* Takes the body of a request as it comes: keeps it within the limits, or drops it, and answers in its middle. */
#include "server/http/http_steps.h"

#include <stdlib.h>
#include <string.h>

#include "server/api/server.h"
#include "server/base/tls.h"
#include "server/config/config.h"
#include "server/http/connections.h"
#include "server/http/late_reply.h"

/* Refuses in the middle of the body: what was read is dropped, the rest is read and dropped as far as discard_bytes. */
static void refuse_body(struct gnpd_request *request, const struct gnp_error *error)
{
	gnp_buffer_clear(&request->work.body);
	gnpd_work_release(&request->work, request->work.reserved);
	gnpd_reply_error(request, error);
	request->step = GNPD_STEP_DISCARD;
}

/* Memory follows the bytes that have come, never the length that was promised. */
static gnp_status grow_body(struct gnpd_request *request, size_t size, struct gnp_error *error)
{
	enum { FIRST = 65536, TRUSTED = 1048576 };
	struct gnp_buffer *body = &request->work.body;
	size_t capacity = body->capacity ? 2 * body->capacity : FIRST;
	if (request->has_length && (request->content_length <= TRUSTED || capacity > request->content_length))
		capacity = request->content_length;
	if (capacity < body->size + size)
		capacity = body->size + size;
	gnp_status status = gnpd_work_reserve(&request->work, capacity - body->capacity, error);
	if (status != GNP_OK)
		return status;
	unsigned char *data = realloc(body->data, capacity);
	if (!data)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "body: no memory for %zu bytes", capacity);
	body->data = data;
	body->capacity = capacity;
	return GNP_OK;
}

static gnp_status append_body(struct gnpd_request *request, const char *data, size_t size, struct gnp_error *error)
{
	struct gnp_buffer *body = &request->work.body;
	size_t limit = request->server->engine.config->max_body_bytes;
	if (size > limit - body->size) {
		gnpd_metrics_reject(request->server->engine.metrics, GNPD_REJECT_BODY_LIMIT);
		return gnp_error_set(error, GNP_TOO_LARGE, "body: got more than %zu bytes, need at most that (max-body-bytes)", limit);
	}
	gnp_status status = size > body->capacity - body->size ? grow_body(request, size, error) : GNP_OK;
	if (status != GNP_OK)
		return status;
	memcpy(body->data + body->size, data, size);
	body->size += size;
	return GNP_OK;
}

/* Under TLS the answer goes through the session, on this thread, which serves it. */
void gnpd_http_cut(struct gnpd_request *request, const struct gnp_error *error)
{
	const union MHD_ConnectionInfo *information = MHD_get_connection_info(request->http, MHD_CONNECTION_INFO_GNUTLS_SESSION);
	struct gnp_buffer answer = {0};
	double retry_after = request->server->engine.config->retry_after_seconds;
	if (information && information->tls_session && gnpd_late_reply(error, request->id, retry_after, &answer) == GNP_OK)
		gnpd_tls_send_last(information->tls_session, answer.data, answer.size);
	gnp_buffer_clear(&answer);
	gnpd_connection_cut(request->server->connections, request->connection, error);
}

/* Under TLS through the session, on this thread, which serves it. False: the connection has ended. */
static bool answer_at_once(struct gnpd_request *request)
{
	const union MHD_ConnectionInfo *information = MHD_get_connection_info(request->http, MHD_CONNECTION_INFO_GNUTLS_SESSION);
	bool tls = information && information->tls_session;
	struct gnp_buffer answer = {0};
	bool whole = gnpd_http_reply_text(request, &answer) == GNP_OK;
	if (whole && tls)
		gnpd_tls_send_last(information->tls_session, answer.data, answer.size);
	whole = whole && gnpd_connection_half_close(request->server->connections, request->connection, answer.data, tls ? 0 : answer.size);
	gnp_buffer_clear(&answer);
	return whole;
}

enum MHD_Result gnpd_http_linger(struct gnpd_request *request)
{
	request->step = GNPD_STEP_LINGER;
	request->reply.close = true;
	gnpd_request_leave(request);
	if (request->active) /* the end of the daemon does not wait for what is only dropped */
		atomic_fetch_sub(&request->server->active, 1);
	request->active = false;
	return answer_at_once(request) ? MHD_YES : MHD_NO;
}

enum MHD_Result gnpd_http_body(struct gnpd_request *request, const char *data, size_t size)
{
	struct gnp_error error = {0};
	request->received += size;
	if (request->step == GNPD_STEP_LINGER) {
		request->lingered += size;
		return request->lingered <= request->server->engine.config->linger_bytes ? MHD_YES : MHD_NO;
	}
	gnpd_connection_received(request->server->connections, request->connection, request->received);
	if (request->step == GNPD_STEP_BODY && append_body(request, data, size, &error) != GNP_OK)
		refuse_body(request, &error);
	else if (request->step == GNPD_STEP_DISCARD)
		request->discarded += size;
	if (request->discarded <= request->server->engine.config->discard_bytes)
		return MHD_YES;
	if (request->reply.code == 0) {
		gnp_error_set(&error, GNP_TOO_LARGE, "body: this path takes none, got %zu bytes", request->received);
		gnpd_reply_error(request, &error);
	}
	return gnpd_http_linger(request);
}
