/* The supports of the adaptive estimator: over how many nearest points, and with which prior, the fits about each
 * representative point go.
 *
 * The evidence of Bayesian polynomial regressions (regression.h) sets the length and amplitude of the surface's
 * variation against the noise for supports from dozens to hundreds of points. Representatives next to one another vote,
 * and the support whose Hessian has the smallest posterior variance is taken. O(n), as a representative stands for
 * dozens of points and looks at a bounded number. */
#ifndef GNP_CORE_ADAPTIVE_SUPPORT_H
#define GNP_CORE_ADAPTIVE_SUPPORT_H

#include "core/cloud/cover.h"
#include "core/estimators/estimator.h"
#include "core/fit/regression.h"
#include "core/fit/taylor.h"

enum { GNP_ADAPTIVE_POINTS_MAX = 760 }; /* of the largest support, with room */

/* What a representative has chosen. */
struct gnp_adaptive_support {
	uint32_t points;
	float length, tau;
	float doubt; /* factor of the posterior's variances for what the support leaves unexplained */
};

/* What is known of the whole cloud. */
struct gnp_adaptive_state {
	size_t count;
	double *normals;                /* (count, 3) of the sheet each point belongs to */
	unsigned char *outlier;         /* (count) */
	uint32_t *representative;       /* (count) */
	struct gnp_cover cover;
	struct gnp_adaptive_support *choice;          /* (representatives) the supports chosen */
};

/* The data of one local regression, in scratch. */
struct gnp_adaptive_local {
	double u[GNP_ADAPTIVE_POINTS_MAX], v[GNP_ADAPTIVE_POINTS_MAX], y[GNP_ADAPTIVE_POINTS_MAX], ones[GNP_ADAPTIVE_POINTS_MAX];
	double rows[GNP_ADAPTIVE_POINTS_MAX * GNP_TAYLOR_STRIDE];
	double gram[GNP_TAYLOR_STRIDE * GNP_TAYLOR_STRIDE], moment[GNP_TAYLOR_STRIDE];
	double factor[GNP_TAYLOR_SIZE * GNP_TAYLOR_STRIDE], mean[GNP_TAYLOR_STRIDE];
	double sums[GNP_TAYLOR_STRIDE * GNP_TAYLOR_STRIDE], sums_moment[GNP_TAYLOR_STRIDE]; /* over nested supports */
	uint32_t usable[GNP_ADAPTIVE_POINTS_MAX]; /* positions in the patch, ascending by distance */
	size_t usable_count;
	double radius;
};

/* The nearest points of the patch that may be used, at most so many, into usable. */
void gnp_adaptive_local_collect(const struct gnp_adaptive_state *state, const struct gnp_patch *patch, size_t most,
                                struct gnp_adaptive_local *local);

/* Coordinates about the centre in units of the in-plane reach of the nearest `count` usable points; how many there
 * were. */
size_t gnp_adaptive_local_fill(const struct gnp_patch *patch, size_t count, struct gnp_adaptive_local *local);

/* The regression over the first `count` points, which borrows from local. */
struct gnp_regression gnp_adaptive_local_regression(struct gnp_adaptive_local *local, size_t count);

/* Fills the choices (cover.count, room for them is there). On failure they are undefined. */
gnp_status gnp_adaptive_support_choose(struct gnp_adaptive_state *state, const struct gnp_fit_cloud *cloud,
                                       struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error);

#endif
