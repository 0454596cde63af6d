/* A response as a file: its outputs with the points they belong to. Bodies of /v1 and the command line's answers. */
#ifndef GNP_PROTO_RESULT_H
#define GNP_PROTO_RESULT_H

#include "file.h"
#include "message.h"
#include "status.h"

/* The points are the response's, else the request's. NPZ and JSON carry every output, formats made of rows those with as many rows
 * as the points have; a comment `left_out` names the others. GNP_NOT_ACCEPTABLE when none of the outputs can be carried, or when the
 * format needs points and there are none. On failure *buffer holds what it held. */
gnp_status gnp_result_encode(enum gnp_format format, const struct gnp_request *request, const struct gnp_response *response,
                             struct gnp_buffer *buffer, struct gnp_error *error);

#endif
