/* One fit on view: how much every point of a cloud counts in the surface at one of them.
 *
 * Models with the head `weighted` alone decide that point by point: which neighbours are of the same smooth piece, and
 * how far it reaches. This shows what they decided. */
#ifndef GNP_CORE_PATCH_VIEW_H
#define GNP_CORE_PATCH_VIEW_H

#include <stdbool.h>

#include "core/base/pool.h"
#include "core/base/status.h"
#include "core/base/task.h"
#include "core/cloud/cloud.h"
#include "core/estimate/estimate_options.h"

/* Owned by the caller; gnp_patch_view_clear frees it. Rows are the cloud's. */
struct gnp_patch_view {
	size_t count;
	double *weight;   /* (n) in [0, 1]: of each point in the fit; 0 beyond the support */
	double *height;   /* (n) above the fitted surface, along its frame's third axis [length]; 0 beyond the support */
	double normal[3]; /* of the surface at the point, outward as estimates are */
	double scale;     /* radius of the disk whose points lie as far away as those that count [length] */
	double radius;    /* of the support [length] */
	size_t points;    /* of the support */
	bool crease, outlier;            /* the point, by the network */
	const struct gnp_model *model;   /* borrowed */
	bool normals_estimated;
	size_t components;               /* connected components oriented; 0 when normals were given */
};

/* Fits at the point `at` of the cloud with the options' estimator and model; quantities and cover are not used.
 * GNP_INVALID_ARGUMENT where the model weighs no points or there is no such point. Deterministic for any worker count.
 * On failure *out is unchanged. O(n log n) for making the cloud ready; memory: gnp_patch_view_memory. */
gnp_status gnp_patch_view_make(const struct gnp_cloud *cloud, const struct gnp_estimate_options *options, size_t at,
                         struct gnp_pool *pool, struct gnp_task *task, struct gnp_patch_view *out,
                               struct gnp_error *error);
void gnp_patch_view_clear(struct gnp_patch_view *view);

/* Peak bytes gnp_patch_view_make may allocate, without the scratch of workers. given: the cloud comes with normals. */
size_t gnp_patch_view_memory(size_t count, bool given);

#endif
