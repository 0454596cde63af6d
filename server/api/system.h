/* Answers health, metrics and the OpenAPI document, in the HTTP thread, whatever the workers do. */
#ifndef GNPD_SYSTEM_H
#define GNPD_SYSTEM_H

#include "core/base/status.h"
#include "server/api/request.h"

gnp_status gnpd_system_live(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_system_ready(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_system_metrics(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_system_openapi(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_system_options(struct gnpd_request *request, struct gnp_error *error);

#endif
