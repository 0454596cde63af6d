#include "core/cloud/cloud.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>

#include "core/base/memory.h"
#include "core/base/vector.h"
#include "core/cloud/distinct.h"

static gnp_status check_points(const struct gnp_cloud *cloud, struct gnp_error *error)
{
	for (size_t i = 0; i < 3 * cloud->count; i++) {
		double x = cloud->points[i];
		if (!(fabs(x) <= GNP_COORDINATE_MAX))
			return gnp_error_set(error, GNP_INVALID_ARGUMENT,
			                     "points: coordinate %zu of point %zu is %g, need a finite number of magnitude at most %g",
			                     i % 3, i / 3, x, GNP_COORDINATE_MAX);
	}
	return GNP_OK;
}

static gnp_status check_normals(const struct gnp_cloud *cloud, struct gnp_error *error)
{
	for (size_t i = 0; cloud->normals && i < cloud->count; i++) {
		const double *n = cloud->normals + 3 * i;
		double square = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
		if (!isfinite(square))
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "normals: normal %zu is (%g, %g, %g), need finite numbers", i,
			                     n[0], n[1], n[2]);
		if (square < 1e-60)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "normals: normal %zu has length %g, need at least 1e-30", i,
			                     sqrt(square));
	}
	return GNP_OK;
}

/* The largest distance of any point from the first, and from the line through the first and that farthest point. */
static void extents(const struct gnp_cloud *cloud, double *length, double *width)
{
	const double *o = cloud->points, *a = o;
	double farthest = 0, widest = 0;
	for (size_t i = 1; i < cloud->count; i++) {
		const double *p = cloud->points + 3 * i;
		double d = hypot(hypot(p[0] - o[0], p[1] - o[1]), p[2] - o[2]);
		if (d > farthest) {
			farthest = d;
			a = p;
		}
	}
	double axis[3] = {0, 0, 0};
	for (int c = 0; c < 3 && farthest > 0; c++)
		axis[c] = (a[c] - o[c]) / farthest;
	for (size_t i = 1; i < cloud->count; i++) {
		const double *p = cloud->points + 3 * i;
		double d[3] = {p[0] - o[0], p[1] - o[1], p[2] - o[2]};
		double along = d[0] * axis[0] + d[1] * axis[1] + d[2] * axis[2];
		for (int c = 0; c < 3; c++)
			d[c] -= along * axis[c];
		double off = hypot(hypot(d[0], d[1]), d[2]);
		if (off > widest)
			widest = off;
	}
	*length = farthest;
	*width = widest;
}

/* A place that fills a whole neighbourhood has no geometry, and the search tree, which cannot part equal points, compares each
 * of them with all the others. */
static gnp_status check_crowding(const struct gnp_cloud *cloud, size_t need, struct gnp_error *error)
{
	size_t places = 0;
	uint32_t *which = gnp_array_new(cloud->count, sizeof *which), *first = gnp_array_new(cloud->count, sizeof *first);
	uint32_t *copies = gnp_array_zero(cloud->count, sizeof *copies);
	gnp_status status = which && first && copies
	                        ? gnp_distinct_find(cloud->points, cloud->count, NULL, which, first, &places, error)
	                        : gnp_error_set(error, GNP_OUT_OF_MEMORY, "points: no memory to compare %zu", cloud->count);
	size_t crowded = 0;
	for (size_t i = 0; i < cloud->count && status == GNP_OK; i++)
		if (++copies[which[i]] > copies[which[crowded]])
			crowded = i;
	if (status == GNP_OK && copies[which[crowded]] >= need) {
		const double *p = cloud->points + 3 * crowded;
		status = gnp_error_set(error, GNP_DEGENERATE, "points: %u coincide at (%g, %g, %g), need fewer than the %zu of a "
		                       "neighbourhood: remove duplicates", copies[which[crowded]], p[0], p[1], p[2], need);
	}
	free(which);
	free(first);
	free(copies);
	return status;
}

gnp_status gnp_cloud_check(const struct gnp_cloud *cloud, size_t need, struct gnp_error *error)
{
	if (cloud->count < need)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "points: got %zu, need at least %zu", cloud->count, need);
	if (cloud->count > INT32_MAX)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "points: got %zu, need at most %d", cloud->count, INT32_MAX);
	gnp_status status = check_points(cloud, error);
	if (status == GNP_OK)
		status = check_normals(cloud, error);
	if (status != GNP_OK)
		return status;
	double length, width;
	extents(cloud, &length, &width);
	if (length == 0)
		return gnp_error_set(error, GNP_DEGENERATE, "points: all %zu points are equal", cloud->count);
	if (width <= 1e-9 * length)
		return gnp_error_set(error, GNP_DEGENERATE, "points: all %zu points lie within %.3g of one line of length %.3g",
		                     cloud->count, width, length);
	return check_crowding(cloud, need, error);
}
