#include "core/base/check.h"

gnp_status gnp_check_integer(const char *name, int value, int least, int most, struct gnp_error *error)
{
	if (value >= least && value <= most)
		return GNP_OK;
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: got %d, need %d..%d", name, value, least, most);
}

gnp_status gnp_check_number(const char *name, double value, double least, double most, struct gnp_error *error)
{
	if (value >= least && value <= most)
		return GNP_OK;
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: got %g, need %g..%g", name, value, least, most);
}

gnp_status gnp_check_above(const char *name, double value, double least, double most, struct gnp_error *error)
{
	if (value > least && value <= most)
		return GNP_OK;
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: got %g, need a number above %g and at most %g", name, value, least, most);
}
