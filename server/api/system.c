#include "server/api/system.h"

#include <string.h>

#include "core/base/pool.h"
#include "proto/operation/prepared_cache.h"
#include "server/access/guard.h"
#include "server/api/routes.h"
#include "server/api/server.h"
#include "server/base/metrics.h"
#include "server/base/queue.h"
#include "server/base/tls.h"
#include "server/config/config.h"
#include "server/jobs/jobs.h"

gnp_status gnpd_system_live(struct gnpd_request *request, struct gnp_error *error)
{
	return gnp_buffer_printf(gnpd_reply_json(&request->reply, 200), error, "{\"live\":true}\n");
}

gnp_status gnpd_system_ready(struct gnpd_request *request, struct gnp_error *error)
{
	if (atomic_load(&request->server->leaving))
		return gnp_error_set(error, GNP_DRAINING, "%s", gnp_status_text(GNP_DRAINING));
	return gnp_buffer_printf(gnpd_reply_json(&request->reply, 200), error, "{\"ready\":true}\n");
}

struct limits {
	struct gnp_buffer *buffer;
	struct gnp_error *error;
	gnp_status status;
};

static void write_limit(void *context, const char *key, double value)
{
	struct limits *limits = context;
	if (limits->status == GNP_OK)
		limits->status = gnp_buffer_printf(limits->buffer, limits->error, "gnpd_limit{key=\"%s\"} %.15g\n", key, value);
}

static gnp_status write_limits(const struct gnpd_config *config, struct gnp_buffer *buffer, struct gnp_error *error)
{
	struct limits limits = {buffer, error, GNP_OK};
	limits.status = gnp_buffer_printf(buffer, error, "# HELP gnpd_limit Numbers of the configuration, by key.\n# TYPE gnpd_limit gauge\n");
	gnpd_config_numbers(config, write_limit, &limits);
	return limits.status;
}

static gnp_status write_expiry(struct gnpd_tls *tls, struct gnp_buffer *buffer, struct gnp_error *error)
{
	if (!tls)
		return GNP_OK;
	return gnp_buffer_printf(buffer, error, "# HELP gnpd_certificate_expiry_timestamp_seconds When the certificate ends.\n"
	                         "# TYPE gnpd_certificate_expiry_timestamp_seconds gauge\n"
	                         "gnpd_certificate_expiry_timestamp_seconds %.15g\n", gnpd_tls_expiry(tls));
}

gnp_status gnpd_system_metrics(struct gnpd_request *request, struct gnp_error *error)
{
	const struct gnpd_server *server = request->server;
	struct gnpd_queue_state state = gnpd_queue_state(server->engine.queue);
	const struct gnp_prepared_cache_state cache = gnp_prepared_cache_state(server->engine.cache);
	struct gnp_buffer *body = &request->reply.body;
	request->reply.code = 200;
	request->reply.content_type = "text/plain; version=0.0.4; charset=utf-8";
	gnp_status status = gnpd_metrics_write(server->engine.metrics, &state, &cache,
	                                       gnp_pool_workers(server->engine.pool), body, error);
	if (status == GNP_OK)
		status = gnpd_guard_write(server->guard, body, error);
	if (status == GNP_OK)
		status = gnpd_jobs_metrics_write(server->jobs, body, error);
	if (status == GNP_OK)
		status = write_limits(server->engine.config, body, error);
	return status == GNP_OK ? write_expiry(server->tls, body, error) : status;
}

/* Of the server as a whole: what methods there are. */
gnp_status gnpd_system_options(struct gnpd_request *request, struct gnp_error *error)
{
	char allowed[64];
	(void)error;
	gnpd_routes_methods(request, allowed, sizeof allowed);
	gnpd_reply_header(request, "Allow", "%s", allowed);
	request->reply.code = 204;
	return GNP_OK;
}

gnp_status gnpd_system_openapi(struct gnpd_request *request, struct gnp_error *error)
{
	const struct gnp_buffer *document = &request->server->openapi;
	request->reply.code = 200;
	/* A browser would save application/yaml instead of showing it. */
	bool browser = request->work.accept && strstr(request->work.accept, "text/html");
	request->reply.content_type = browser ? "text/plain; charset=utf-8" : "application/yaml";
	gnpd_reply_header(request, "Vary", "Accept");
	return gnp_buffer_append(&request->reply.body, document->data, document->size, error);
}
