#include "server/api/routes.h"

#include <stdio.h>
#include <string.h>

#include "core/base/names.h"
#include "proto/operation/operations.h"
#include "server/api/admin.h"
#include "server/api/job_list.h"
#include "server/api/job_result.h"
#include "server/api/job_routes.h"
#include "server/api/system.h"
#include "server/api/v1.h"
#include "server/api/v2.h"
#include "server/work/codec_file.h"
#include "server/work/codec_oip.h"

static const struct gnpd_route routes[] = {
	{"GET", "/v2", gnpd_v2_server, GNPD_AT_ONCE, GNPD_LABEL_METADATA, GNPD_SCOPE_INFER},
	{"GET", "/v2/health/live", gnpd_system_live, GNPD_AT_ONCE, GNPD_LABEL_HEALTH, GNPD_SCOPE_NONE},
	{"GET", "/v2/health/ready", gnpd_system_ready, GNPD_AT_ONCE, GNPD_LABEL_HEALTH, GNPD_SCOPE_NONE},
	{"POST", "/v2/repository/index", gnpd_v2_index, GNPD_AT_ONCE, GNPD_LABEL_METADATA, GNPD_SCOPE_INFER},
	{"GET", "/v2/models/{model}", gnpd_v2_model, GNPD_AT_ONCE, GNPD_LABEL_METADATA, GNPD_SCOPE_INFER},
	{"GET", "/v2/models/{model}/ready", gnpd_v2_model_ready, GNPD_AT_ONCE, GNPD_LABEL_HEALTH, GNPD_SCOPE_NONE},
	{"GET", "/v2/models/{model}/stats", gnpd_v2_model_stats, GNPD_AT_ONCE, GNPD_LABEL_METADATA, GNPD_SCOPE_INFER},
	{"GET", "/v2/models/{model}/config", gnpd_v2_model_config, GNPD_AT_ONCE, GNPD_LABEL_METADATA, GNPD_SCOPE_INFER},
	{"POST", "/v2/models/{model}/infer", gnpd_v2_infer, GNPD_ON_RUNNER, GNPD_LABEL_OPERATION, GNPD_SCOPE_INFER},
	{"GET", "/v2/models/{model}/versions/{version}", gnpd_v2_model, GNPD_AT_ONCE, GNPD_LABEL_METADATA, GNPD_SCOPE_INFER},
	{"GET", "/v2/models/{model}/versions/{version}/ready", gnpd_v2_model_ready, GNPD_AT_ONCE, GNPD_LABEL_HEALTH, GNPD_SCOPE_NONE},
	{"GET", "/v2/models/{model}/versions/{version}/stats", gnpd_v2_model_stats, GNPD_AT_ONCE, GNPD_LABEL_METADATA, GNPD_SCOPE_INFER},
	{"GET", "/v2/models/{model}/versions/{version}/config", gnpd_v2_model_config, GNPD_AT_ONCE, GNPD_LABEL_METADATA, GNPD_SCOPE_INFER},
	{"POST", "/v2/models/{model}/versions/{version}/infer", gnpd_v2_infer, GNPD_ON_RUNNER, GNPD_LABEL_OPERATION, GNPD_SCOPE_INFER},
	{"POST", "/v1/{model}", gnpd_v1_operation, GNPD_ON_RUNNER, GNPD_LABEL_OPERATION, GNPD_SCOPE_INFER},
	{"POST", "/v1/jobs/{model}", gnpd_job_routes_post, GNPD_BY_DISK_QUEUE, GNPD_LABEL_JOBS, GNPD_SCOPE_JOBS},
	{"GET", "/v1/jobs", gnpd_job_list, GNPD_AT_ONCE, GNPD_LABEL_JOBS, GNPD_SCOPE_JOBS},
	{"GET", "/v1/jobs/{job}", gnpd_job_routes_get, GNPD_AT_ONCE, GNPD_LABEL_JOBS, GNPD_SCOPE_JOBS},
	{"DELETE", "/v1/jobs/{job}", gnpd_job_routes_remove, GNPD_BY_DISK_QUEUE, GNPD_LABEL_JOBS, GNPD_SCOPE_JOBS},
	{"GET", "/v1/jobs/{job}/events", gnpd_job_routes_events, GNPD_AT_ONCE, GNPD_LABEL_JOBS, GNPD_SCOPE_JOBS},
	{"GET", "/v1/jobs/{job}/result", gnpd_job_result, GNPD_AT_ONCE, GNPD_LABEL_JOBS, GNPD_SCOPE_JOBS},
	{"GET", "/metrics", gnpd_system_metrics, GNPD_AT_ONCE, GNPD_LABEL_METRICS, GNPD_SCOPE_ADMIN},
	{"GET", "/openapi.yaml", gnpd_system_openapi, GNPD_AT_ONCE, GNPD_LABEL_OPENAPI, GNPD_SCOPE_NONE},
	{"OPTIONS", "*", gnpd_system_options, GNPD_AT_ONCE, GNPD_LABEL_OTHER, GNPD_SCOPE_NONE},
};

