#include "core/support/roughness.h"

#include <math.h>
#include <stdlib.h>

#include "core/base/memory.h"
#include "core/search/neighborhoods.h"
#include "core/support/moments.h"

static const size_t scales[GNP_ROUGHNESS_SCALES] = {12, 64};
static const double FLOOR = 1e-6; /* flatness below this is all the same */

void gnp_roughness_clear(struct gnp_roughness *roughness)
{
	for (int s = 0; s < GNP_ROUGHNESS_SCALES; s++)
		free(roughness->value[s]);
	*roughness = (struct gnp_roughness){0};
}

struct measuring {
	const struct gnp_neighbors *neighbors;
	struct gnp_roughness *out;
};

static void measure_point(const double *points, const uint32_t *index, size_t count, size_t at,
                          struct gnp_roughness *out)
{
	struct gnp_moments moments = {0};
	size_t i = 0;
	for (int s = 0; s < GNP_ROUGHNESS_SCALES; s++) {
		double variance[3], axes[3][3];
		for (; i < scales[s] && i < count; i++)
			gnp_moments_add(&moments, points + 3 * (size_t)index[0], points + 3 * (size_t)index[i]);
		gnp_moments_axes(&moments, variance, axes);
		out->value[s][at] = (float)(0.5 * log(gnp_moments_flatness(variance) + FLOOR));
	}
}

static gnp_status measure_some(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                               struct gnp_error *error)
{
	struct measuring *measuring = context;
	size_t points = gnp_neighbors_count(measuring->neighbors), most = scales[GNP_ROUGHNESS_SCALES - 1];
	uint32_t *centres = gnp_scratch_take(scratch, end - begin, sizeof *centres);
	struct gnp_neighborhoods found;
	if (!centres)
		return gnp_no_memory("roughness", end - begin, "points", error);
	for (size_t i = begin; i < end; i++)
		centres[i - begin] = (uint32_t)(i * GNP_ROUGHNESS_EVERY);
	most = most < points ? most : points;
	gnp_status status =
		gnp_neighborhoods_find(measuring->neighbors, centres, end - begin, most, 1, most, scratch, &found, error);
	for (size_t i = begin; i < end && status == GNP_OK; i++) {
		size_t start = found.start[i - begin];
		measure_point(gnp_neighbors_points(measuring->neighbors), found.index + start,
		              found.start[i - begin + 1] - start, i, measuring->out);
	}
	return status;
}

gnp_status gnp_roughness_measure(const struct gnp_neighbors *neighbors, struct gnp_pool *pool, struct gnp_task *task,
                                 struct gnp_roughness *out, struct gnp_error *error)
{
	enum { POINTS_A_CHUNK = 64 };
	struct gnp_roughness made = {0};
	made.count = (gnp_neighbors_count(neighbors) + GNP_ROUGHNESS_EVERY - 1) / GNP_ROUGHNESS_EVERY;
	gnp_status status = GNP_OK;
	for (int s = 0; s < GNP_ROUGHNESS_SCALES; s++) {
		made.value[s] = gnp_array_new(made.count, sizeof *made.value[s]);
		if (!made.value[s])
			status = gnp_no_memory("roughness", made.count, "points", error);
	}
	if (status == GNP_OK)
		status = gnp_pool_run(pool, task, made.count, POINTS_A_CHUNK, measure_some,
		                      &(struct measuring){neighbors, &made}, error);
	if (status == GNP_OK)
		*out = made;
	else
		gnp_roughness_clear(&made);
	return status;
}
