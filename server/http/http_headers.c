/* What is done once the headers of a request are in: what they say is kept, their framing is checked, and what can be
 * refused before the body is refused. */
#include "server/http/http_steps.h"

#include <stdlib.h>
#include <string.h>
#include <strings.h>

#include "server/api/admit.h"
#include "server/api/routes.h"
#include "server/api/server.h"
#include "server/config/config.h"
#include "server/http/connections.h"
#include "server/parse/framing.h"

struct header_walk {
	struct gnpd_request *request;
	struct gnpd_framing framing;
	const char *id;
};

static void take_encoding(struct header_walk *walk, const char *value)
{
	walk->request->work.content_encoding = strcasecmp(value, "identity") == 0 ? NULL : value;
}

static void take_id(struct header_walk *walk, const char *value)
{
	walk->id = value;
}

static void take_authorization(struct header_walk *walk, const char *value)
{
	walk->request->credentials.authorization = value;
	walk->request->credentials.authorizations++;
}

static void take_api_key(struct header_walk *walk, const char *value)
{
	walk->request->credentials.api_key = value;
	walk->request->credentials.api_keys++;
}

static void take_expect(struct header_walk *walk, const char *value)
{
	walk->request->expects_continue = strcasecmp(value, "100-continue") == 0;
}

static void take_length(struct header_walk *walk, const char *value)
{
	walk->request->has_length = true;
	walk->request->content_length = strtoul(value, NULL, 10);
}

/* Where the value of each header that is heeded goes: to a member of the request, or to a function that makes more
 * of it. */
static const struct {
	const char *name;
	size_t member; /* a const char * of the request */
	void (*take)(struct header_walk *walk, const char *value); /* NULL: the value as it is becomes the member */
} headers[] = {
	{"Content-Type", offsetof(struct gnpd_request, work.content_type), NULL},
	{"Content-Encoding", 0, take_encoding},
	{"Accept", offsetof(struct gnpd_request, work.accept), NULL},
	{"Inference-Header-Content-Length", offsetof(struct gnpd_request, work.inference_length), NULL},
	{"Idempotency-Key", offsetof(struct gnpd_request, idempotency_key), NULL},
	{"Range", offsetof(struct gnpd_request, range), NULL},
	{"If-Range", offsetof(struct gnpd_request, if_range), NULL},
	{"If-None-Match", offsetof(struct gnpd_request, if_none_match), NULL},
	{"Last-Event-ID", offsetof(struct gnpd_request, last_event_id), NULL},
	{"Host", offsetof(struct gnpd_request, site.host), NULL},
	{"Origin", offsetof(struct gnpd_request, site.origin), NULL},
	{"Sec-Fetch-Site", offsetof(struct gnpd_request, site.fetch), NULL},
	{"X-Request-Id", 0, take_id},
	{"Authorization", 0, take_authorization},
	{"X-API-Key", 0, take_api_key},
	{"Expect", 0, take_expect},
	{"Content-Length", 0, take_length},
};
enum { HEADERS = sizeof headers / sizeof headers[0] };

static enum MHD_Result on_header(void *context, enum MHD_ValueKind kind, const char *name, const char *value)
{
	struct header_walk *walk = context;
	(void)kind;
	gnpd_framing_header(&walk->framing, name, value);
	for (size_t i = 0; i < HEADERS && value; i++) {
		if (strcasecmp(name, headers[i].name) != 0)
			continue;
		if (headers[i].take)
			headers[i].take(walk, value);
		else
			*(const char **)(void *)((char *)walk->request + headers[i].member) = value;
		break;
	}
	return MHD_YES;
}

static bool takes_body(const struct gnpd_request *request)
{
	return request->route->work != GNPD_AT_ONCE && strcmp(request->method, "POST") == 0;
}

/* A page of another site has no key: where one is needed, nothing can be done in its visitor's name. */
static gnp_status check_site(struct gnpd_request *request, struct gnp_error *error)
{
	static const char *const harmless[] = {"GET", "HEAD", "OPTIONS"};
	struct gnpd_server *server = request->server;
	const char *allowed = server->engine.config->allowed_hosts;
	gnp_status status = request->named ? gnpd_site_check_host(&request->site, allowed, error) : GNP_OK;
	if (status != GNP_OK) {
		gnpd_metrics_reject(server->engine.metrics, GNPD_REJECT_HOST);
		return status;
	}
	if (gnpd_guard_on(server->guard))
		return GNP_OK;
	for (size_t i = 0; i < sizeof harmless / sizeof harmless[0]; i++)
		if (strcmp(request->method, harmless[i]) == 0)
			return GNP_OK;
	status = gnpd_site_check_origin(&request->site, allowed, error);
	if (status != GNP_OK)
		gnpd_metrics_reject(server->engine.metrics, GNPD_REJECT_CROSS_SITE);
	return status;
}

