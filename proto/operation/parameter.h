/* Parameters of an operation: from text or a typed value to a field of its options, with the refusal that names the
 * range. */
#ifndef GNP_PROTO_PARAMETER_H
#define GNP_PROTO_PARAMETER_H

#include <stdbool.h>

#include "core/base/status.h"
#include "proto/operation/operation.h"
#include "proto/tensor/message.h"

/* Sets one field of an options struct: from text, as query strings and command lines give it, or from a value as
 * JSON does. A value of another type than the parameter's is taken for its text. Unknown name: GNP_INVALID_ARGUMENT
 * with the known ones; on failure the options are unchanged. */
gnp_status gnp_parameter_parse(const struct gnp_operation *operation, void *options, const char *name,
                               const char *text, struct gnp_error *error);
gnp_status gnp_parameter_set(const struct gnp_operation *operation, void *options, const struct gnp_value *value,
                             struct gnp_error *error);

/* Its default as a user would write it: what the operation's `defaults` sets, as text that gnp_parameter_parse reads
 * back. The room is that of a list of every output. */
#define GNP_PARAMETER_DEFAULT_MAX (64 * GNP_TENSOR_NAME_MAX)
void gnp_parameter_default(const struct gnp_operation *operation, const struct gnp_parameter *parameter,
                           char text[GNP_PARAMETER_DEFAULT_MAX]);

/* Whether a parameter is a number with a range, and that range as texts show it: "12..500", ">0..1e100". */
bool gnp_parameter_is_number(const struct gnp_parameter *parameter);
#define GNP_PARAMETER_RANGE_MAX 80
void gnp_parameter_range(const struct gnp_parameter *parameter, char text[GNP_PARAMETER_RANGE_MAX]);

#endif
