/* The tables of routes: one of the listener of requests, one of the admin listener. */
#ifndef GNPD_ROUTES_H
#define GNPD_ROUTES_H

#include <stdbool.h>

#include "core/base/status.h"
#include "server/access/scope.h"
#include "server/api/request.h"

/* Fills request->reply. On failure http.c answers with the error. */
typedef gnp_status (*gnpd_handler)(struct gnpd_request *request, struct gnp_error *error);

/* Where a handler runs. A body is kept for POSTs that are not answered at once, and dropped else. */
enum gnpd_where {
	GNPD_AT_ONCE,   /* in the HTTP thread */
	GNPD_ON_RUNNER, /* computes */
	GNPD_BY_DISK_QUEUE    /* waits for the disk, not for those that compute */
};

struct gnpd_route {
	const char *method;    /* GET also answers HEAD */
	const char *path;      /* segments; {model}, {version} and {job} take any one segment; "*": the server as a whole */
	gnpd_handler handler;
	enum gnpd_where work;
	enum gnpd_label label; /* GNPD_LABEL_OPERATION: that of the operation the path names */
	enum gnpd_scope scope;
};

/* Sets request->route, model, version and label. GNP_NOT_FOUND or GNP_METHOD_NOT_ALLOWED; an unknown model is not found
 * as well. */
gnp_status gnpd_routes_match(struct gnpd_request *request, struct gnp_error *error);

/* The i-th route of a listener; NULL past the last. */
const struct gnpd_route *gnpd_routes_at(bool admin, size_t i);

/* How bodies of the route are encoded; NULL where headers and body tell. */
const struct gnpd_codec *gnpd_routes_codec(const struct gnpd_route *route);

/* The methods the request's path allows, as an Allow header lists them; "" when there is no such path. */
void gnpd_routes_allow(const struct gnpd_request *request, char *text, size_t capacity);
/* Those that any path of the request's listener allows. */
void gnpd_routes_methods(const struct gnpd_request *request, char *text, size_t capacity);

/* job_routes.c, and admin.c too: appends the query's parameters, of which all must be among `known` (NULL-terminated). */
gnp_status gnpd_query_read(struct gnpd_request *request, const char *const *known, struct gnp_values *values, struct gnp_error *error);

/* The handlers: system.c, admin.c, v2.c, v1.c, job_routes.c. */
gnp_status gnpd_system_live(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_system_ready(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_system_metrics(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_system_openapi(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_system_options(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_admin_reload(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_admin_reloaded(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_admin_log_level(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_admin_set_log_level(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_admin_config(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_v2_server(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_v2_index(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_v2_model(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_v2_model_ready(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_v2_model_config(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_v2_model_stats(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_v2_infer(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_v1_operation(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_jobs_post(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_jobs_list_all(struct gnpd_request *request, struct gnp_error *error);
/* May leave the request without a reply but with a watch: then it waits, and gnpd_jobs_polled fills the reply. */
gnp_status gnpd_jobs_get(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_jobs_polled(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_jobs_events(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_jobs_result(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_jobs_remove(struct gnpd_request *request, struct gnp_error *error);

#endif
