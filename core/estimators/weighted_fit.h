/* Surfaces by a model with the head `weighted`: finds the support of a point, has the network weigh its nodes, and
 * says of the fitted piece how far it can be trusted.
 *
 * Nothing is decided for the cloud as a whole: frame, reach, weights, smoothness, creases and outliers all follow
 * from a point's own neighbourhood. */
#ifndef GNP_CORE_WEIGHTED_FIT_H
#define GNP_CORE_WEIGHTED_FIT_H

#include "core/estimators/estimator.h"
#include "core/network/network.h"
#include "core/support/support.h"
#include "core/support/weighted_projection.h"

struct gnp_votes;

/* What fits of a cloud need; borrowed. */
struct gnp_weighted_cloud {
	size_t count;
	struct gnp_support_cloud points;
	const struct gnp_network *network;
	struct gnp_votes *votes; /* what pieces find of the points about them; NULL: not asked */
};

/* A fitted smooth piece about a point. What it points to lives in scratch. */
struct gnp_weighted_piece {
	const struct gnp_support *support;
	const struct gnp_weighted_fit *weights; /* how its nodes count */
	struct gnp_fit fit;
	struct gnp_patch patch; /* of the nearest points that lie on the surface, the centre first; scaled as it is */
	bool crease, outlier;   /* of the centre, by the network; no outliers where its support is the whole cloud */
	size_t trusted;         /* points at which the surface is as good as their own would be, the centre first */
	const uint32_t *member; /* (trusted) */
};

enum { GNP_WEIGHTED_BATCH = 16 };

/* Fits at centres (count <= GNP_WEIGHTED_BATCH): pieces (count) out. errors: surfaces get standard errors.
 * GNP_DEGENERATE where more points coincide than a support has; GNP_OUT_OF_MEMORY. */
gnp_status gnp_weighted_fit_at(const struct gnp_weighted_cloud *cloud, const uint32_t *centres, size_t count,
                               bool errors, struct gnp_weighted_piece *pieces, struct gnp_scratch *scratch,
                               struct gnp_error *error);

#endif
