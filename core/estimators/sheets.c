#include "core/estimators/sheets.h"

#include <string.h>

enum { ASKED = 24 };

struct work {
	const struct gnp_fit_cloud *cloud;
	const unsigned char *outlier;
	double *normals;
};

/* The normal an outlier takes, from its k nearest. */
static const double *settled(const struct work *work, const double *own, const uint32_t *index, size_t k)
{
	const double *nearest = NULL;
	size_t good = 0, same = 0;
	for (size_t j = 0; j < k; j++) {
		const double *other = work->cloud->normals + 3 * (size_t)index[j];
		if (work->outlier[index[j]])
			continue;
		nearest = nearest ? nearest : other;
		good++;
		same += gnp_same_sheet(own, other);
	}
	return nearest && 3 * same < good ? nearest : own;
}

static gnp_status settle_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                               struct gnp_error *error)
{
	const struct work *work = context;
	const struct gnp_fit_cloud *cloud = work->cloud;
	size_t k = ASKED < cloud->count ? ASKED : cloud->count;
	uint32_t index[ASKED];
	double distance[ASKED];
	for (size_t i = begin; i < end; i++) {
		const double *normal = cloud->normals + 3 * i;
		if (work->outlier[i]) {
			gnp_status status = gnp_neighbors_knn(cloud->neighbors, cloud->points + 3 * i, 1, k, index, distance, scratch, error);
			if (status != GNP_OK)
				return status;
			normal = settled(work, normal, index, k);
		}
		memcpy(work->normals + 3 * i, normal, 3 * sizeof *normal);
	}
	return GNP_OK;
}

gnp_status gnp_sheets_normals(const struct gnp_fit_cloud *cloud, const unsigned char *outlier, struct gnp_pool *pool,
                             struct gnp_task *task, double *normals, struct gnp_error *error)
{
	struct work work = {cloud, outlier, normals};
	return gnp_pool_run(pool, task, cloud->count, 1024, settle_chunk, &work, error);
}

size_t gnp_sheets_usable(const double *normals, const unsigned char *outlier, const struct gnp_patch *patch,
                         size_t most, uint32_t *positions)
{
	const double *normal = normals + 3 * (size_t)patch->centre;
	size_t count = 0;
	for (size_t i = 0; i < patch->buffer_count && count < most; i++) {
		size_t point = patch->index[i];
		if (!outlier[point] && gnp_same_sheet(normals + 3 * point, normal))
			positions[count++] = (uint32_t)i;
	}
	return count;
}
