/* What one route is: a method and a path, and who answers. */
#ifndef GNPD_ROUTE_H
#define GNPD_ROUTE_H

#include "core/base/status.h"
#include "server/access/scope.h"
#include "server/base/metrics.h"

struct gnpd_request;

/* Fills request->reply. On failure http.c answers with the error. */
typedef gnp_status (*gnpd_handler)(struct gnpd_request *request, struct gnp_error *error);

/* Where a handler runs. A body is kept for POSTs that are not answered at once, and dropped else. */
enum gnpd_where {
	GNPD_AT_ONCE,      /* in the HTTP thread */
	GNPD_ON_RUNNER,    /* computes */
	GNPD_BY_DISK_QUEUE /* waits for the disk, not for those that compute */
};

struct gnpd_route {
	const char *method;    /* GET also answers HEAD */
	const char *path;      /* segments; {model}, {version} and {job} take any one segment; "*": the server as a whole */
	gnpd_handler handler;
	enum gnpd_where work;
	enum gnpd_label label; /* GNPD_LABEL_OPERATION: that of the operation the path names */
	enum gnpd_scope scope;
};

#endif
