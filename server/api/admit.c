#include "server/api/admit.h"

#include <stdio.h>

#include "server/api/routes.h"
#include "server/api/server.h"

static gnp_status check_scope(const struct gnpd_request *request, unsigned scopes, struct gnp_error *error)
{
	enum gnpd_scope scope = request->route->scope;
	if (scopes & 1u << scope)
		return GNP_OK;
	gnpd_metrics_reject(request->server->engine.metrics, GNPD_REJECT_FORBIDDEN);
	return gnp_error_set(error, GNP_FORBIDDEN, "key %s: has not the scope %s, which this needs", request->principal,
	                     gnpd_scope_name(scope));
}

static gnp_status enter(struct gnpd_request *request, struct gnp_error *error)
{
	enum gnpd_limit limit;
	gnp_status status = gnpd_principal_enter(request->who, gnp_clock(), &limit, &request->retry_after, error);
	request->entered = status == GNP_OK;
	if (status != GNP_OK)
		gnpd_metrics_reject(request->server->engine.metrics,
		                    limit == GNPD_LIMIT_RATE ? GNPD_REJECT_KEY_RATE : GNPD_REJECT_KEY_CONCURRENCY);
	return status;
}

gnp_status gnpd_admit(struct gnpd_request *request, bool known, struct gnp_error *error)
{
	struct gnpd_server *server = request->server;
	unsigned scopes = 0;
	if (!gnpd_guard_on(server->guard) || (known && request->route->scope == GNPD_SCOPE_NONE))
		return GNP_OK;
	gnp_status status = gnpd_guard_identify(server->guard, &request->credentials, &request->who, &scopes, error);
	if (status != GNP_OK) {
		gnpd_metrics_reject(server->engine.metrics, GNPD_REJECT_UNAUTHORIZED);
		return status;
	}
	snprintf(request->principal, sizeof request->principal, "%s", gnpd_principal_name(request->who));
	if (known)
		status = check_scope(request, scopes, error);
	return status == GNP_OK ? enter(request, error) : status;
}
