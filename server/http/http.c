#include "server/http/http.h"

#include <arpa/inet.h>
#include <errno.h>
#include <fcntl.h>
#include <gnutls/abstract.h>
#include <gnutls/gnutls.h>
#include <microhttpd.h>
#include <netinet/in.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "server/api/request.h"
#include "server/base/log.h"
#include "server/base/tls.h"
#include "server/config/config.h"
#include "server/http/connections.h"
#include "server/http/http_loop.h"
#include "server/http/http_steps.h"

/* A thread of a listener, with its share of the connections. */
struct http_thread {
	struct gnpd_http *http;
	struct MHD_Daemon *daemon;
	struct gnpd_http_loop *loop;
};

/* One listener. */
struct gnpd_http {
	struct gnpd_server *server;
	bool admin, tls, named;
	size_t count;
	struct http_thread threads[]; /* (count) */
};

static struct gnpd_connection *connection_of(struct MHD_Connection *http)
{
	const union MHD_ConnectionInfo *information = MHD_get_connection_info(http, MHD_CONNECTION_INFO_SOCKET_CONTEXT);
	return information ? information->socket_context : NULL;
}

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
		struct gnpd_origin origin = {.tls = listener->tls ? server->tls : NULL, .admin = listener->admin};
		format_remote(http, origin.remote, sizeof origin.remote);
		*slot = information ? gnpd_connection_open(server->connections, information->connect_fd, &origin) : NULL;
		if (information && !*slot) /* nobody would watch over it */
			shutdown(information->connect_fd, SHUT_RDWR);
	} else if (*slot) {
		gnpd_connection_close(server->connections, *slot);
		*slot = NULL;
	}
}

static void on_completed(void *context, struct MHD_Connection *http, void **request, enum MHD_RequestTerminationCode code)
{
	(void)context, (void)http;
	if (*request)
		gnpd_http_finish(*request, code);
	*request = NULL;
}

/* Before the library takes the parameters apart, which it leaves unanswered where its memory does not hold them. */
static void refuse_query(struct gnpd_request *request)
{
	struct gnp_error error = {0};
	gnp_error_set(&error, GNP_INVALID_ARGUMENT, "query: got %zu parameters, need at most %d",
	              gnpd_query_count(request->target.query), GNPD_QUERY_MAX);
	gnpd_reply_error(request, &error);
	request->step = GNPD_STEP_SENT;
	gnpd_http_cut(request, &error);
}

/* The first line has come. What it returns is the request's context until completion. */
static void *on_uri(void *context, const char *uri, struct MHD_Connection *http)
{
	const struct http_thread *thread = context;
	struct gnpd_server *server = thread->http->server;
	struct gnpd_connection *connection = connection_of(http);
	struct gnpd_request *request = connection ? gnpd_request_create(server, uri) : NULL;
	if (!request)
		return NULL;
	request->http = http;
	request->loop = thread->loop;
	request->admin = thread->http->admin;
	request->named = thread->http->named;
	request->connection = connection;
	request->uri_size = strlen(uri);
	gnpd_connection_enter(server->connections, connection, GNPD_PHASE_HEADERS, request);
	if (gnpd_query_count(request->target.query) > GNPD_QUERY_MAX)
		refuse_query(request);
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
		return gnpd_http_headers(request, method, version);
	case GNPD_STEP_BODY:
	case GNPD_STEP_DISCARD:
	case GNPD_STEP_LINGER:
		if (*size == 0)
			return request->step == GNPD_STEP_LINGER ? MHD_NO : gnpd_http_answer(request);
		enum MHD_Result result = gnpd_http_body(request, data, *size);
		*size = 0;
		return result;
	case GNPD_STEP_REPLY:
		return gnpd_http_reply(request);
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
	if (!gnpd_log_wants(listener->server->engine.log, GNPD_LOG_DEBUG))
		return;
	vsnprintf(text, sizeof text, format, arguments);
	text[strcspn(text, "\n")] = '\0';
	gnpd_log_event(listener->server->engine.log, GNPD_LOG_DEBUG, "http: %s", text);
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
	gnpd_tls_pair_contents(gnpd_connection_certificate(connection), certificates, count, key);
	*ocsp = NULL;
	*ocsp_count = *flags = 0;
	return 0;
}

