/* The help of an operation's parameters, as the command line prints it. */
#ifndef GNP_PROTO_USAGE_H
#define GNP_PROTO_USAGE_H

#include "core/base/status.h"
#include "proto/operation/operation.h"
#include "proto/tensor/buffer.h"

/* Appends two lines for each parameter: its flag with what it takes, and its help with the default; the outputs that
 * a parameter chooses from have a line each. */
gnp_status gnp_operation_usage(const struct gnp_operation *operation, struct gnp_buffer *buffer,
                               struct gnp_error *error);

#endif
