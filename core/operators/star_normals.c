#include "core/operators/star_normals.h"

#include <string.h>

#include "core/base/vector.h"

enum { POINTS_A_CHUNK = 512, NEAREST = 8 };

/* Of the ways to a point's nearest, the squares of what leaves a plane. */
static double off_plane(const double *points, size_t centre, const uint32_t *index, size_t count,
                        const double normal[3])
{
	const double *o = points + 3 * centre;
	double sum = 0;
	for (size_t k = 0; k < count; k++) {
		const double *p = points + 3 * (size_t)index[k], d[3] = {p[0] - o[0], p[1] - o[1], p[2] - o[2]};
		sum += gnp_dot(d, normal) * gnp_dot(d, normal);
	}
	return sum;
}

static gnp_status choose_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                               struct gnp_error *error)
{
	static const double TURNED = 0.7, BETTER = 0.25; /* cosine; of squares */
	struct gnp_prepared *prepared = context;
	size_t nearest = prepared->count < NEAREST + 1 ? prepared->count : NEAREST + 1;
	uint32_t index[NEAREST + 1];
	double distance[NEAREST + 1];
	gnp_status status = GNP_OK;
	for (size_t i = begin; i < end && status == GNP_OK; i++) {
		double *before = prepared->unfitted + 3 * i;
		const double *fitted = prepared->normals + 3 * i;
		double cosine = gnp_dot(before, fitted);
		if (!(cosine > 0 && cosine < TURNED))
			continue;
		status = gnp_neighbors_knn(prepared->neighbors, prepared->points + 3 * i, 1, nearest, index, distance,
		                           scratch, error);
		if (status == GNP_OK && off_plane(prepared->points, i, index, nearest, fitted) <
		                            BETTER * off_plane(prepared->points, i, index, nearest, before))
			memcpy(before, fitted, 3 * sizeof *before);
	}
	return status;
}

gnp_status gnp_star_normals_choose(struct gnp_prepared *prepared, struct gnp_pool *pool, struct gnp_task *task,
                                   struct gnp_error *error)
{
	return gnp_pool_run(pool, task, prepared->count, POINTS_A_CHUNK, choose_chunk, prepared, error);
}
