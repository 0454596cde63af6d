/* Trains the projection head: its row of the table in train_head.c. Points that count are those that are no outliers
 * and face as the centre does, as in estimation, where outliers are found first. */
#include <math.h>
#include <string.h>

#include "core/estimators/projection_fit.h"
#include "core/estimators/sheets.h"
#include "weights/train/train_head_parts.h"

enum { SIZE = GNP_TAYLOR_SIZE };

static size_t usable(const void *context, const struct gnp_patch *patch, size_t most, uint32_t *positions)
{
	const struct gnp_train_cloud *cloud = context;
	return gnp_sheets_usable(cloud->prepared.normals, cloud->outlier, patch, most, positions);
}

/* Coefficients of the fit are those of heights over scale_xy, a patch's surface's are of heights over scale_w. */
static double unit_of(const struct gnp_patch *patch)
{
	return patch->scale_xy / patch->scale_w;
}

gnp_status gnp_train_projection_forward(const struct gnp_network *network, const struct gnp_train_patches *patches,
                                        double *coefficients, void **tape, struct gnp_scratch *scratch, struct gnp_error *error)
{
	struct gnp_projected *projected = gnp_scratch_take(scratch, 1, sizeof *projected);
	if (!projected)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "training: no memory for %zu patches", patches->count);
	gnp_status status = gnp_projected_describe(&network->architecture, patches->patches, patches->count, usable, patches->cloud,
	                                           projected, scratch, error);
	if (status == GNP_OK)
		status = gnp_projected_solve(network, tape != NULL, projected, scratch, error);
	for (size_t p = 0; p < patches->count && status == GNP_OK; p++)
		for (size_t i = 0; i < SIZE; i++)
			coefficients[p * SIZE + i] = projected->fits[p].coefficients[i] * unit_of(&patches->patches[p]);
	if (tape)
		*tape = projected;
	return status;
}

gnp_status gnp_train_projection_backward(const struct gnp_network *network, const struct gnp_train_patches *patches, const void *tape,
                                         const double *dcoefficients, float *gradient, struct gnp_scratch *scratch,
                                         struct gnp_error *error)
{
	double *d = gnp_scratch_take(scratch, patches->count, SIZE * sizeof *d);
	if (!d)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "training: no memory for %zu patches", patches->count);
	for (size_t p = 0; p < patches->count; p++)
		for (size_t i = 0; i < SIZE; i++)
			d[p * SIZE + i] = dcoefficients[p * SIZE + i] * unit_of(&patches->patches[p]);
	return gnp_projected_backward(network, tape, d, gradient, scratch, error);
}

double gnp_train_projection_operations(const struct gnp_network *network, const struct gnp_train_patches *patches)
{
	enum { PATCHES = 1 };
	const size_t start[PATCHES + 1] = {0, GNP_PROJECTION_NODES}, inner[PATCHES] = {GNP_PROJECTION_NODES};
	const struct gnp_network_batch one = {PATCHES, start, inner, NULL};
	return (double)patches->count * (gnp_trunk_operations(network, &one, false) + gnp_trunk_operations(network, &one, true));
}

/* Mean and spread of the summaries, and a beginning for the last layer: every patch is fitted about as its first fit on the
 * widest support is, its shells fading outwards. */
gnp_status gnp_train_projection_calibrate(const struct gnp_architecture *architecture, const struct gnp_layout *layout,
                                          const struct gnp_train_patches *sets, size_t count, float *parameters,
                                          struct gnp_scratch *scratch, struct gnp_error *error)
{
	size_t width = gnp_projection_summary(architecture), patches = 0;
	double *sum = gnp_scratch_take(scratch, 2 * width, sizeof *sum), *square = sum + width;
	if (!sum)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "training: no memory for a summary");
	memset(sum, 0, 2 * width * sizeof *sum);
	for (size_t s = 0; s < count; s++) {
		struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
		struct gnp_projected projected;
		gnp_status status = gnp_projected_describe(architecture, sets[s].patches, sets[s].count, usable, sets[s].cloud, &projected,
		                                           scratch, error);
		if (status != GNP_OK)
			return status;
		for (size_t i = 0; i < sets[s].count * width; i++) {
			sum[i % width] += (double)projected.summary[i];
			square[i % width] += (double)projected.summary[i] * (double)projected.summary[i];
		}
		patches += sets[s].count;
		gnp_scratch_release(scratch, mark);
	}
	float *mean = parameters + gnp_layout_find(layout, "head.mean")->offset;
	float *deviation = parameters + gnp_layout_find(layout, "head.deviation")->offset;
	for (size_t i = 0; i < width; i++) {
		double centre = sum[i] / (double)patches;
		mean[i] = (float)centre;
		deviation[i] = (float)sqrt(fmax(square[i] / (double)patches - centre * centre, 0) + 1e-4);
	}
	size_t k = patches ? sets[0].patches[0].k : 1, last = architecture->shell[architecture->shells - 1];
	gnp_projection_begin(architecture, (double)last / (double)k, parameters + gnp_layout_find(layout, "head.4.bias")->offset);
	return GNP_OK;
}
