/* The OpenAPI document: every route of the server, with the parameters, formats and schemas of every operation.
 *
 * What stands in the tree as server/openapi.yaml, and is served as /openapi.yaml. A test holds it to the tables of
 * routes. */
#ifndef GNPD_OPENAPI_H
#define GNPD_OPENAPI_H

#include "core/base/status.h"
#include "proto/tensor/buffer.h"

/* Appends it. On failure *buffer holds part of it. */
gnp_status gnpd_openapi_write(struct gnp_buffer *buffer, struct gnp_error *error);

#endif
