#include "weights/train/any/any_start.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <string.h>

#include "core/base/random.h"
#include "core/support/weighted_projection.h"

static const uint64_t STREAM = UINT64_C(0x10) << 56; /* of the seed, one for each tensor */

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

static bool is_bias(const char *name)
{
	return strcmp(strrchr(name, '.'), ".bias") == 0;
}

/* Of the trunk are the tensors before the head's first. */
static double trunk_bound(const struct gnp_architecture *a, const struct gnp_parameter_row *row)
{
	static const double BIAS = 0.2;
	if (strstr(row->name, ".layers.2.")) /* a kernel's last, as in initial.h */
		return is_bias(row->name) ? 0 : sqrt(3.0 * a->channels / ((double)a->neurons * a->width));
	return is_bias(row->name) ? BIAS : 1 / sqrt((double)row->shape[1]);
}

static double head_bound(const struct gnp_parameter_row *row)
{
	static const double SMALL = 0.1, LOOKS = 1.5;
	if (row->rank == 1 || strcmp(row->name, "head.4.weight") == 0)
		return 0;
	if (strcmp(row->name, "node.2.weight") == 0 || strcmp(row->name, "frame.2.weight") == 0)
		return SMALL;
	return (strcmp(row->name, "frame.0.weight") == 0 ? LOOKS : 1) / sqrt((double)row->shape[1]);
}

static void draw(const struct gnp_architecture *architecture, const struct gnp_layout *layout, uint64_t seed,
                 float *parameters)
{
	size_t head = gnp_layout_find(layout, "head.mean")->offset;
	for (size_t i = 0; i < layout->rows; i++) {
		const struct gnp_parameter_row *row = &layout->row[i];
		double bound = row->offset < head ? trunk_bound(architecture, row) : head_bound(row);
		struct gnp_random random;
		gnp_random_seed(&random, seed, STREAM | i);
		for (size_t j = 0; j < row->count; j++)
			parameters[row->offset + j] = (float)(bound * (2 * gnp_random_uniform(&random) - 1));
	}
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
	draw(architecture, layout, seed, parameters);
	set(layout, "head.deviation", 1, parameters);
	set(layout, "frame.deviation", 1, parameters);
	set(layout, "node.2.bias", 1, parameters);
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
