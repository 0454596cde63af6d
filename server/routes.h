/* The tables of routes: one of the listener of requests, one of the admin listener. */
#ifndef GNPD_ROUTES_H
#define GNPD_ROUTES_H

#include <stdbool.h>

#include "request.h"
#include "scope.h"
#include "status.h"

/* Fills request->reply. On failure http.c answers with the error. */
typedef gnp_status (*gnpd_handler)(struct gnpd_request *request, struct gnp_error *error);

struct gnpd_route {
	const char *method;    /* GET also answers HEAD */
	const char *path;      /* segments; {model} and {version} take any one segment */
	gnpd_handler handler;
	bool work;             /* runs on a runner with the body; else in the HTTP thread, at once, the body discarded */
	enum gnpd_label label; /* GNPD_LABEL_OPERATION: that of the operation the path names */
	enum gnpd_scope scope;
};

/* Sets request->route, model, version and label. GNP_NOT_FOUND or GNP_METHOD_NOT_ALLOWED; an unknown model is not found
 * as well. */
gnp_status gnpd_routes_match(struct gnpd_request *request, struct gnp_error *error);

/* The methods the request's path allows, as an Allow header lists them; "" when there is no such path. */
void gnpd_routes_allow(const struct gnpd_request *request, char *text, size_t capacity);

/* The handlers: system.c, admin.c, v2.c, v1.c. */
gnp_status gnpd_system_live(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_system_ready(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_system_metrics(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_system_openapi(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_admin_reload(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_admin_reloaded(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_admin_log_level(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_admin_set_log_level(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_admin_config(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_v2_server(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_v2_index(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_v2_model(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_v2_model_ready(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_v2_model_stats(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_v2_infer(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_v1_operation(struct gnpd_request *request, struct gnp_error *error);

#endif
