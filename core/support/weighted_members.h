/* What a piece fitted by node weights is worth near its centre: whose points it may serve, the patch that they are
 * seen in, and whether it ends there.
 *
 * Looked at are the nodes of at most three points, the nearest 144. One is on the surface if it is not steeper over it
 * from the centre than 0.35, or within 4 deviations of noise. */
#ifndef GNP_CORE_WEIGHTED_MEMBERS_H
#define GNP_CORE_WEIGHTED_MEMBERS_H

#include "core/cloud/patch.h"
#include "core/support/weighted_projection.h"

struct gnp_weighted_near {
	const struct gnp_support *support;
	const struct gnp_weighted_fit *fit;
	const float *outputs;   /* of the head */
	const double *residual; /* (nodes) in units of R */
	double noise;           /* root mean square of residuals, in units of R */
	double scale;           /* of the piece [length] */
	struct gnp_weighted_variance error; /* expected at the centre */
};

/* The nearest points that are on the surface, as a patch whose arrays are in scratch; u, v in units of the scale,
 * heights over twice their deviation. points: of the cloud. GNP_OUT_OF_MEMORY. */
gnp_status gnp_weighted_near_patch(const struct gnp_weighted_near *near, const double *points, struct gnp_patch *patch,
                                   struct gnp_scratch *scratch, struct gnp_error *error);

/* Whether there is anything near that a crease or rim could be seen by: single points off the surface, or none to one
 * side. */
bool gnp_weighted_near_ends(const struct gnp_weighted_near *near, const struct gnp_patch *patch);

/* Points that the surface serves, the centre first, in scratch: those nearer than half way to the first node that is
 * off the surface and within a half of the scale where the error that is expected of the normal is little, an eighth
 * elsewhere (a point's own support is then better by more); at most in the inner half of the nearest 144. Alone where
 * the network takes the centre for an outlier or the neighbour of a crease. GNP_OUT_OF_MEMORY. */
gnp_status gnp_weighted_near_members(const struct gnp_weighted_near *near, const double *points,
                                     const uint32_t **member, size_t *count, struct gnp_scratch *scratch,
                                     struct gnp_error *error);

#endif
