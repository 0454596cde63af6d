/* Checks that the numbers of options are in their ranges. GNP_INVALID_ARGUMENT names the option, the value and the
 * range; a NaN is in none. */
#ifndef GNP_CORE_CHECK_H
#define GNP_CORE_CHECK_H

#include "core/base/status.h"

/* least..most */
gnp_status gnp_check_integer(const char *name, int value, int least, int most, struct gnp_error *error);
gnp_status gnp_check_number(const char *name, double value, double least, double most, struct gnp_error *error);
/* Above least, at most most. */
gnp_status gnp_check_above(const char *name, double value, double least, double most, struct gnp_error *error);

#endif
