#include "weights/train/any/any_start.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "core/support/weighted_projection.h"
#include "weights/train/initial.h"

static float *tensor(const struct gnp_layout *layout, const char *name, float *parameters, size_t *count)
{
	const struct gnp_parameter_row *row = gnp_layout_find(layout, name);
	*count = row->count;
	return parameters + row->offset;
}

static void set(const struct gnp_layout *layout, const char *name, float value, float *parameters)
{
	size_t count;
	float *row = tensor(layout, name, parameters, &count);
	for (size_t i = 0; i < count; i++)
		row[i] = value;
}

/* Uniform within +-1/sqrt(inputs), made so by its initial draw, becomes +-bound. */
static void set_bound(const struct gnp_layout *layout, const char *name, double bound, float *parameters)
{
	size_t count;
	float *row = tensor(layout, name, parameters, &count);
	double factor = bound * sqrt((double)gnp_layout_find(layout, name)->shape[1]);
	for (size_t i = 0; i < count; i++)
		row[i] = (float)(factor * (double)row[i]);
}

static void set_outputs(const struct gnp_layout *layout, float *parameters)
{
	enum { FREE = 3 }; /* orders whose penalty is next to nothing: height, slope, curvature */
	static const double SMALL = 1e-10, LIGHT = 1e-5;
	size_t count;
	float *bias = tensor(layout, "head.4.bias", parameters, &count);
	for (int order = 0; order <= GNP_TAYLOR_DEGREE; order++)
		bias[GNP_WEIGHTED_RIDGE + order] = (float)(log(order < FREE ? SMALL : LIGHT) / 4);
	bias[GNP_WEIGHTED_SLOPE_BIAS] = -1.5f;
	bias[GNP_WEIGHTED_CREASE] = -2;
	bias[GNP_WEIGHTED_OUTLIER] = -3;
}

void gnp_any_start_parameters(const struct gnp_architecture *architecture, const struct gnp_layout *layout,
                              uint64_t seed, float *parameters)
{
	static const char *const zero[] = {"head.mean",  "head.0.bias",  "head.2.bias", "node.context.bias",
	                                   "frame.mean", "frame.0.bias", "frame.2.bias"};
	gnp_initial_parameters(architecture, layout, seed, parameters);
	for (size_t i = 0; i < sizeof zero / sizeof *zero; i++)
		set(layout, zero[i], 0, parameters);
	set(layout, "head.deviation", 1, parameters);
	set(layout, "frame.deviation", 1, parameters);
	set(layout, "node.2.bias", 1, parameters);
	set_bound(layout, "node.2.weight", 0.1, parameters);
	set_bound(layout, "frame.0.weight", 1.5 / sqrt(gnp_layout_find(layout, "frame.0.weight")->shape[1]), parameters);
	set_bound(layout, "frame.2.weight", 0.1, parameters);
	set_outputs(layout, parameters);
}

/* ---- What follows from data ---- */

gnp_status gnp_any_spread_begin(size_t width, struct gnp_scratch *scratch, struct gnp_any_spread *out,
                                struct gnp_error *error)
{
	double *sums = gnp_scratch_take(scratch, 2 * width, sizeof *sums);
	if (!sums)
		return gnp_no_memory("training", 2 * width, "sums", error);
	memset(sums, 0, 2 * width * sizeof *sums);
	*out = (struct gnp_any_spread){.width = width, .sum = sums, .square = sums + width};
	return GNP_OK;
}

void gnp_any_spread_add(struct gnp_any_spread *spread, const float *row)
{
	for (size_t i = 0; i < spread->width; i++) {
		spread->sum[i] += (double)row[i];
		spread->square[i] += (double)row[i] * (double)row[i];
	}
	spread->count++;
}

void gnp_any_spread_write(const struct gnp_any_spread *spread, const struct gnp_layout *layout, const char *prefix,
                          float *parameters)
{
	static const double LEAST = 1e-2; /* variance added */
	char name[64];
	size_t count;
	snprintf(name, sizeof name, "%s.mean", prefix);
	float *mean = tensor(layout, name, parameters, &count);
	snprintf(name, sizeof name, "%s.deviation", prefix);
	float *deviation = tensor(layout, name, parameters, &count);
	for (size_t i = 0; i < spread->width; i++) {
		double centre = spread->sum[i] / (double)spread->count;
		mean[i] = (float)centre;
		deviation[i] = (float)sqrt(fmax(spread->square[i] / (double)spread->count - centre * centre, 0) + LEAST);
	}
}
