/* Reads lengths of time as clients write them: 30, 30s, 0.5s, 500ms, 250us, 2m, 1h. */
#ifndef GNPD_DURATION_H
#define GNPD_DURATION_H

#include "core/base/status.h"

/* Seconds; a number without a unit means seconds. GNP_INVALID_ARGUMENT naming `name`, the text and what is needed for anything else,
 * a negative number or more than 1e9 s; then *seconds is unchanged. */
gnp_status gnpd_duration_parse(const char *name, const char *text, double *seconds, struct gnp_error *error);

#endif
