/* Decides whether the caller of a request may have it: who it is, what its key allows, and the limits of the key.
 * Without a file of keys everybody may have everything. */
#ifndef GNPD_ADMIT_H
#define GNPD_ADMIT_H

#include <stdbool.h>

#include "core/base/status.h"
#include "server/api/request.h"

/* The headers are in and routes matched: known, or not (no such path, method, model). With keys, what is not known needs a key too, so
 * that nobody without one learns which paths there are. Sets the request's principal and counts it as under way; counts
 * refusals. GNP_UNAUTHORIZED, GNP_FORBIDDEN naming the scope, GNP_LIMITED. */
gnp_status gnpd_admit(struct gnpd_request *request, bool known, struct gnp_error *error);

#endif
