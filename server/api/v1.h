/* POST /v1/{operation}: files in, files out (codec_file.h says in which formats). */
#ifndef GNPD_V1_H
#define GNPD_V1_H

#include "core/base/status.h"
#include "server/api/request.h"

gnp_status gnpd_v1_operation(struct gnpd_request *request, struct gnp_error *error);

#endif