/* A form's file comes wrapped in lines that no format has. */
static gnp_status check_body_type(const struct gnpd_request *request, struct gnp_error *error)
{
	const char *type = request->work.content_type;
	if (!type || strncasecmp(type, "multipart/", 10) != 0)
		return GNP_OK;
	return gnp_error_set(error, GNP_UNSUPPORTED_MEDIA, "body: Content-Type \"%.*s\" is that of a form, need the file alone as the body "
	                     "(curl: --data-binary @FILE instead of -F)", (int)strcspn(type, "; "), type);
}

/* What can be refused before the body is read, of a request that may have it. */
static gnp_status check_body(struct gnpd_request *request, struct gnp_error *error)
{
	struct gnpd_server *server = request->server;
	if (atomic_load(&server->draining)) {
		gnpd_metrics_reject(server->engine.metrics, GNPD_REJECT_DRAINING);
		return gnp_error_set(error, GNP_DRAINING, "%s", gnp_status_text(GNP_DRAINING));
	}
	if (request->content_length > server->engine.config->max_body_bytes) {
		gnpd_metrics_reject(server->engine.metrics, GNPD_REJECT_BODY_LIMIT);
		return gnp_error_set(error, GNP_TOO_LARGE, "body: got %zu bytes, need at most %zu (max-body-bytes)", request->content_length,
		                     server->engine.config->max_body_bytes);
	}
	gnp_status status = check_body_type(request, error);
	if (status != GNP_OK)
		return status;
	status = gnpd_queue_check(gnpd_http_queue(request), error);
	if (status != GNP_OK)
		gnpd_metrics_reject(server->engine.metrics,
		                    status == GNP_DRAINING ? GNPD_REJECT_DRAINING : GNPD_REJECT_QUEUE_COUNT);
	return status;
}

/* What can be refused before the body is read. */
static gnp_status check_admission(struct gnpd_request *request, struct gnp_error *error)
{
	struct gnp_error unmatched = {0};
	gnp_status status = check_site(request, error);
	if (status != GNP_OK)
		return status;
	bool known = gnpd_routes_match(request, &unmatched) == GNP_OK;
	status = gnpd_admit(request, known, error);
	if (status != GNP_OK)
		return status;
	if (!known)
		return gnp_error_set(error, unmatched.status, "%s", unmatched.text);
	return takes_body(request) ? check_body(request, error) : GNP_OK;
}

/* Bytes from the first line to the empty one; 0: not known. */
static size_t header_size(struct MHD_Connection *http)
{
	const union MHD_ConnectionInfo *information = MHD_get_connection_info(http, MHD_CONNECTION_INFO_REQUEST_HEADER_SIZE);
	return information ? information->header_size : 0;
}

enum MHD_Result gnpd_http_headers(struct gnpd_request *request, const char *method, const char *version)
{
	struct header_walk walk = {.request = request};
	struct gnp_error error = {0};
	size_t discard = request->server->engine.config->discard_bytes;
	strncpy(request->method, method, sizeof request->method - 1);
	MHD_get_connection_values(request->http, MHD_HEADER_KIND, on_header, &walk);
	/* The headers are in: the thread that watches connections, which quotes the id in what it answers, lets go of
	 * the request while that changes. */
	gnpd_connection_enter(request->server->connections, request->connection, GNPD_PHASE_HEADERS, NULL);
	gnpd_request_set_id(request, walk.id);
	if (request->target.authority)
		request->site.host = request->target.authority; /* whatever Host says (RFC 9112 3.2.2) */
	gnpd_framing_size(&walk.framing, strlen(method) + request->uri_size + strlen(version) + strlen("  \r\n"), header_size(request->http));
	if (gnpd_framing_finish(&walk.framing, version, &error) != GNP_OK) {
		gnpd_metrics_reject(request->server->engine.metrics, GNPD_REJECT_FRAMING);
		request->reply.close = true;
		gnpd_reply_error(request, &error);
		return gnpd_http_reply(request);
	}
	request->active = true;
	atomic_fetch_add(&request->server->active, 1);
	gnpd_connection_enter(request->server->connections, request->connection, GNPD_PHASE_BODY, request);
	if (check_admission(request, &error) == GNP_OK) {
		request->step = takes_body(request) ? GNPD_STEP_BODY : GNPD_STEP_DISCARD;
		return MHD_YES;
	}
	gnpd_reply_error(request, &error);
	if (request->expects_continue) /* the client asks before it sends */
		return gnpd_http_reply(request);
	if (request->content_length > discard)
		return gnpd_http_linger(request);
	request->step = GNPD_STEP_DISCARD;
	return MHD_YES;
}
