/* Answers what the admin listener alone has: loading again, the log's level, the configuration. */
#ifndef GNPD_ADMIN_H
#define GNPD_ADMIN_H

#include "core/base/status.h"
#include "server/api/request.h"

gnp_status gnpd_admin_reload(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_admin_reloaded(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_admin_log_level(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_admin_set_log_level(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_admin_config(struct gnpd_request *request, struct gnp_error *error);

#endif
