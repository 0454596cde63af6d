/* Health, metrics and the OpenAPI document: answered in the HTTP thread, whatever the workers do. */
#include "routes.h"
#include "server.h"

gnp_status gnpd_system_live(struct gnpd_request *request, struct gnp_error *error)
{
	request->reply.code = 200;
	request->reply.content_type = "application/json";
	return gnp_buffer_printf(&request->reply.body, error, "{\"live\":true}\n");
}

gnp_status gnpd_system_ready(struct gnpd_request *request, struct gnp_error *error)
{
	if (atomic_load(&request->server->draining))
		return gnp_error_set(error, GNP_DRAINING, "%s", gnp_status_text(GNP_DRAINING));
	request->reply.code = 200;
	request->reply.content_type = "application/json";
	return gnp_buffer_printf(&request->reply.body, error, "{\"ready\":true}\n");
}

gnp_status gnpd_system_metrics(struct gnpd_request *request, struct gnp_error *error)
{
	const struct gnpd_server *server = request->server;
	struct gnpd_queue_state state = gnpd_queue_state(server->queue);
	request->reply.code = 200;
	request->reply.content_type = "text/plain; version=0.0.4; charset=utf-8";
	const struct gnp_prepared_cache_state cache = gnp_prepared_cache_state(server->cache);
	gnp_status status = gnpd_metrics_write(&server->metrics, &state, &cache, gnp_pool_workers(server->pool), &request->reply.body, error);
	return status == GNP_OK ? gnpd_jobs_metrics_write(server->jobs, &request->reply.body, error) : status;
}

gnp_status gnpd_system_openapi(struct gnpd_request *request, struct gnp_error *error)
{
	const struct gnp_buffer *document = &request->server->openapi;
	request->reply.code = 200;
	request->reply.content_type = "application/yaml";
	return gnp_buffer_append(&request->reply.body, document->data, document->size, error);
}
