#include "core/cloud/prepare.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/cloud/belief.h"
#include "core/cloud/orient.h"
#include "core/cloud/settle.h"
#include "core/search/order.h"

/* FLANN's index, and what orienting takes beside the normals (samples, their graph, its order), as measured: bytes a point. */
enum { INDEX = 56, ORIENTING = 240 };

gnp_status gnp_prepared_index(struct gnp_prepared *prepared, struct gnp_error *error)
{
	gnp_neighbors_free(prepared->neighbors);
	prepared->neighbors = NULL;
	return gnp_neighbors_build(prepared->points, prepared->count, &prepared->neighbors, error);
}

void gnp_prepared_clear(struct gnp_prepared *prepared)
{
	free(prepared->order);
	free(prepared->points);
	free(prepared->normals);
	free(prepared->unfitted);
	gnp_neighbors_free(prepared->neighbors);
	*prepared = (struct gnp_prepared){0};
}

static void gather_points(struct gnp_prepared *prepared, const struct gnp_cloud *cloud)
{
	for (size_t i = 0; i < prepared->count; i++)
		memcpy(prepared->points + 3 * i, cloud->points + 3 * (size_t)prepared->order[i], 3 * sizeof(double));
}

static void gather_normals(struct gnp_prepared *prepared, const struct gnp_cloud *cloud)
{
	for (size_t i = 0; i < prepared->count; i++) {
		const double *n = cloud->normals + 3 * (size_t)prepared->order[i];
		double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
		for (int c = 0; c < 3; c++)
			prepared->normals[3 * i + c] = n[c] / length;
	}
}

/* Order, points and their index. */
static gnp_status fill_points(const struct gnp_cloud *cloud, struct gnp_task *task, struct gnp_prepared *prepared, struct gnp_error *error)
{
	size_t n = cloud->count;
	prepared->count = n;
	prepared->order = gnp_array_new(n, sizeof *prepared->order);
	prepared->points = gnp_array_new(n, 3 * sizeof(double));
	if (!prepared->order || !prepared->points)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "points: no memory for %zu", n);
	gnp_task_stage(task, GNP_STAGE_ORDER, 0);
	gnp_status status = gnp_order_compute(cloud->points, n, prepared->order, error);
	if (status == GNP_OK)
		status = gnp_task_check(task, error); /* neither sorting nor indexing looks */
	if (status != GNP_OK)
		return status;
	gather_points(prepared, cloud);
	gnp_task_stage(task, GNP_STAGE_NEIGHBORS, 0);
	status = gnp_neighbors_build(prepared->points, n, &prepared->neighbors, error);
	return status == GNP_OK ? gnp_task_check(task, error) : status;
}

static gnp_status fill_normals(const struct gnp_cloud *cloud, struct gnp_pool *pool, struct gnp_task *task, struct gnp_prepared *prepared,
                               struct gnp_error *error)
{
	size_t n = cloud->count;
	prepared->normals = gnp_array_new(n, 3 * sizeof(double));
	if (!prepared->normals)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "normals: no memory for %zu", n);
	gnp_task_stage(task, GNP_STAGE_ORIENT, cloud->normals ? n : 2 * n); /* two passes over the points */
	if (!cloud->normals)
		return gnp_orient_normals(prepared->points, n, prepared->neighbors, 0, pool, task, prepared->normals, &prepared->components, error);
	gather_normals(prepared, cloud);
	return GNP_OK;
}

static gnp_status prepare(const struct gnp_cloud *cloud, bool judge, struct gnp_pool *pool, struct gnp_task *task, struct gnp_prepared *out,
                          struct gnp_error *error)
{
	struct gnp_prepared prepared = {0};
	gnp_status status = fill_points(cloud, task, &prepared, error);
	if (status == GNP_OK)
		status = fill_normals(cloud, pool, task, &prepared, error);
	if (status == GNP_OK && judge)
		status = gnp_belief_check_cloud(&prepared, cloud->normals != NULL, pool, task, error);
	if (status == GNP_OK)
		*out = prepared;
	else
		gnp_prepared_clear(&prepared);
	return status;
}

gnp_status gnp_prepare(const struct gnp_cloud *cloud, struct gnp_pool *pool, struct gnp_task *task,
                       struct gnp_prepared *out, struct gnp_error *error)
{
	return prepare(cloud, true, pool, task, out, error);
}

gnp_status gnp_prepare_fitted(const struct gnp_cloud *cloud, struct gnp_pool *pool, struct gnp_task *task, struct gnp_prepared *out,
                              struct gnp_error *error)
{
	return prepare(cloud, false, pool, task, out, error);
}

gnp_status gnp_prepare_points(const struct gnp_cloud *cloud, struct gnp_task *task, struct gnp_prepared *out, struct gnp_error *error)
{
	struct gnp_prepared prepared = {0};
	gnp_status status = fill_points(cloud, task, &prepared, error);
	if (status == GNP_OK)
		*out = prepared;
	else
		gnp_prepared_clear(&prepared);
	return status;
}

size_t gnp_prepared_memory(size_t count)
{
	const struct gnp_prepared *prepared = NULL;
	return sizeof *prepared + count * (sizeof *prepared->order + 3 * sizeof *prepared->points + 3 * sizeof *prepared->normals + INDEX);
}

size_t gnp_prepare_memory(size_t count, bool given)
{
	return gnp_prepared_memory(count) + (given ? 0 : count * ORIENTING + gnp_settle_memory(count));
}
