/* The one table of routes. */
#ifndef GNPD_ROUTES_H
#define GNPD_ROUTES_H

#include <stdbool.h>

#include "request.h"
#include "status.h"

/* Fills request->reply. On failure http.c answers with the error. */
typedef gnp_status (*gnpd_handler)(struct gnpd_request *request, struct gnp_error *error);

/* What a caller must be allowed to. */
enum gnpd_scope { GNPD_SCOPE_NONE, GNPD_SCOPE_INFER, GNPD_SCOPE_JOBS, GNPD_SCOPE_ADMIN };

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

/* The methods a path allows, as an Allow header lists them; "" when there is no such path. */
const char *gnpd_routes_allow(const struct gnpd_target *target);

/* The handlers: system.c, v2.c, v1.c. */
gnp_status gnpd_system_live(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_system_ready(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_system_metrics(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_system_openapi(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_v2_server(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_v2_index(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_v2_model(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_v2_model_ready(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_v2_model_stats(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_v2_infer(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_v1_operation(struct gnpd_request *request, struct gnp_error *error);

#endif
