#include "clients/plot/colormap.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/vector.h"

gnp_status gnp_colormap_limits(const double *values, size_t count, struct gnp_value_range *limits,
                               struct gnp_error *error)
{
	double *sorted = gnp_array_new(count, sizeof *sorted);
	size_t finite = 0;
	if (!sorted)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "colours: no memory for %zu values", count);
	for (size_t i = 0; i < count; i++)
		if (isfinite(values[i]))
			sorted[finite++] = values[i];
	double low = 0, high = 1;
	if (finite) {
		qsort(sorted, finite, sizeof *sorted, gnp_double_compare);
		low = sorted[(size_t)(0.02 * (double)(finite - 1))];
		high = sorted[(size_t)ceil(0.98 * (double)(finite - 1))];
	}
	free(sorted);
	if (low < 0 && high > 0) {
		high = fmax(-low, high);
		low = -high;
	}
	if (high - low <= 1e-6 * fmax(fabs(low), fabs(high))) {
		double width = low != 0 ? 1e-3 * fabs(low) : 1;
		low -= width;
		high += width;
	}
	*limits = (struct gnp_value_range){low, high};
	return GNP_OK;
}

struct gnp_color gnp_colormap_color(const struct gnp_value_range *limits, double value)
{
	/* Lightness falls off evenly to both sides of a near-white middle. */
	static const double stops[][3] = {{24, 62, 140},   {58, 120, 190},  {132, 182, 222}, {206, 225, 240}, {247, 246, 244},
	                                  {250, 214, 194}, {238, 150, 118}, {208, 76, 66},   {140, 14, 38}};
	enum { PIECES = sizeof stops / sizeof stops[0] - 1 };
	if (isnan(value))
		return (struct gnp_color){150, 150, 150};
	double t = fmin(1, fmax(0, (value - limits->low) / (limits->high - limits->low))) * PIECES;
	int piece = t < PIECES ? (int)t : PIECES - 1;
	double f = t - piece;
	unsigned char rgb[3];
	for (int i = 0; i < 3; i++)
		rgb[i] = (unsigned char)(stops[piece][i] * (1 - f) + stops[piece + 1][i] * f + 0.5);
	return (struct gnp_color){rgb[0], rgb[1], rgb[2]};
}

static size_t ticks_of_step(const struct gnp_value_range *limits, double step, size_t most, double *ticks)
{
	size_t count = 0;
	double slack = 1e-9 * (limits->high - limits->low);
	for (double i = ceil((limits->low - slack) / step); i * step <= limits->high + slack; i++) {
		if (count == most)
			return most + 1;
		ticks[count++] = i * step;
	}
	return count;
}

size_t gnp_colormap_ticks(const struct gnp_value_range *limits, size_t most, double *ticks)
{
	static const double factors[] = {1, 2, 5};
	double power = pow(10, floor(log10((limits->high - limits->low) / (double)(most + 1))));
	for (int i = 0; i < 9; i++) {
		size_t count = ticks_of_step(limits, factors[i % 3] * power, most, ticks);
		if (count <= most)
			return count;
		if (i % 3 == 2)
			power *= 10;
	}
	return 0;
}
