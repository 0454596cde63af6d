/* What a flow leaves behind: the cloud at the end, a record of every step, snapshots, and why it stopped. */
#ifndef GNP_CORE_FLOW_RESULT_H
#define GNP_CORE_FLOW_RESULT_H

#include <stddef.h>
#include <stdint.h>

#include "core/base/status.h"

struct gnp_flow_state;
struct gnp_model;

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
	double usual, dense, wide; /* median, 5th and 99.9th percentile of the spacings at the start [length] */
	double unresolved; /* share of points at the start whose curvature times spacing is more than GNP_FLOW_RESOLVED */
	double spacing, dt, smoothing_radius, thinning, insertion; /* those used [length]; h and dt at the start */
	int normals_estimated;   /* as in struct gnp_estimate, as are these: */
	size_t components;
	const struct gnp_model *model;
};
void gnp_flow_clear(struct gnp_flow *flow);

/* ---- How a flow fills its result ---- */

/* Why it stopped, with a sentence of figures. */
__attribute__((format(printf, 3, 4)))
void gnp_flow_result_stop(struct gnp_flow *result, enum gnp_flow_stop why, const char *format, ...);

/* Appends the row of a step, which is the result's number of steps from then on. gnp_flow_clear frees a half-made
 * result. */
gnp_status gnp_flow_result_record(struct gnp_flow *result, const struct gnp_flow_record *record,
                                  struct gnp_error *error);

/* Appends the state, of that record. */
gnp_status gnp_flow_result_snapshot(struct gnp_flow *result, const struct gnp_flow_state *state,
                                    const struct gnp_flow_record *record, struct gnp_error *error);

/* Points, normals, H and indices of the state, in the cloud's order, those inserted last. */
gnp_status gnp_flow_result_take(struct gnp_flow *result, const struct gnp_flow_state *state, struct gnp_error *error);

#endif
