#include "server/api/request.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/names.h"
#include "proto/oip/oip.h"
#include "server/api/server.h"
#include "server/config/config.h"

/* For the body of an error with its status's own sentence. */
enum { SPARE_BYTES = 512 };

struct gnpd_request *gnpd_request_create(struct gnpd_server *server, const char *uri)
{
	struct gnpd_request *request = calloc(1, sizeof *request);
	if (!request)
		return NULL;
	request->server = server;
	request->started = gnp_clock();
	gnpd_request_set_id(request, NULL);
	if (gnp_buffer_reserve(&request->spare, SPARE_BYTES, NULL) != GNP_OK || gnpd_target_parse(uri, &request->target) != GNP_OK) {
		gnp_buffer_clear(&request->spare);
		free(request);
		return NULL;
	}
	gnpd_work_init(&request->work, &server->engine, &request->reply);
	return request;
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
	gnpd_request_leave(request);
	gnpd_principal_release(request->who);
	gnpd_reply_clear(&request->reply);
	gnpd_watch_clear(&request->watch);
	gnpd_work_clear(&request->work);
	gnp_buffer_clear(&request->spare);
	gnpd_target_clear(&request->target);
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

static gnp_status unknown_parameter(const char *name, const char *const *known, struct gnp_error *error)
{
	struct gnp_names list;
	gnp_names_begin(&list, name, strlen(name));
	for (size_t k = 0; known[k]; k++)
		gnp_names_add(&list, known[k]);
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "unknown parameter \"%.60s\", known: %s", name,
	                     gnp_names_end(&list));
}

gnp_status gnpd_request_query(const struct gnpd_request *request, const char *const *known, struct gnp_values *values,
                              struct gnp_error *error)
{
	gnp_status status = gnpd_query_parse(request->target.query, values, error);
	for (size_t i = 0; i < values->count && status == GNP_OK; i++) {
		const char *name = values->items[i].name;
		size_t k = 0;
		while (known[k] && strcmp(name, known[k]) != 0)
			k++;
		if (!known[k])
			status = unknown_parameter(name, known, error);
	}
	return status;
}

gnp_status gnpd_request_no_query(const struct gnpd_request *request, struct gnp_error *error)
{
	static const char *const none[] = {NULL};
	struct gnp_values values = {0};
	gnp_status status = gnpd_request_query(request, none, &values, error);
	gnp_values_clear(&values);
	return status;
}

void gnpd_reply_header(struct gnpd_request *request, const char *name, const char *format, ...)
{
	char value[256];
	va_list arguments;
	va_start(arguments, format);
	vsnprintf(value, sizeof value, format, arguments);
	va_end(arguments);
	gnpd_reply_add(&request->reply, name, "%s", value);
}

void gnpd_reply_error(struct gnpd_request *request, const struct gnp_error *error)
{
	gnp_status status = error->status == GNP_OK ? GNP_INTERNAL : error->status;
	bool close = request->reply.close;
	gnpd_reply_clear(&request->reply);
	request->status = status;
	request->reply.close = close;
	request->reply.code = gnp_status_http(status);
	request->reply.content_type = "application/json";
	if (gnpd_reply_retries(status))
		gnpd_reply_header(request, "Retry-After", "%.0f", request->retry_after > 0 ? ceil(request->retry_after)
		                                                  : request->server->engine.config->retry_after_seconds);
	if (status == GNP_UNAUTHORIZED)
		gnpd_reply_header(request, "WWW-Authenticate", "Bearer");
	if (status == GNP_METHOD_NOT_ALLOWED)
		gnpd_reply_header(request, "Allow", "%s", request->allowed);
	if (gnp_oip_error_body(status, error->text[0] ? error->text : gnp_status_text(status), request->id, &request->reply.body) == GNP_OK)
		return;
	gnp_buffer_clear(&request->reply.body);
	request->reply.body = request->spare;
	request->spare = (struct gnp_buffer){0};
	gnp_oip_error_body(status, gnp_status_text(status), request->id, &request->reply.body);
}
