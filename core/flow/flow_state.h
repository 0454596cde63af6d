/* A state of a flow: the cloud, its geometry, and what its points measure. */
#ifndef GNP_CORE_FLOW_STATE_H
#define GNP_CORE_FLOW_STATE_H

#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/status.h"

/* Curvature times spacing that points still resolve. */
#define GNP_FLOW_RESOLVED 0.5

enum { GNP_FLOW_EDGES = 16 }; /* of a cell, at most; a few more would be slivers */

/* Arrays in curve order, owned; gnp_flow_state_clear frees them. */
struct gnp_flow_state {
	size_t count;
	double *points;       /* (count, 3) */
	double *normals;      /* (count, 3) unit; those carried along until measured, then the surface's on the same side */
	int64_t *index;       /* (count) of the caller's cloud, -1: inserted */
	unsigned char *fixed; /* (count) */
	double *before;       /* (count) the smoothed H of the state before; NAN where the estimator had none */
	/* Made by gnp_flow_measure. */
	double *mean_curvature; /* (count) H as estimated */
	double *smooth;         /* (count) its Gaussian mean, or H: what steps go by */
	unsigned char *rough;   /* (count) 1 where that is not the estimator's but the finite volumes' */
	double *principal;      /* (count, 2) k1 >= k2 */
	double *directions;     /* (count, 2, 3) of k1 and k2; NULL unless the rule is `along` */
	double *area;           /* (count) of each point's cell (cell.h) */
	double *apart;          /* (count) distance to the nearest other point; infinite without one among those looked at */
	double *gap;            /* (count) distance of its farthest corner where that is a hole (cell.h), else 0 */
	double *corner;         /* (count, 3) that corner as an offset in the tangent plane */
	double *lift;           /* (count) from the point along the normal to the fitted surface */
	double *shift;          /* (count, 3) along the surface, to be made before the step; NULL without tangential smoothing */
	uint32_t *neighbor;     /* (count, GNP_FLOW_EDGES) across the cell's edges, and */
	float *weight;          /* edge over distance; 0 past the last edge; both NULL unless the rule wants edges */
	double total_area, volume;
	double spread, dense; /* the 99.9th and the 5th percentile of the points' spacings */
	double overshoot;     /* root mean square over the points of the change of H where its sign changed since the state before */
	double curvature, resolution; /* as in struct gnp_flow_record */
	double nearest;       /* the least of `apart` */
	double unresolved;    /* share of the points where curvature times spacing is more than GNP_FLOW_RESOLVED */
};

/* Room for points, normals, index, fixed (0) and before (NAN); the rest NULL. */
gnp_status gnp_flow_state_reserve(struct gnp_flow_state *state, size_t count, struct gnp_error *error);
void gnp_flow_state_clear(struct gnp_flow_state *state);

/* Bytes of a measured state of count points; along, tangential, edges: as the rule it is measured by (flow_measure.h)
 * has them. */
size_t gnp_flow_state_memory(size_t count, bool along, bool tangential, bool edges);

/* Puts the points in curve order; of a state that is not measured. On failure the state is unchanged. */
gnp_status gnp_flow_state_sort(struct gnp_flow_state *state, struct gnp_error *error);

/* Positions in an order that does not depend on where points lie: fixed ones first, if asked for (their number in
 * *fixed), then those of the cloud by their index there, then inserted ones as they stand. *order (count) is freed by
 * the caller. */
gnp_status gnp_flow_state_rank(const struct gnp_flow_state *state, bool fixed_first, uint32_t **order, size_t *fixed,
                               struct gnp_error *error);

/* II(d, d) at point i for a tangent vector d: twice the height of the surface over the tangent plane, to second
 * order. */
double gnp_flow_second_form(const struct gnp_flow_state *state, size_t i, const double d[3]);

/* The normal at a small way d from point i along the surface, to first order. */
void gnp_flow_normal_along(const struct gnp_flow_state *state, size_t i, const double d[3], double out[3]);

/* Distance between neighbours that a point's cell stands for: the root of its area. */
static inline double gnp_flow_spacing(const struct gnp_flow_state *state, size_t i)
{
	return sqrt(state->area[i]);
}

#endif
