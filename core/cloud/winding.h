/* The generalized winding number of a surface of points with normals, by clusters of its points: near 1 inside a closed
 * surface, near 0 outside, and 1/2 at its own points where all normals point outward (Barill, Dickson, Schmidt, Levin &
 * Jacobson 2018). What a cluster gives changes its sign with the sign of the cluster's normals. */
#ifndef GNP_CORE_WINDING_H
#define GNP_CORE_WINDING_H

#include <stddef.h>
#include <stdint.h>

#include "core/base/status.h"

/* The first group is the caller's and borrowed; the rest is owned. */
struct gnp_winding {
	const double *points, *normals; /* (n, 3) of the cloud, unit */
	const double *radius;           /* (n) a circle of this radius holds `neighbors` points; 0 leaves the point out */
	double neighbors;
	const uint32_t *members; /* (start[clusters]) points of the surface, by cluster */
	const size_t *start;     /* (clusters + 1) */
	size_t clusters;

	double unit; /* lengths below are in it: the largest radius of a member */
	struct gnp_winding_dipole *dipoles; /* (start[clusters]) of the members */
	struct gnp_winding_dipole *sums;    /* (clusters) at their centres by area; the square is that of its reach */
};

struct gnp_winding_dipole {
	double at[3];     /* from the first member */
	double moment[3]; /* area times normal over 4 pi */
	double square;    /* what distances squared are raised by */
};

/* The first group is set. GNP_OUT_OF_MEMORY; to be cleared also then. O(members); 56 bytes a member. */
gnp_status gnp_winding_init(struct gnp_winding *winding, struct gnp_error *error);
void gnp_winding_clear(struct gnp_winding *winding);

/* What each cluster gives at a point of the cloud: shares[c * stride], whose sum is the winding number. A cluster that
 * is far for its size counts as one dipole, a near one point by point; a point itself gives nothing, those within
 * about a spacing less than they would (their side of the point is noise). */
void gnp_winding_at(const struct gnp_winding *winding, uint32_t point, float *shares, size_t stride);

#endif
