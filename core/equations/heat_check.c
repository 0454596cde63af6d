#include "core/equations/heat_check.h"

#include <math.h>

static const double beyond_most = 0.02, change_most = 0.02; /* of the range: 0.003 where resolved, however rough the start */
static const double rounding = 1e-6;                        /* of the largest value: iterations */

struct gnp_heat_range gnp_heat_expect(const struct gnp_domain *domain, const double *u, const double *source,
                                      size_t count, size_t column, double time)
{
	struct gnp_heat_range range = {.low = INFINITY, .high = -INFINITY};
	double coldest = INFINITY, hottest = -INFINITY;
	for (size_t i = 0; i < domain->prepared.count; i++) {
		size_t at = (size_t)domain->prepared.order[i] * count + column;
		double added = source ? source[at] : 0;
		range.low = fmin(range.low, u[at]);
		range.high = fmax(range.high, u[at]);
		coldest = fmin(coldest, added);
		hottest = fmax(hottest, added);
		range.total += domain->area[i] * (u[at] + time * added);
		range.area += domain->area[i];
	}
	range.low += time * coldest;
	range.high += time * hottest;
	return range;
}

/* What u is at the end, as it is to be expected of the start. Dropped points, which have the local fit's values, are
 * among those it is seen at. */
static struct gnp_heat_range measure(const struct gnp_domain *domain, const double *u, size_t count, size_t column)
{
	struct gnp_heat_range range = gnp_heat_expect(domain, u, NULL, count, column, 0);
	for (size_t i = 0; i < domain->dropped; i++) {
		double value = u[(size_t)domain->dropped_index[i] * count + column];
		range.low = fmin(range.low, value);
		range.high = fmax(range.high, value);
	}
	return range;
}

void gnp_heat_check(const struct gnp_domain *domain, const double *u, size_t count, const struct gnp_heat_range *ranges,
                    bool given, const char *advice, struct gnp_warnings *warnings)
{
	const char *colon = advice ? ": " : "", *more = advice ? advice : "";
	for (size_t c = 0; c < count; c++) {
		struct gnp_heat_range found = measure(domain, u, count, c), may = ranges[c];
		double width = may.high - may.low, error = rounding * fmax(fabs(may.low), fabs(may.high));
		double change = given ? 0 : (found.total - may.total) / may.area;
		if (!(found.low >= may.low - beyond_most * width - error) || !(found.high <= may.high + beyond_most * width + error))
			gnp_warnings_add(warnings, GNP_WARNING_HEAT,
			                 "column %zu is not to be believed: it has values from %.6g to %.6g, heat that began as this "
			                 "did stays within %.6g and %.6g (%g of that range may lie beyond)%s%s", c, found.low,
			                 found.high, may.low, may.high, beyond_most, colon, more);
		else if (!(fabs(change) <= change_most * width + error))
			gnp_warnings_add(warnings, GNP_WARNING_HEAT,
			                 "column %zu is not to be believed: its mean became %.6g, heat is not lost nor made, it would be "
			                 "%.6g (%g of the range from %.3g to %.3g may be off)%s%s", c, found.total / may.area,
			                 may.total / may.area, change_most, may.low, may.high, colon, more);
	}
}
