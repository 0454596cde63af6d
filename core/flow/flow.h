/* Mean-curvature flow of a point cloud, x_t = H n (the paper's section on shape deformations): spheres of radius R0 shrink by
 * R^2 = R0^2 - 2 t, cylinders by R0^2 - t.
 *
 * Lengths that are NAN in the options follow the cloud: its spacing h is the root of the mean area of its points' Voronoi cells in
 * their tangent planes at the start, but for cells of more than 16 times the median. The defaults are the paper's absolute values (dt 1e-4, r0 0.00667, r1 0.005) on its shapes of
 * 100,000 points, whose spacing is 0.0112: dt = 0.8 h^2, r0 = 0.6 h, r1 = 0.45 h. Explicit steps are stable up to about 2 h^2 of the
 * densest points, so that a dt left open follows these as they crowd together; one that is given stays what it is. */
#ifndef GNP_CORE_FLOW_H
#define GNP_CORE_FLOW_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/checkpoint.h"
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

/* explicit, no volume kept, 1 step, all lengths NAN, tangential 0, projection 0.1, singularity 0.5, spacing_limit 4, no snapshots. */
struct gnp_flow_options gnp_flow_defaults(void);

/* Most bytes of snapshots. */
#define GNP_FLOW_SNAPSHOT_BYTES_MAX ((size_t)4 << 30)

enum gnp_flow_stop {
	GNP_FLOW_STEPS,       /* all that were asked for were taken */
	GNP_FLOW_SINGULARITY, /* curvature times spacing above the bound: a neck or a point collapses */
	GNP_FLOW_SPACING,     /* points too far apart to tell the surface */
	GNP_FLOW_UNSTABLE,    /* points move past their neighbours, or to and fro: dt is too large, or the curvature is noise */
	GNP_FLOW_NOT_FINITE,  /* the estimate has no finite value somewhere */
	GNP_FLOW_VANISHED     /* fewer points left than a neighbourhood has, or a millionth of the area */
};
/* Its word in reports: steps, singularity, spacing, unstable, not_finite, vanished. */
const char *gnp_flow_stop_name(enum gnp_flow_stop stop);

/* A state of the flow; row 0 is the start. */
struct gnp_flow_record {
	double step, time;        /* [length^2] */
	double points;
	double area, volume;      /* sum of cells [length^2]; by the divergence theorem, of what is closed [length^3] */
	double curvature;         /* largest |H|, smoothed if the flow smooths it [1/length] */
	double resolution;        /* largest principal curvature times spacing, the 99.9th percentile: what `singularity` bounds */
	double thinned, inserted; /* points since the row before */
	double seconds;           /* since the row before */
};
enum { GNP_FLOW_RECORD_WIDTH = 10 };
_Static_assert(sizeof(struct gnp_flow_record) == GNP_FLOW_RECORD_WIDTH * sizeof(double), "a record is a row of numbers");

/* Clouds of several states after each other: snapshot i has rows start[i] .. start[i + 1] - 1. */
struct gnp_flow_snapshots {
	size_t count;
	uint64_t *start; /* (count + 1) */
	uint64_t *step;  /* (count) */
	double *time;    /* (count) */
	double *points, *normals, *mean_curvature; /* (start[count], 3), the same, (start[count]) */
};

/* Owned by the caller; gnp_flow_clear frees it. m: points at the end. */
struct gnp_flow {
	size_t count;            /* m */
	double *points;          /* (m, 3) */
	double *normals;         /* (m, 3) outward unit normals, on the side of those at the start */
	double *mean_curvature;  /* (m) as estimated, not smoothed */
	int64_t *index;          /* (m) the cloud's index of each point, ascending; -1: inserted, at the end */
	size_t steps;            /* taken */
	struct gnp_flow_record *records; /* (steps + 1) */
	struct gnp_flow_snapshots snapshots;
	enum gnp_flow_stop stop;
	char reason[256];        /* a sentence with the figures */
	double spacing, dt, smoothing_radius, thinning, insertion; /* those used [length]; h and dt at the start */
	int normals_estimated;   /* as in struct gnp_estimate, as are these: */
	size_t components;
	const struct gnp_model *model;
};

/* fixed: (cloud->count) 1 where a point stays where it is, or NULL. When a stop rule other than `steps` holds, the result is the last
 * state that was good; when it already holds of the first step, that is an error that says what would do. Deterministic for any
 * worker count. On failure *out is unchanged. task may be NULL. */
gnp_status gnp_flow_run(const struct gnp_cloud *cloud, const unsigned char *fixed, const struct gnp_flow_options *options,
                        struct gnp_pool *pool, struct gnp_task *task, struct gnp_flow *out, struct gnp_error *error);
/* The same for a flow that outlives its process: between steps it is handed to checkpoint (may be NULL) now and then, and when it is
 * stopped with GNP_DRAINING; it goes on from what was kept if that is of the same flow, else begins at its start. The result is that
 * of a flow that was never interrupted, but for the seconds of the records. */
gnp_status gnp_flow_run_kept(const struct gnp_cloud *cloud, const unsigned char *fixed, const struct gnp_flow_options *options,
                             const struct gnp_checkpoint *checkpoint, struct gnp_pool *pool, struct gnp_task *task, struct gnp_flow *out,
                             struct gnp_error *error);
void gnp_flow_clear(struct gnp_flow *flow);

/* Peak bytes gnp_flow_run may allocate for count points, for admission control. */
size_t gnp_flow_memory(size_t count, const struct gnp_flow_options *options);

#endif
