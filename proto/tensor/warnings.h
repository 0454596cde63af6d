/* The warnings of an answer on the wire: one parameter of its report, in which they are joined by "; " and out of
 * which they are taken. */
#ifndef GNP_PROTO_WARNINGS_H
#define GNP_PROTO_WARNINGS_H

#include "core/base/warning.h"
#include "proto/tensor/message.h"

/* The parameter's name. */
#define GNP_WARNINGS_NAME "warnings"

/* Adds the parameter, unless there are none. */
gnp_status gnp_warnings_report(const struct gnp_warnings *warnings, struct gnp_values *report, struct gnp_error *error);

/* The joined text of a report; "" where there are none. */
const char *gnp_warnings_of(const struct gnp_values *report);
/* The next warning of a joined text: *text (*length), and *joined is what is left; false at the end. */
bool gnp_warnings_next(const char **joined, const char **text, size_t *length);
size_t gnp_warnings_joined_count(const char *joined);

#endif
