/* Geometry at every point of a cloud: order, neighbours, patches, coefficients, surface, quantities. */
#ifndef GNP_CORE_ESTIMATE_H
#define GNP_CORE_ESTIMATE_H

#include <stdbool.h>

#include "core/base/pool.h"
#include "core/base/status.h"
#include "core/base/task.h"
#include "core/cloud/cloud.h"
#include "core/cloud/prepare.h"
#include "core/estimate/estimate_options.h"

/* Owned by the caller; gnp_estimate_clear frees it. Rows are in the caller's order (gnp_estimate_at: in the order of
 * `at`). */
struct gnp_estimate {
	size_t count;
	size_t basis_size;                   /* width of surface_coefficients */
	double *values[GNP_QUANTITY_COUNT];  /* (count, width) each; NULL where not asked for */
	int normals_estimated;               /* 1 when the cloud came without normals */
	size_t components;                   /* connected components oriented; 0 when normals were given */
	size_t patches;                      /* patches fitted, also those of the cloud without outliers */
	const struct gnp_model *model;       /* the options' or the chosen one, borrowed; NULL: the estimator uses none */
	size_t outliers;                     /* points found to be outliers: by gnp, where it looked for them */
	size_t degenerate;                   /* points whose neighbourhood was too poor for the basis: a lower degree was used */
};

/* Checks options and cloud, orients normals when absent, estimates. Where a weighted model finds more outliers than one
 * point in 32, the others are estimated again as a cloud of their own; outliers keep what they got among them all.
 * Deterministic for any worker count. On failure *out is unchanged. task may be NULL. O(n log n) for finding
 * neighbours; memory: gnp_estimate_memory. */
gnp_status gnp_estimate_run(const struct gnp_cloud *cloud, const struct gnp_estimate_options *options,
                            struct gnp_pool *pool, struct gnp_task *task, struct gnp_estimate *out,
                            struct gnp_error *error);

/* The same of a cloud made ready (prepare.h) with normals, rows in its caller's order; nothing of the cloud is checked
 * but its count. */
gnp_status gnp_estimate_prepared(const struct gnp_prepared *prepared, const struct gnp_estimate_options *options,
                                 struct gnp_pool *pool, struct gnp_task *task, struct gnp_estimate *out,
                                 struct gnp_error *error);

/* The same at chosen points of the cloud alone, each at the centre of its own patch as with GNP_COVER_ALL: row i of the
 * outputs is the point at[i] (at_count, each below cloud->count, in any order; not NULL). options->cover is not
 * used. */
gnp_status gnp_estimate_at(const struct gnp_cloud *cloud, const struct gnp_estimate_options *options,
                           const uint32_t *at, size_t at_count, struct gnp_pool *pool, struct gnp_task *task,
                           struct gnp_estimate *out, struct gnp_error *error);
void gnp_estimate_clear(struct gnp_estimate *estimate);

/* Peak bytes gnp_estimate_run may allocate for count points, for admission control: 150 to 300 a point and its outputs,
 * with a weighted model up to 470, since a cloud with many outliers is made ready twice.
 * given: the cloud comes with normals. The scratch of workers, which their pool keeps, is not among them. */
size_t gnp_estimate_memory(size_t count, bool given, const struct gnp_estimate_options *options);

#endif
