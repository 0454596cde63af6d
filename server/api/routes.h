/* The tables of routes: one of the listener of requests, one of the admin listener. */
#ifndef GNPD_ROUTES_H
#define GNPD_ROUTES_H

#include <stdbool.h>

#include "core/base/status.h"
#include "server/api/request.h"
#include "server/api/route.h"

struct gnpd_codec;

/* Sets request->route, model, version and label. GNP_NOT_FOUND, also where the model is unknown, or
 * GNP_METHOD_NOT_ALLOWED, which sets request->allowed. */
gnp_status gnpd_routes_match(struct gnpd_request *request, struct gnp_error *error);

/* The i-th route of a listener; NULL past the last. */
const struct gnpd_route *gnpd_routes_at(bool admin, size_t i);

/* How bodies of the route are encoded; NULL where headers and body tell. */
const struct gnpd_codec *gnpd_routes_codec(const struct gnpd_route *route);

/* The methods that any path of the request's listener allows, as an Allow header lists them. */
void gnpd_routes_methods(const struct gnpd_request *request, char *text, size_t capacity);

#endif