/* Without keys for what only reads: the listener is out of reach of others, or asks for keys where it changes or shows more. */
static const struct gnpd_route admin_routes[] = {
	{"GET", "/v2", gnpd_v2_server, GNPD_AT_ONCE, GNPD_LABEL_METADATA, GNPD_SCOPE_NONE},
	{"GET", "/v2/health/live", gnpd_system_live, GNPD_AT_ONCE, GNPD_LABEL_HEALTH, GNPD_SCOPE_NONE},
	{"GET", "/v2/health/ready", gnpd_system_ready, GNPD_AT_ONCE, GNPD_LABEL_HEALTH, GNPD_SCOPE_NONE},
	{"GET", "/metrics", gnpd_system_metrics, GNPD_AT_ONCE, GNPD_LABEL_METRICS, GNPD_SCOPE_NONE},
	{"GET", "/admin/reload", gnpd_admin_reloaded, GNPD_AT_ONCE, GNPD_LABEL_ADMIN, GNPD_SCOPE_ADMIN},
	{"POST", "/admin/reload", gnpd_admin_reload, GNPD_AT_ONCE, GNPD_LABEL_ADMIN, GNPD_SCOPE_ADMIN},
	{"GET", "/admin/log-level", gnpd_admin_log_level, GNPD_AT_ONCE, GNPD_LABEL_ADMIN, GNPD_SCOPE_ADMIN},
	{"PUT", "/admin/log-level", gnpd_admin_set_log_level, GNPD_AT_ONCE, GNPD_LABEL_ADMIN, GNPD_SCOPE_ADMIN},
	{"GET", "/admin/config", gnpd_admin_config, GNPD_AT_ONCE, GNPD_LABEL_ADMIN, GNPD_SCOPE_ADMIN},
	{"OPTIONS", "*", gnpd_system_options, GNPD_AT_ONCE, GNPD_LABEL_OTHER, GNPD_SCOPE_NONE},
};

enum { ROUTES = sizeof routes / sizeof routes[0], ADMIN_ROUTES = sizeof admin_routes / sizeof admin_routes[0] };

const struct gnpd_route *gnpd_routes_at(bool admin, size_t i)
{
	if (admin)
		return i < ADMIN_ROUTES ? &admin_routes[i] : NULL;
	return i < ROUTES ? &routes[i] : NULL;
}

struct captures {
	const char *model, *version, *job;
};

static bool match_path(const char *pattern, const struct gnpd_target *target, struct captures *captures)
{
	*captures = (struct captures){NULL, NULL, NULL};
	if (target->whole)
		return strcmp(pattern, "*") == 0;
	if (!target->valid)
		return false;
	for (unsigned i = 0; i < target->count; i++) {
		const char *segment = target->segments[i];
		if (*pattern++ != '/')
			return false;
		size_t length = strcspn(pattern, "/");
		if (strncmp(pattern, "{model}", length) == 0)
			captures->model = segment;
		else if (strncmp(pattern, "{version}", length) == 0)
			captures->version = segment;
		else if (strncmp(pattern, "{job}", length) == 0)
			captures->job = segment;
		else if (strlen(segment) != length || memcmp(pattern, segment, length) != 0)
			return false;
		pattern += length;
	}
	return *pattern == '\0';
}

