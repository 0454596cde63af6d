/* The operation filter: finds the points of a cloud that do not lie on the surface the others agree on, and gives the
 * cloud without them.
 *
 * By default a point is dropped that its own neighbourhood says is none of the surface: by the votes of the pieces that
 * a weighted model fits about it (votes.h; every point has a piece, whatever cover is asked), or, for estimators that
 * do not judge, by the consensus of overlapping robust fits (outliers.h). Both go by what the neighbourhood's own noise
 * is, so that a noisy cloud keeps its points.
 *
 * The paper's rule, by alpha: a patch is fitted to each point's neighbourhood; the point's deviation is |w - s(u, v)| there,
 * in the patch's scaled height (patch.h), and what exceeds alpha is dropped, noise and detail with it. Kept points may then
 * be moved onto the fitted surface.
 *
 * An isolated point's own normal may be anything; where it turns from all its neighbours', its patch is made of it
 * alone and it deviates from nothing: consensus, which asks the patches of others, finds it. A point far from all
 * others has a patch of its own, made of it and a piece of surface far away, which fits it: such points, and small
 * clusters of them, are found before by their distances (isolated.h). Points displaced along the surface still lie on
 * it and are kept; at an open boundary they widen it. A cluster with as many points as `cluster` is taken for a
 * surface. */
#ifndef GNP_CORE_FILTER_H
#define GNP_CORE_FILTER_H

#include <stdbool.h>
#include <stdint.h>

#include "core/estimate/estimate.h"

struct gnp_filter_options {
	struct gnp_estimate_options estimate; /* which surfaces; its quantities are ignored */
	double alpha;      /* 0: no limit; > 0: the largest deviation that is kept */
	bool consensus;    /* drop what does not lie on the surface its neighbours agree on */
	double gross;      /* 0: no pre-filter (isolated.h); else >= 1: points are linked that are this many local spacings apart or less ... */
	int cluster;       /* ... and what hangs together in fewer points than this is dropped first; 1..1e6 */
	bool project;      /* move kept points onto the surface along the patch's normal */
	int iterations;    /* of projection, at most; 1..100 */
	double tolerance;  /* projection stops when the root mean square move is at most this many mean spacings; >= 0 */
};

/* Consensus, no limit alpha; gross 3 and cluster 50; no projection (1 iteration, tolerance 1e-3). */
struct gnp_filter_options gnp_filter_defaults(void);

/* Why projection ended. */
enum gnp_filter_stop { GNP_FILTER_NOT_PROJECTED, GNP_FILTER_ITERATIONS, GNP_FILTER_TOLERANCE, GNP_FILTER_NO_PROGRESS };
const char *gnp_filter_stop_text(enum gnp_filter_stop stop);

/* Owned by the caller; gnp_filter_clear frees it. n: points of the cloud, m: kept. */
struct gnp_filter {
	size_t count, kept;      /* n, m */
	unsigned char *keep;     /* (n) 0 or 1 */
	double *deviation;       /* (n) in scaled heights, finite. Of points the pre-filter dropped: the distance to the nearest point it
	                            left, in local spacings (isolated.h) */
	uint32_t *index;         /* (m) ascending: the cloud's index of each kept point */
	double *points;          /* (m, 3) [length] */
	double *normals;         /* (m, 3) outward unit normals of the fitted surface */
	size_t dropped_gross, dropped_deviation, dropped_consensus; /* by the first of these rules that took the point */
	int iterations;          /* of projection done */
	double moved;            /* root mean square move of the last of them [length] */
	enum gnp_filter_stop stop;
	int normals_estimated;   /* as in struct gnp_estimate, as are these: */
	size_t components, patches, degenerate, outliers;
	const struct gnp_model *model;
};

/* Deterministic for any worker count. On failure *out is unchanged. GNP_INVALID_ARGUMENT; GNP_DEGENERATE when fewer
 * points are kept than a neighbourhood has. task may be NULL. */
gnp_status gnp_filter_run(const struct gnp_cloud *cloud, const struct gnp_filter_options *options,
                          struct gnp_pool *pool, struct gnp_task *task, struct gnp_filter *out,
                          struct gnp_error *error);
void gnp_filter_clear(struct gnp_filter *filter);

/* Peak bytes gnp_filter_run may allocate for count points, for admission control: some 350 a point. given: the cloud
 * comes with normals. */
size_t gnp_filter_memory(size_t count, bool given, const struct gnp_filter_options *options);

#endif
