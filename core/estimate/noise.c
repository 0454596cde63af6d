#include "core/estimate/noise.h"

#include <math.h>

#include "core/base/select.h"
#include "core/estimate/sheets.h"
#include "core/fit/least_squares.h"
#include "core/fit/taylor.h"

enum { SAMPLES = 400, K = 50, NEAR = 48, POINTS = 72, REACH = 96, SIZE = GNP_TAYLOR_SIZE, STRIDE = GNP_TAYLOR_STRIDE };

struct work {
	const struct gnp_fit_cloud *cloud;
	const unsigned char *outlier;
	size_t samples;
	double near[SAMPLES], far[SAMPLES]; /* unexplained of NEAR and of POINTS points; negative where it cannot be told */
};

/* What is left of the heights at `count` positions, per degree of freedom, in units of epsilon; negative when it cannot
 * be told. */
static double unexplained(const struct gnp_patch *patch, const uint32_t *positions, size_t count)
{
	_Alignas(64) double rows[POINTS * STRIDE], gram[STRIDE * STRIDE], moment[STRIDE];
	double u[POINTS] = {0}, v[POINTS] = {0}, w[POINTS] = {0}, ones[POINTS] = {0}, square = 0, explained = 0;
	for (size_t i = 0; i < count; i++) {
		u[i] = patch->u[positions[i]];
		v[i] = patch->v[positions[i]];
		w[i] = patch->w[positions[i]];
		ones[i] = 1;
		square += w[i] * w[i];
	}
	gnp_taylor_rows(GNP_TAYLOR_DEGREE, u, v, count, STRIDE, rows);
	gnp_normal_equations(rows, ones, w, count, STRIDE, gram, moment);
	if (!gnp_cholesky_factor(gram, SIZE, STRIDE, GNP_SMALLEST_PIVOT))
		return -1;
	gnp_cholesky_forward(gram, SIZE, STRIDE, moment, moment);
	for (size_t i = 0; i < SIZE; i++)
		explained += moment[i] * moment[i];
	return sqrt(fmax(square - explained, 0) / (double)(count - SIZE)) * patch->scale_w / patch->epsilon;
}

static gnp_status measure_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                struct gnp_error *error)
{
	struct work *work = context;
	const struct gnp_fit_cloud *cloud = work->cloud;
	size_t reach = REACH < cloud->count ? REACH : cloud->count;
	const struct gnp_patch_source source = {.points = cloud->points, .normals = cloud->normals, .k = K < reach ? K : reach,
	                                        .delta0_ratio = 1e-9};
	double u[REACH] = {0}, v[REACH] = {0}, w[REACH] = {0};
	for (size_t s = begin; s < end; s++) {
		uint32_t centre = (uint32_t)(s * cloud->count / work->samples), positions[POINTS];
		struct gnp_neighborhoods found;
		struct gnp_patch patch;
		gnp_status status = gnp_neighborhoods_find(cloud->neighbors, &centre, 1, reach, 1, reach, scratch, &found, error);
		if (status == GNP_OK)
			status = gnp_patch_build(&source, &found, 0, centre, u, v, w, &patch, error);
		if (status != GNP_OK)
			return status;
		size_t usable = gnp_sheets_usable(cloud->normals, work->outlier, &patch, POINTS, positions);
		work->near[s] = usable == POINTS ? unexplained(&patch, positions, NEAR) : -1;
		work->far[s] = usable == POINTS ? unexplained(&patch, positions, POINTS) : -1;
	}
	return GNP_OK;
}

/* 0 when none is known. */
static double median_known(double *values, size_t count)
{
	size_t known = 0;
	for (size_t i = 0; i < count; i++)
		if (values[i] >= 0)
			values[known++] = values[i];
	return gnp_median(values, known);
}

gnp_status gnp_noise_measure(const struct gnp_fit_cloud *cloud, const unsigned char *outlier, struct gnp_pool *pool,
                             struct gnp_task *task, double *noise, struct gnp_error *error)
{
	struct work work = {.cloud = cloud, .outlier = outlier, .samples = cloud->count < SAMPLES ? cloud->count : SAMPLES};
	gnp_status status = gnp_pool_run(pool, task, work.samples, 32, measure_chunk, &work, error);
	if (status != GNP_OK)
		return status;
	double near = median_known(work.near, work.samples), far = median_known(work.far, work.samples);
	double growth = near > 0 ? fmax(far / near, 1) : 1;
	*noise = near / (growth * growth);
	return GNP_OK;
}
