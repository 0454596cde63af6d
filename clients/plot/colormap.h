/* Turns numbers into colours: a diverging blue-white-red map, robust limits, round tick values. */
#ifndef GNP_CLIENTS_COLORMAP_H
#define GNP_CLIENTS_COLORMAP_H

#include <stddef.h>

#include "clients/plot/picture.h"
#include "core/base/status.h"

struct gnp_value_range {
	double low, high; /* low < high */
};

/* The 2nd and 98th percentile of the finite values; symmetric around 0 where they have different signs; widened where
 * they coincide. 0..1 when no value is finite. GNP_OUT_OF_MEMORY. */
gnp_status gnp_colormap_limits(const double *values, size_t count, struct gnp_value_range *limits,
                               struct gnp_error *error);

/* Blue at low, white halfway, red at high; what lies beyond is as the end. NaN is grey. */
struct gnp_color gnp_colormap_color(const struct gnp_value_range *limits, double value);

/* Round values within the limits, at most `most`, ascending, a step of 1, 2 or 5 times a power of ten. Returns how many. */
size_t gnp_colormap_ticks(const struct gnp_value_range *limits, size_t most, double *ticks);

#endif
