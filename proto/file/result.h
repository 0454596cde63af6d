/* Encodes a response as a file: its outputs with the points they belong to. Bodies of /v1 and the command line's
 * answers. */
#ifndef GNP_PROTO_RESULT_H
#define GNP_PROTO_RESULT_H

#include "core/base/status.h"
#include "proto/format/format.h"
#include "proto/operation/call.h"
#include "proto/tensor/message.h"

/* Before anything is computed: whether the answer to a call in this format is sure to have every output that was
 * named or that is not optional. A format that nobody asked for should. */
bool gnp_result_fits(const struct gnp_format *format, const struct gnp_call *call);
/* Before anything is computed: GNP_NOT_ACCEPTABLE when gnp_result_encode is sure to fail, whatever the answer's
 * numbers. */
gnp_status gnp_result_check(const struct gnp_format *format, const struct gnp_call *call, struct gnp_error *error);

/* The points are the response's, else the request's. NPZ and JSON carry every output, formats made of rows those
 * with as many rows as the points have; a comment `left_out` names the others. GNP_NOT_ACCEPTABLE when none of the
 * outputs can be carried, or when the format needs points and there are none. On failure *buffer holds what it held. */
gnp_status gnp_result_encode(const struct gnp_format *format, const struct gnp_request *request,
                             const struct gnp_response *response, struct gnp_buffer *buffer, struct gnp_error *error);

#endif
