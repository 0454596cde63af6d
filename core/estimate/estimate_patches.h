/* The inner loop of estimation: finds the points of each patch, has the estimator fit them, writes what the surfaces
 * are at the points they serve. */
#ifndef GNP_CORE_ESTIMATE_PATCHES_H
#define GNP_CORE_ESTIMATE_PATCHES_H

#include <stdatomic.h>
#include <stdbool.h>

#include "core/cloud/cover.h"
#include "core/cloud/prepare.h"
#include "core/estimators/estimator.h"

struct gnp_belief_probe;
struct gnp_estimate;
struct gnp_weighted_cloud;

/* An estimate under way, shared by the workers; borrowed but for the counters. */
struct gnp_estimate_work {
	const struct gnp_prepared *prepared;
	bool chosen;                  /* row p of the output is that of patch p, else that of the caller's point */
	struct gnp_cover cover;       /* which patch serves which point */
	const struct gnp_estimator *estimator;
	struct gnp_fit_options fit;
	void *state;                  /* the estimator's view of the whole cloud */
	const unsigned char *outlier; /* (count) in curve order, or NULL */
	const double *sheets;         /* (count, 3) normals that tell sheets apart, or NULL */
	uint64_t quantities;
	struct gnp_patch_rule rule;
	struct gnp_estimate *out;
	const struct gnp_weighted_cloud *weighted; /* fits go by supports (estimate_supports.h); NULL: by patches of the rule */
	bool own;                        /* every point is to be at the centre of its own support */
	double usual_gap;                /* disk.h; only where boundary is asked for */
	struct gnp_belief_probe *probes; /* NULL: the answer is not judged */
	size_t stride;                   /* of the points probed */
	atomic_size_t degenerate, patches, outliers; /* points, supports fitted, points found to be outliers by their supports */
	atomic_size_t search_ns, fit_ns; /* summed over workers */
};

/* What a fit says of a point besides its surface. */
struct gnp_estimate_judgement {
	bool crease, outlier;
};

/* Writes what a fitted surface is at a point (in curve order) into a row of the outputs, and its probe; into the column
 * of boundary, whether the point may be at one (gnp_disk_may_exceed). */
void gnp_estimate_write(struct gnp_estimate_work *work, const struct gnp_patch *patch, const struct gnp_fit *fit,
                        const struct gnp_estimate_judgement *judgement, size_t point, size_t row);

/* The patches begin .. end - 1 of a struct gnp_estimate_work. On failure the rows written are undefined. */
gnp_status gnp_estimate_patches(void *work, size_t begin, size_t end, struct gnp_scratch *scratch,
                                struct gnp_error *error);

#endif