/* "jobs" is no {model}: where a path is spelt out, the patterns that would capture it are others' paths. */
static bool spelt_out(const struct gnpd_request *request)
{
	const struct gnpd_route *route;
	struct captures captures;
	for (size_t i = 0; (route = gnpd_routes_at(request->admin, i)) != NULL; i++)
		if (!strchr(route->path, '{') && match_path(route->path, &request->target, &captures))
			return true;
	return false;
}

static bool match_route(const struct gnpd_request *request, const struct gnpd_route *route, bool spelt, struct captures *captures)
{
	return match_path(route->path, &request->target, captures) && !(spelt && strchr(route->path, '{'));
}

static bool match_method(const struct gnpd_route *route, const char *method)
{
	return strcmp(route->method, method) == 0 || (strcmp(route->method, "GET") == 0 && strcmp(method, "HEAD") == 0);
}

/* Appends a method to what an Allow header lists, once. */
static void add_method(const char *method, char *text, size_t capacity)
{
	size_t size = strlen(text);
	if (!strstr(text, method))
		snprintf(text + size, capacity - size, "%s%s%s", size ? ", " : "", method, strcmp(method, "GET") == 0 ? ", HEAD" : "");
}

/* The methods the request's path allows, as an Allow header lists them; "" when there is no such path. */
static void list_allowed(const struct gnpd_request *request, char *text, size_t capacity)
{
	const struct gnpd_route *route;
	struct captures captures;
	bool spelt = spelt_out(request);
	text[0] = '\0';
	for (size_t i = 0; (route = gnpd_routes_at(request->admin, i)) != NULL; i++)
		if (match_route(request, route, spelt, &captures))
			add_method(route->method, text, capacity);
}

void gnpd_routes_methods(const struct gnpd_request *request, char *text, size_t capacity)
{
	const struct gnpd_route *route;
	text[0] = '\0';
	for (size_t i = 0; (route = gnpd_routes_at(request->admin, i)) != NULL; i++)
		add_method(route->method, text, capacity);
}

const struct gnpd_codec *gnpd_routes_codec(const struct gnpd_route *route)
{
	return route->handler == gnpd_v1_operation ? &gnpd_codec_file : route->handler == gnpd_v2_infer ? &gnpd_codec_oip : NULL;
}

static gnp_status unknown_model(const char *model, struct gnp_error *error)
{
	struct gnp_names known;
	gnp_names_begin(&known, model, strlen(model));
	for (size_t i = 0; gnp_operation_at(i); i++)
		gnp_names_add(&known, gnp_operation_at(i)->name);
	return gnp_error_set(error, GNP_NOT_FOUND, "model: got \"%.64s\", known: %s", model, gnp_names_end(&known));
}

/* The model and its version exist; the label becomes the operation's where the route says so. */
static gnp_status resolve_model(struct gnpd_request *request, struct gnp_error *error)
{
	if (!request->model)
		return GNP_OK;
	const struct gnp_operation *operation = gnp_operation_find(request->model);
	if (operation && request->label == GNPD_LABEL_OPERATION)
		request->label = gnpd_metrics_label(operation);
	if (!operation) {
		request->label = GNPD_LABEL_OTHER;
		return unknown_model(request->model, error);
	}
	if (request->version && strcmp(request->version, "1") != 0)
		return gnp_error_set(error, GNP_NOT_FOUND, "version: got \"%.64s\", known: 1", request->version);
	return GNP_OK;
}

gnp_status gnpd_routes_match(struct gnpd_request *request, struct gnp_error *error)
{
	bool path_known = false, spelt = spelt_out(request);
	const struct gnpd_route *route;
	for (size_t i = 0; (route = gnpd_routes_at(request->admin, i)) != NULL; i++) {
		struct captures captures;
		if (!match_route(request, route, spelt, &captures))
			continue;
		path_known = true;
		if (!match_method(route, request->method))
			continue;
		request->route = route;
		request->model = captures.model;
		request->version = captures.version;
		request->job_id = captures.job;
		request->label = route->label;
		return resolve_model(request, error);
	}
	list_allowed(request, request->allowed, sizeof request->allowed);
	if (path_known)
		return gnp_error_set(error, GNP_METHOD_NOT_ALLOWED, "method: got %s, need %s", request->method,
		                     request->allowed);
	return gnp_error_set(error, GNP_NOT_FOUND, "path: there is no \"%.100s\"", request->target.path);
}
