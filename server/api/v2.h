/* Answers /v2, the Open Inference Protocol: server and model metadata, infer. */
#ifndef GNPD_V2_H
#define GNPD_V2_H

#include "core/base/status.h"
#include "server/api/request.h"

gnp_status gnpd_v2_server(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_v2_index(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_v2_model(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_v2_model_ready(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_v2_model_config(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_v2_model_stats(struct gnpd_request *request, struct gnp_error *error);
gnp_status gnpd_v2_infer(struct gnpd_request *request, struct gnp_error *error);

#endif
