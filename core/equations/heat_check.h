/* Checks whether heat can be believed: it is nowhere more than where it began hottest, nor less than where it began
 * coldest, but for what sources add, and in all it stays the same but for that. Records a warning with the value found
 * and its limit (warning.h). */
#ifndef GNP_CORE_HEAT_CHECK_H
#define GNP_CORE_HEAT_CHECK_H

#include "core/base/warning.h"
#include "core/operators/domain.h"

/* Of one column, over the points that take part; fixed ones have their values from the start. */
struct gnp_heat_range {
	double low, high;   /* what u may be */
	double total, area; /* its integral, that of 1 */
};

/* u, source (n, count): at the start; source may be NULL. time: from there to the end. */
struct gnp_heat_range gnp_heat_expect(const struct gnp_domain *domain, const double *u, const double *source,
                                      size_t count, size_t column, double time);
/* u (n, count), ranges (count): at the end. given: heat comes and goes where u is fixed, its total is not looked at.
 * advice: what the warning says besides; NULL: nothing. warnings may be NULL. */
void gnp_heat_check(const struct gnp_domain *domain, const double *u, size_t count, const struct gnp_heat_range *ranges,
                    bool given, const char *advice, struct gnp_warnings *warnings);

#endif
