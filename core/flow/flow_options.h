/* What may be asked of a mean-curvature flow, and what is assumed of what is not.
 *
 * Lengths that are NAN follow the cloud: its spacing h is the root of the mean area of its points' Voronoi cells in
 * their tangent planes at the start, leaving out cells of more than 16 times the median. The defaults are the paper's
 * absolute values (dt 1e-4, r0 0.00667, r1 0.005) on its shapes of 100,000 points, whose spacing is 0.0112: dt = 0.8
 * h^2, r0 = 0.6 h, r1 = 0.45 h. Explicit steps are stable up to about 2 h^2 of the densest points: a dt that is left
 * open is made smaller as points crowd together, one that is given never is. */
#ifndef GNP_CORE_FLOW_OPTIONS_H
#define GNP_CORE_FLOW_OPTIONS_H

#include "core/estimate/estimate.h"

enum gnp_flow_scheme {
	GNP_FLOW_EXPLICIT,      /* the paper's: x += dt H n */
	GNP_FLOW_SEMI_IMPLICIT, /* x += d, (I - dt/2 Delta) d = dt H n: stable at steps many times longer */
	GNP_FLOW_CONFORMAL      /* Kazhdan, Solomon & Ben-Chen 2012: the start's stiffness throughout; spheres of genus 0 without
	                           singularities. Points are neither thinned nor inserted */
};
enum gnp_flow_volume { GNP_FLOW_VOLUME_NONE, GNP_FLOW_VOLUME_PRESERVE };

struct gnp_flow_options {
	struct gnp_estimate_options estimate; /* what H and n come from; its quantities are ignored */
	int scheme, volume;      /* enum gnp_flow_scheme, enum gnp_flow_volume */
	int steps;               /* 1..1e6 */
	double dt;               /* > 0 [length^2], or NAN */
	double smoothing_radius; /* r0 of the paper's Gaussian of H, cut at 3 r0 [length]; 0: no smoothing; or NAN */
	double spacing;          /* r1: points are thinned to this distance after each step [length]; 0: never; or NAN */
	double insertion;        /* points are inserted where none is within this distance on the surface [length]; 0: never; or NAN: 1.5 h */
	double tangential;       /* 0..1: how far a point moves towards the centroid of its cell, along the surface, before each step */
	double projection;       /* 0..1: how far a point moves towards the surface fitted about it, before each step. It damps what fits do
	                            not see and H cannot straighten; 0: the paper's step to the letter */
	double singularity;      /* > 0: the flow stops when curvature times spacing exceeds this */
	double spacing_limit;    /* > 1: it stops when points are this many times h apart */
	int snapshot_every;      /* steps; 0: no snapshots. The start and the end are among them */
};

/* explicit, no volume kept, 1 step, all lengths NAN, tangential 0, projection 0.1, singularity 0.5, spacing_limit 4, no
 * snapshots. */
struct gnp_flow_options gnp_flow_defaults(void);

/* Most bytes of snapshots. */
#define GNP_FLOW_SNAPSHOT_BYTES_MAX ((size_t)4 << 30)

/* What the options say by themselves. cloud is looked at for its count alone. */
gnp_status gnp_flow_check(const struct gnp_flow_options *options, const struct gnp_cloud *cloud,
                          struct gnp_error *error);

/* Fewest points of a state: a neighbourhood of the estimator and of a cell. */
size_t gnp_flow_least_points(const struct gnp_flow_options *options);

#endif
