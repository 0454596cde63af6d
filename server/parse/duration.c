#include "server/parse/duration.h"

#include <string.h>

#include "proto/tensor/number.h"

gnp_status gnpd_duration_parse(const char *name, const char *text, double *seconds, struct gnp_error *error)
{
	static const struct {
		const char *unit;
		double seconds;
	} units[] = {{"", 1}, {"s", 1}, {"ms", 1e-3}, {"us", 1e-6}, {"m", 60}, {"h", 3600}};
	double value = -1;
	const char *unit = gnp_number_read_json(text, text + strlen(text), &value);
	for (size_t i = 0; unit && i < sizeof units / sizeof units[0]; i++) {
		double length = value * units[i].seconds;
		if (strcmp(unit, units[i].unit) != 0 || !(length >= 0 && length <= 1e9))
			continue;
		*seconds = length;
		return GNP_OK;
	}
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: got \"%.60s\", need a time such as 30s, 500ms, 250us, 2m or 1h", name, text);
}
