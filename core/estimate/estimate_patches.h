/* The inner loop of estimation: finds the points of each patch, has the estimator fit them, writes what the surfaces
 * are at the points they serve. */
#ifndef GNP_CORE_ESTIMATE_PATCHES_H
#define GNP_CORE_ESTIMATE_PATCHES_H

#include <stdatomic.h>
#include <stdbool.h>

#include "core/cloud/cover.h"
#include "core/cloud/prepare.h"
#include "core/estimate/estimator.h"

struct gnp_belief_probe;
struct gnp_estimate;

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
	struct gnp_belief_probe *probes; /* NULL: the answer is not judged */
	size_t stride;                   /* of the points probed */
	atomic_size_t degenerate;
	atomic_size_t search_ns, fit_ns; /* summed over workers */
};

/* The patches begin .. end - 1 of a struct gnp_estimate_work. On failure the rows written are undefined. */
gnp_status gnp_estimate_patches(void *work, size_t begin, size_t end, struct gnp_scratch *scratch,
                                struct gnp_error *error);

#endif
