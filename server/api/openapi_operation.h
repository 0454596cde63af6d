/* What the OpenAPI document says of one operation: its paths and the body of its requests. */
#ifndef GNPD_OPENAPI_OPERATION_H
#define GNPD_OPENAPI_OPERATION_H

#include "proto/operation/operation.h"
#include "proto/tensor/writer.h"

/* The headers in which an answer says what was done. */
#define GNPD_OPENAPI_REPORT_HEADERS                                          \
	"headers: {X-Gnpd-Warnings: {$ref: '#/components/headers/Warnings'}, "   \
	"X-Gnpd-Parameters: {$ref: '#/components/headers/Parameters'}}"

/* Its paths: /v1/NAME, /v2/models/NAME/infer, /v1/jobs/NAME and what /v2/models/NAME answers. */
void gnpd_openapi_operation_paths(struct gnp_writer *w, const struct gnp_operation *operation);
/* The schema NAME_request, among the components. */
void gnpd_openapi_operation_request(struct gnp_writer *w, const struct gnp_operation *operation);

#endif
