#include "server/http/http_stream.h"

#include <microhttpd.h>

#include "server/api/server.h"
#include "server/base/container.h"
#include "server/http/connections.h"
#include "server/http/http_loop.h"

static struct gnpd_request *request_of(struct gnpd_watch *watch)
{
	return GNPD_CONTAINER_OF(watch, struct gnpd_request, watch);
}

static void suspend(struct gnpd_watch *watch)
{
	struct gnpd_request *request = request_of(watch);
	atomic_fetch_add(&request->server->suspended, 1);
	MHD_suspend_connection(request->http);
}

static void resume(struct gnpd_watch *watch)
{
	struct gnpd_request *request = request_of(watch);
	struct gnpd_server *server = request->server;
	gnpd_http_loop_resume(request->loop, request->http);
	atomic_fetch_sub(&server->suspended, 1);
}

static ssize_t read_events(void *context, uint64_t position, char *data, size_t most)
{
	struct gnpd_request *request = context;
	(void)position;
	gnpd_connection_enter(request->server->connections, request->connection, GNPD_PHASE_STREAM, request);
	ssize_t size = gnpd_watch_read(&request->watch, data, most, suspend);
	if (size < 0)
		return MHD_CONTENT_READER_END_OF_STREAM;
	return size;
}

struct MHD_Response *gnpd_http_stream_response(struct gnpd_request *request)
{
	enum { BLOCK = 4096 };
	request->watch.wake = resume;
	return MHD_create_response_from_callback(MHD_SIZE_UNKNOWN, BLOCK, read_events, request, NULL);
}
