#include "http.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <gnutls/abstract.h>
#include <gnutls/gnutls.h>
#include <math.h>
#include <microhttpd.h>
#include <netinet/in.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/socket.h>
#include <unistd.h>

#include "admit.h"
#include "http_loop.h"
#include "http_stream.h"
#include "request.h"
#include "routes.h"
#include "strict.h"

/* A thread of a listener, with its share of the connections. */
struct lane {
	struct gnpd_http *http;
	struct MHD_Daemon *daemon;
	struct gnpd_http_loop *loop;
};

/* One listener. */
struct gnpd_http {
	struct gnpd_server *server;
	bool admin, tls;
	size_t count;
	struct lane lanes[]; /* (count) */
};

static struct gnpd_connection *connection_of(struct MHD_Connection *http)
{
	const union MHD_ConnectionInfo *information = MHD_get_connection_info(http, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
	return information ? information->socket_context : NULL;
}

/* ---- the end of a request: the one place that logs, counts and frees ---- */

static void log_request(const struct gnpd_request *request, double seconds)
{
	const struct gnpd_access access = {
		.id = request->id, .remote = gnpd_connection_remote(request->connection), .method = request->method,
		.path = request->target.path, .principal = request->principal, .code_name = gnp_status_name(request->status), .status = request->reply.code,
		.bytes_in = request->received, .bytes_out = gnpd_reply_size(&request->reply), .points = request->work.call.points,
		.seconds = seconds, .waited = request->waited};
	gnpd_log_access(&request->server->log, &access);
}

static void finish_request(struct gnpd_request *request)
{
	struct gnpd_server *server = request->server;
	double seconds = gnp_clock() - request->started;
	if (request->reply.code == 0) {
		gnp_status reason = gnpd_connection_cut_reason(server->reaper, request->connection);
		request->status = reason == GNP_OK ? GNP_CANCELLED : reason;
		request->reply.code = gnp_status_http(request->status);
	}
	gnpd_metrics_request(&server->metrics, request->label, request->reply.code, seconds);
	gnpd_metrics_stages(&server->metrics, &request->work.task);
	atomic_fetch_add(&server->metrics.bytes_in, request->received);
	atomic_fetch_add(&server->metrics.bytes_out, gnpd_reply_size(&request->reply));
	if (request->status == GNP_OK && request->route && request->route->work == GNPD_ON_RUNNER)
		atomic_fetch_add(&server->metrics.points, request->work.call.points);
	if (request->who)
		gnpd_principal_count(request->who, request->reply.code, request->status == GNP_OK ? request->work.call.points : 0);
	if (server->config->access_log)
		log_request(request, seconds);
	gnpd_connection_enter(server->reaper, request->connection, GNPD_PHASE_IDLE, NULL);
	if (request->active)
		atomic_fetch_sub(&server->active, 1);
	gnpd_request_free(request);
}

static void on_completed(void *context, struct MHD_Connection *http, void **request, enum MHD_RequestTerminationCode code)
{
	(void)context, (void)http, (void)code;
	if (*request)
		finish_request(*request);
	*request = NULL;
}

/* ---- connections ---- */

static void format_remote(struct MHD_Connection *http, char *text, socklen_t capacity)
{
	const union MHD_ConnectionInfo *information = MHD_get_connection_info(http, MHD_CONNECTION_INFO_CLIENT_ADDRESS);
	const struct sockaddr *address = information ? information->client_addr : NULL;
	text[0] = '\0';
	if (address && address->sa_family == AF_INET)
		inet_ntop(AF_INET, &((const struct sockaddr_in *)address)->sin_addr, text, capacity);
	else if (address && address->sa_family == AF_INET6)
		inet_ntop(AF_INET6, &((const struct sockaddr_in6 *)address)->sin6_addr, text, capacity);
}

static void on_connection(void *context, struct MHD_Connection *http, void **slot, enum MHD_ConnectionNotificationCode code)
{
	const struct gnpd_http *listener = context;
	struct gnpd_server *server = listener->server;
	if (code == MHD_CONNECTION_NOTIFY_STARTED) {
		const union MHD_ConnectionInfo *information = MHD_get_connection_info(http, MHD_CONNECTION_INFO_CONNECTION_FD);
		struct gnpd_origin origin = {.tls = listener->tls, .admin = listener->admin};
		format_remote(http, origin.remote, sizeof origin.remote);
		*slot = information ? gnpd_connection_open(server->reaper, information->connect_fd, &origin) : NULL;
		if (information && !*slot) /* nobody would watch over it */
			shutdown(information->connect_fd, SHUT_RDWR);
	} else if (*slot) {
		gnpd_connection_close(server->reaper, *slot);
		*slot = NULL;
	}
}

/* ---- replies ---- */

static struct MHD_Response *make_response(struct gnpd_request *request)
{
	struct gnpd_reply *reply = &request->reply;
	if (reply->stream)
		return gnpd_http_stream_response(request);
	if (reply->has_file) {
		reply->has_file = false; /* the response closes it */
		return MHD_create_response_from_fd_at_offset64(reply->file_size, reply->file, reply->file_offset);
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

/* The reply's data lives as long as the request, which outlives the response: completion comes after the last byte. */
static enum MHD_Result send_reply(struct gnpd_request *request)
{
	struct gnpd_reply *reply = &request->reply;
	struct MHD_Response *response = make_response(request);
	if (!response)
		return MHD_NO;
	if (reply->content_type)
		MHD_add_response_header(response, MHD_HTTP_HEADER_CONTENT_TYPE, reply->content_type);
	MHD_add_response_header(response, "X-Request-Id", request->id);
	for (size_t i = 0; i < reply->header_count; i++)
		MHD_add_response_header(response, reply->headers[i].name, reply->headers[i].value);
	if (reply->close)
		MHD_add_response_header(response, MHD_HTTP_HEADER_CONNECTION, "close");
	request->step = GNPD_STEP_SENT;
	gnpd_request_leave(request);
	gnpd_connection_enter(request->server->reaper, request->connection, reply->stream ? GNPD_PHASE_STREAM : GNPD_PHASE_REPLY, request);
	enum MHD_Result result = MHD_queue_response(request->http, (unsigned)reply->code, response);
	MHD_destroy_response(response);
	return result;
}

static enum MHD_Result send_error(struct gnpd_request *request, const struct gnp_error *error)
{
	gnpd_reply_error(request, error);
	return send_reply(request);
}

/* ---- work on a runner ---- */

static void run_handler(struct gnpd_request *request, gnpd_handler handler)
{
	struct gnp_error error = {0};
	gnp_status status = gnp_task_check(&request->work.task, &error);
	if (status == GNP_OK)
		status = handler(request, &error);
	if (status != GNP_OK) {
		error.status = status;
		gnpd_reply_error(request, &error);
	}
}

/* The reply is there: the library calls on_request again, which sends it. */
static void resume(struct gnpd_request *request)
{
	struct gnpd_server *server = request->server;
	request->step = GNPD_STEP_REPLY;
	gnpd_connection_enter(server->reaper, request->connection, GNPD_PHASE_REPLY, request);
	gnpd_http_loop_resume(request->loop, request->http);
	atomic_fetch_sub(&server->suspended, 1);
}

static struct gnpd_queue *queue_of(const struct gnpd_request *request)
{
	return request->route->work == GNPD_AT_DESK ? request->server->desk : request->server->queue;
}

static bool withdraw_from_queue(struct gnpd_request *request)
{
	return gnpd_queue_remove(queue_of(request), &request->queued);
}

static void run_queued(struct gnpd_queued *queued)
{
	struct gnpd_request *request = (struct gnpd_request *)((char *)queued - offsetof(struct gnpd_request, queued));
	request->waited = gnp_clock() - request->submitted;
	run_handler(request, request->route->handler);
	gnp_task_stage(&request->work.task, GNP_STAGE_DONE, 0);
	resume(request);
}

/* The connection is out of the library's hands until resume. */
static void suspend(struct gnpd_request *request)
{
	request->submitted = gnp_clock();
	atomic_fetch_add(&request->server->suspended, 1);
	MHD_suspend_connection(request->http);
	gnpd_connection_enter(request->server->reaper, request->connection, GNPD_PHASE_WORK, request);
}

/* Suspends first: the runner may be done before submit returns. */
static enum MHD_Result begin_work(struct gnpd_request *request)
{
	struct gnpd_server *server = request->server;
	struct gnp_error error = {0};
	struct gnpd_work *work = &request->work;
	request->queued.run = run_queued;
	request->withdraw = withdraw_from_queue;
	if (request->model)
		work->operation = gnp_operation_find(request->model);
	work->codec = gnpd_routes_codec(request->route);
	gnp_task_init(&work->task);
	gnpd_work_begin(work, server->config->work_seconds, work->codec == &gnpd_codec_file ? request->target.query : NULL);
	work->query = request->target.query;
	suspend(request);
	gnp_status status = gnpd_queue_submit(queue_of(request), &request->queued, &error);
	if (status == GNP_OK)
		return MHD_YES;
	gnpd_metrics_reject(&server->metrics, status == GNP_DRAINING ? GNPD_REJECT_DRAINING : GNPD_REJECT_QUEUE_COUNT);
	gnpd_reply_error(request, &error);
	resume(request);
	return MHD_YES;
}

/* ---- waiting for a job ---- */

static void run_polled(struct gnpd_queued *queued)
{
	struct gnpd_request *request = (struct gnpd_request *)((char *)queued - offsetof(struct gnpd_request, queued));
	run_handler(request, gnpd_jobs_polled);
	resume(request);
}

static void wake_poll(struct gnpd_watch *watch)
{
	struct gnpd_request *request = (struct gnpd_request *)((char *)watch - offsetof(struct gnpd_request, watch));
	run_polled(&request->queued);
}

static bool withdraw_from_watchers(struct gnpd_request *request)
{
	return gnpd_watch_withdraw(&request->watch);
}

static enum MHD_Result begin_watch(struct gnpd_request *request)
{
	request->queued.run = run_polled;
	request->withdraw = withdraw_from_watchers;
	request->watch.wake = wake_poll;
	atomic_store(&request->work.deadline, INFINITY);
	suspend(request);
	gnpd_watch_wait(&request->watch);
	return MHD_YES;
}

/* ---- the body ---- */

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
	size_t limit = request->server->config->max_body_bytes;
	if (size > limit - body->size) {
		gnpd_metrics_reject(&request->server->metrics, GNPD_REJECT_BODY_LIMIT);
		return gnp_error_set(error, GNP_TOO_LARGE, "body: got more than %zu bytes, need at most that", limit);
	}
	gnp_status status = size > body->capacity - body->size ? grow_body(request, size, error) : GNP_OK;
	if (status != GNP_OK)
		return status;
	memcpy(body->data + body->size, data, size);
	body->size += size;
	return GNP_OK;
}

/* Under TLS the answer goes through the session, on this thread, which serves it. */
static void cut(struct gnpd_request *request, const struct gnp_error *error)
{
	const union MHD_ConnectionInfo *information = MHD_get_connection_info(request->http, MHD_CONNECTION_INFO_GNUTLS_SESSION);
	struct gnp_buffer answer = {0};
	double retry_after = request->server->config->retry_after_seconds;
	if (information && information->tls_session && gnpd_cut_answer(error, request->id, retry_after, &answer) == GNP_OK)
		gnpd_tls_send_last(information->tls_session, answer.data, answer.size);
	gnp_buffer_clear(&answer);
	gnpd_connection_cut(request->server->reaper, request->connection, error);
}

static enum MHD_Result take_body(struct gnpd_request *request, const char *data, size_t size)
{
	struct gnp_error error = {0};
	request->received += size;
	gnpd_connection_received(request->server->reaper, request->connection, request->received);
	if (request->step == GNPD_STEP_BODY && append_body(request, data, size, &error) != GNP_OK)
		refuse_body(request, &error);
	else if (request->step == GNPD_STEP_DISCARD)
		request->discarded += size;
	if (request->discarded <= request->server->config->discard_bytes)
		return MHD_YES;
	if (request->reply.code == 0) {
		gnp_error_set(&error, GNP_TOO_LARGE, "body: this path takes none, got %zu bytes", request->received);
		gnpd_reply_error(request, &error);
	} else {
		gnp_error_set(&error, request->status, "%s", gnp_status_text(request->status));
	}
	cut(request, &error);
	return MHD_NO;
}

static enum MHD_Result end_of_body(struct gnpd_request *request)
{
	if (request->reply.code)
		return send_reply(request);
	if (request->route->work)
		return begin_work(request);
	run_handler(request, request->route->handler);
	if (request->reply.code == 0 && request->watch.kind == GNPD_WATCH_POLL)
		return begin_watch(request);
	return send_reply(request);
}

/* ---- headers ---- */

struct header_walk {
	struct gnpd_request *request;
	struct gnpd_strict strict;
	const char *id;
};

static enum MHD_Result on_header(void *context, enum MHD_ValueKind kind, const char *name, const char *value)
{
	struct header_walk *walk = context;
	struct gnpd_request *request = walk->request;
	(void)kind;
	gnpd_strict_header(&walk->strict, name, value);
	if (!value)
		return MHD_YES;
	if (strcasecmp(name, "Content-Type") == 0)
		request->work.content_type = value;
	else if (strcasecmp(name, "Content-Encoding") == 0)
		request->work.content_encoding = strcasecmp(value, "identity") == 0 ? NULL : value;
	else if (strcasecmp(name, "Accept") == 0)
		request->work.accept = value;
	else if (strcasecmp(name, "Inference-Header-Content-Length") == 0)
		request->work.inference_length = value;
	else if (strcasecmp(name, "Idempotency-Key") == 0)
		request->idempotency_key = value;
	else if (strcasecmp(name, "Range") == 0)
		request->range = value;
	else if (strcasecmp(name, "If-Range") == 0)
		request->if_range = value;
	else if (strcasecmp(name, "If-None-Match") == 0)
		request->if_none_match = value;
	else if (strcasecmp(name, "X-Request-Id") == 0)
		walk->id = value;
	else if (strcasecmp(name, "Authorization") == 0) {
		request->credentials.authorization = value;
		request->credentials.authorizations++;
	} else if (strcasecmp(name, "X-API-Key") == 0) {
		request->credentials.api_key = value;
		request->credentials.api_keys++;
	} else if (strcasecmp(name, "Expect") == 0)
		request->expects_continue = strcasecmp(value, "100-continue") == 0;
	else if (strcasecmp(name, "Content-Length") == 0) {
		request->has_length = true;
		request->content_length = strtoul(value, NULL, 10);
	}
	return MHD_YES;
}

static bool takes_body(const struct gnpd_request *request)
{
	return request->route->work != GNPD_AT_ONCE && strcmp(request->method, "POST") == 0;
}

/* What can be refused before the body is read. */
static gnp_status check_admission(struct gnpd_request *request, struct gnp_error *error)
{
	struct gnpd_server *server = request->server;
	struct gnp_error unmatched = {0};
	bool known = gnpd_routes_match(request, &unmatched) == GNP_OK;
	gnp_status status = gnpd_admit(request, known, error);
	if (status != GNP_OK)
		return status;
	if (!known)
		return gnp_error_set(error, unmatched.status, "%s", unmatched.text);
	if (!takes_body(request))
		return GNP_OK;
	if (atomic_load(&server->draining)) {
		gnpd_metrics_reject(&server->metrics, GNPD_REJECT_DRAINING);
		return gnp_error_set(error, GNP_DRAINING, "%s", gnp_status_text(GNP_DRAINING));
	}
	if (request->content_length > server->config->max_body_bytes) {
		gnpd_metrics_reject(&server->metrics, GNPD_REJECT_BODY_LIMIT);
		return gnp_error_set(error, GNP_TOO_LARGE, "body: got %zu bytes, need at most %zu", request->content_length,
		                     server->config->max_body_bytes);
	}
	status = gnpd_queue_check(queue_of(request), error);
	if (status != GNP_OK)
		gnpd_metrics_reject(&server->metrics, status == GNP_DRAINING ? GNPD_REJECT_DRAINING : GNPD_REJECT_QUEUE_COUNT);
	return status;
}

static enum MHD_Result on_headers(struct gnpd_request *request, const char *method, const char *version)
{
	struct header_walk walk = {.request = request};
	struct gnp_error error = {0};
	size_t discard = request->server->config->discard_bytes;
	strncpy(request->method, method, sizeof request->method - 1);
	MHD_get_connection_values(request->http, MHD_HEADER_KIND, on_header, &walk);
	/* The headers are in: the reaper, which quotes the id in what it answers, lets go of the request while that changes. */
	gnpd_connection_enter(request->server->reaper, request->connection, GNPD_PHASE_HEADERS, NULL);
	gnpd_request_set_id(request, walk.id);
	if (gnpd_strict_finish(&walk.strict, version, &error) != GNP_OK) {
		gnpd_metrics_reject(&request->server->metrics, GNPD_REJECT_FRAMING);
		request->reply.close = true;
		return send_error(request, &error);
	}
	request->active = true;
	atomic_fetch_add(&request->server->active, 1);
	gnpd_connection_enter(request->server->reaper, request->connection, GNPD_PHASE_BODY, request);
	bool admitted = check_admission(request, &error) == GNP_OK;
	bool unread = request->expects_continue || request->content_length > discard;
	if (admitted) {
		request->step = takes_body(request) ? GNPD_STEP_BODY : GNPD_STEP_DISCARD;
		return MHD_YES;
	}
	if (unread)
		return send_error(request, &error);
	gnpd_reply_error(request, &error);
	request->step = GNPD_STEP_DISCARD;
	return MHD_YES;
}

/* ---- the library's callbacks ---- */

/* The first line has come. What it returns is the request's context until completion. */
static void *on_uri(void *context, const char *uri, struct MHD_Connection *http)
{
	const struct lane *lane = context;
	struct gnpd_server *server = lane->http->server;
	struct gnpd_connection *connection = connection_of(http);
	struct gnpd_request *request = connection ? gnpd_request_create(server, uri) : NULL;
	if (!request)
		return NULL;
	request->http = http;
	request->loop = lane->loop;
	request->admin = lane->http->admin;
	request->connection = connection;
	gnpd_connection_enter(server->reaper, connection, GNPD_PHASE_HEADERS, request);
	return request;
}

static enum MHD_Result on_request(void *context, struct MHD_Connection *http, const char *url, const char *method,
                                  const char *version, const char *data, size_t *size, void **slot)
{
	struct gnpd_request *request = *slot;
	(void)context, (void)http, (void)url;
	if (!request)
		return MHD_NO;
	switch (request->step) {
	case GNPD_STEP_HEADERS:
		return on_headers(request, method, version);
	case GNPD_STEP_BODY:
	case GNPD_STEP_DISCARD:
		if (*size == 0)
			return end_of_body(request);
		enum MHD_Result result = take_body(request, data, *size);
		*size = 0;
		return result;
	case GNPD_STEP_REPLY:
		return send_reply(request);
	case GNPD_STEP_SENT:
		break;
	}
	return MHD_NO;
}

/* What a client did wrong is in the access log; this is for whoever looks for more. A thread that has no connection and finds no file
 * descriptor for its first one tries again at once, and would keep a processor busy with that. */
static void on_library_message(void *context, const char *format, va_list arguments)
{
	static const char no_files[] = "Hit process or system resource limit at FIRST connection";
	struct gnpd_http *listener = context;
	char text[256];
	if (strncmp(format, no_files, sizeof no_files - 1) == 0)
		usleep(20000);
	if (!gnpd_log_wants(&listener->server->log, GNPD_LOG_DEBUG))
		return;
	vsnprintf(text, sizeof text, format, arguments);
	text[strcspn(text, "\n")] = '\0';
	gnpd_log_event(&listener->server->log, "debug", "http: %s", text);
}

/* The library leaves its connection with the session (daemon.c of 0.9.75, as for its own PSK callback). */
static int on_certificate(gnutls_session_t session, const struct gnutls_cert_retr_st *information, gnutls_pcert_st **certificates,
                          unsigned *count, gnutls_ocsp_data_st **ocsp, unsigned *ocsp_count, gnutls_privkey_t *key, unsigned *flags)
{
	struct MHD_Connection *http = gnutls_session_get_ptr(session);
	struct gnpd_connection *connection = http ? connection_of(http) : NULL;
	(void)information;
	if (!connection)
		return -1;
	struct gnpd_tls_pair *pair = gnpd_tls_pair(gnpd_connection_server(connection)->tls);
	gnpd_tls_pair_contents(gnpd_connection_hold_take(connection, pair), certificates, count, key);
	*ocsp = NULL;
	*ocsp_count = *flags = 0;
	return 0;
}

/* Idle connections are the reaper's; the library's own timeout stays off. */
static struct MHD_Daemon *start_daemon(struct lane *lane, int fd, size_t connections)
{
	struct gnpd_http *http = lane->http;
	const struct gnpd_config *config = http->server->config;
	const unsigned flags = MHD_USE_EPOLL | MHD_ALLOW_SUSPEND_RESUME | MHD_USE_ERROR_LOG;
	struct MHD_OptionItem tls[] = {{MHD_OPTION_HTTPS_PRIORITIES, 0, GNPD_TLS_PRIORITIES},
	                               {MHD_OPTION_HTTPS_CERT_CALLBACK2, 0, (void *)on_certificate},
	                               {MHD_OPTION_END, 0, NULL}};
	return MHD_start_daemon(
		flags | (http->tls ? MHD_USE_TLS : 0), 0, NULL, NULL, on_request, http->server, MHD_OPTION_EXTERNAL_LOGGER,
		on_library_message, http, MHD_OPTION_LISTEN_SOCKET, fd, MHD_OPTION_CONNECTION_LIMIT, (unsigned)connections,
		MHD_OPTION_CONNECTION_MEMORY_LIMIT, config->connection_memory_bytes, MHD_OPTION_CONNECTION_MEMORY_INCREMENT,
		config->connection_memory_bytes / 4, MHD_OPTION_STRICT_FOR_CLIENT, 1, MHD_OPTION_URI_LOG_CALLBACK, on_uri, lane,
		MHD_OPTION_NOTIFY_COMPLETED, on_completed, NULL, MHD_OPTION_NOTIFY_CONNECTION, on_connection, http, MHD_OPTION_ARRAY,
		http->tls ? tls : tls + 2, MHD_OPTION_END);
}

/* The lane's socket is one of its own, on the same queue of clients: the library closes it. */
static gnp_status start_lane(struct gnpd_http *http, struct lane *lane, int fd, size_t connections, struct gnp_error *error)
{
	int own = fcntl(fd, F_DUPFD_CLOEXEC, 0);
	if (own < 0)
		return gnp_error_set(error, GNP_IO, "http: %s", strerror(errno));
	lane->http = http;
	lane->daemon = start_daemon(lane, own, connections);
	if (lane->daemon)
		return gnpd_http_loop_start(lane->daemon, &lane->loop, error);
	close(own);
	return gnp_error_set(error, GNP_IO, "http: the library did not start");
}

gnp_status gnpd_http_start_take(struct gnpd_server *server, int fd, bool admin, bool tls, struct gnpd_http **out,
                                struct gnp_error *error)
{
	const struct gnpd_config *config = server->config;
	size_t count = admin ? 1 : config->http_threads, connections = admin ? config->admin_connections : config->max_connections;
	if (count > connections)
		count = connections;
	struct gnpd_http *http = calloc(1, sizeof *http + count * sizeof *http->lanes);
	gnp_status status = http ? GNP_OK : gnp_error_set(error, GNP_OUT_OF_MEMORY, "http: no memory");
	if (http)
		*http = (struct gnpd_http){.server = server, .admin = admin, .tls = tls, .count = count};
	for (size_t i = 0; i < count && status == GNP_OK; i++)
		status = start_lane(http, &http->lanes[i], fd, connections / count + (i < connections % count), error);
	close(fd);
	if (status == GNP_OK)
		*out = http;
	else
		gnpd_http_stop(http);
	return status;
}

void gnpd_http_stop(struct gnpd_http *http)
{
	if (!http)
		return;
	for (size_t i = 0; i < http->count; i++)
		gnpd_http_loop_stop(http->lanes[i].loop);
	for (size_t i = 0; i < http->count; i++)
		if (http->lanes[i].daemon)
			MHD_stop_daemon(http->lanes[i].daemon);
	free(http);
}
