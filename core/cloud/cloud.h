/* A point cloud as the core sees it, and the checks every cloud passes before work begins. */
#ifndef GNP_CORE_CLOUD_H
#define GNP_CORE_CLOUD_H

#include <stddef.h>

#include "core/base/status.h"

/* Borrowed data. Lengths are in the caller's unit; every result scales with it. */
struct gnp_cloud {
	size_t count;
	const double *points;  /* (count, 3) */
	const double *normals; /* (count, 3), outward, any non-zero length; NULL when unknown */
};

/* Checks count >= need, that every coordinate is finite and at most 1e100 in magnitude, that the points do not
 * all coincide or lie on one line, that fewer than need of them (the size of a neighbourhood, at least 2) lie at any
 * one place, and that normals are finite and of non-zero length. The text names the first offending index.
 * GNP_INVALID_ARGUMENT, or GNP_DEGENERATE for equal, collinear or crowded points; GNP_OUT_OF_MEMORY. O(n) on average;
 * 23 bytes a point. */
gnp_status gnp_cloud_check(const struct gnp_cloud *cloud, size_t need, struct gnp_error *error);

#endif