/* Idle connections are cut by connections.c; the library's own timeout stays off. */
static struct MHD_Daemon *start_daemon(struct http_thread *thread, int fd, size_t connections)
{
	struct gnpd_http *http = thread->http;
	const struct gnpd_config *config = http->server->engine.config;
	const unsigned flags = MHD_USE_EPOLL | MHD_ALLOW_SUSPEND_RESUME | MHD_USE_ERROR_LOG;
	struct MHD_OptionItem tls[] = {{MHD_OPTION_HTTPS_PRIORITIES, 0, GNPD_TLS_PRIORITIES},
	                               {MHD_OPTION_HTTPS_CERT_CALLBACK2, 0, (void *)on_certificate},
	                               {MHD_OPTION_END, 0, NULL}};
	return MHD_start_daemon(
		flags | (http->tls ? MHD_USE_TLS : 0), 0, NULL, NULL, on_request, http->server, MHD_OPTION_EXTERNAL_LOGGER,
		on_library_message, http, MHD_OPTION_LISTEN_SOCKET, fd, MHD_OPTION_CONNECTION_LIMIT, (unsigned)connections,
		MHD_OPTION_CONNECTION_MEMORY_LIMIT, config->connection_memory_bytes, MHD_OPTION_CONNECTION_MEMORY_INCREMENT,
		config->connection_memory_bytes / 4, MHD_OPTION_STRICT_FOR_CLIENT, 1, MHD_OPTION_URI_LOG_CALLBACK, on_uri, thread,
		MHD_OPTION_NOTIFY_COMPLETED, on_completed, NULL, MHD_OPTION_NOTIFY_CONNECTION, on_connection, http, MHD_OPTION_ARRAY,
		http->tls ? tls : tls + 2, MHD_OPTION_END);
}

/* The thread's socket is one of its own, on the same queue of clients: the library closes it. */
static gnp_status start_thread(struct gnpd_http *http, struct http_thread *thread, int fd, size_t connections, struct gnp_error *error)
{
	int own = fcntl(fd, F_DUPFD_CLOEXEC, 0);
	if (own < 0)
		return gnp_error_set(error, GNP_IO, "http: %s", strerror(errno));
	thread->http = http;
	thread->daemon = start_daemon(thread, own, connections);
	if (thread->daemon)
		return gnpd_http_loop_start(thread->daemon, &thread->loop, error);
	close(own);
	return gnp_error_set(error, GNP_IO, "http: the library did not start");
}

gnp_status gnpd_http_start_take(struct gnpd_server *server, int fd, bool admin, bool tls, bool named, struct gnpd_http **out,
                                struct gnp_error *error)
{
	const struct gnpd_config *config = server->engine.config;
	size_t count = admin ? 1 : config->http_threads, connections = admin ? config->admin_connections : config->max_connections;
	if (count > connections)
		count = connections;
	struct gnpd_http *http = calloc(1, sizeof *http + count * sizeof *http->threads);
	gnp_status status = http ? GNP_OK : gnp_error_set(error, GNP_OUT_OF_MEMORY, "http: no memory");
	if (http)
		*http = (struct gnpd_http){.server = server, .admin = admin, .tls = tls, .named = named, .count = count};
	for (size_t i = 0; i < count && status == GNP_OK; i++)
		status = start_thread(http, &http->threads[i], fd, connections / count + (i < connections % count), error);
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
		gnpd_http_loop_stop(http->threads[i].loop);
	for (size_t i = 0; i < http->count; i++)
		if (http->threads[i].daemon)
			MHD_stop_daemon(http->threads[i].daemon);
	free(http);
}
