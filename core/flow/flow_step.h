/* A step of a flow: from a measured state to the points of the next. */
#ifndef GNP_CORE_FLOW_STEP_H
#define GNP_CORE_FLOW_STEP_H

#include "core/base/pool.h"
#include "core/flow/flow_options.h"
#include "core/flow/flow_state.h"

/* What a flow settles once and every step goes by; lengths are settled, none NAN. */
struct gnp_flow_move {
	enum gnp_flow_scheme scheme; /* explicit or semi-implicit */
	double dt, projection;
	bool preserve;       /* the volume, which was */
	double volume;       /* at the start */
	double thinning, insertion;
	size_t points_most;  /* none are inserted beyond */
};

struct gnp_flow_moved {
	double too_far;      /* > 1: the step moves points this many times too far (99.9th percentile), and *next is not made */
	size_t thinned, inserted;
};

/* Points first go the share `projection` of the way to their surface and along it as the state says. Explicit: d = dt H
 * n; semi-implicit: (M + dt/2 S) d = M dt H n (diffusion.h), which is x' = x + dt/2 Delta x' with Delta x = 2 H n taken
 * from the estimate. A step is too far when it passes half the spacing of points (explicit) or half the radius of
 * curvature (semi-implicit). *next: points, normals carried along, index, fixed; to be measured. */
gnp_status gnp_flow_step(const struct gnp_flow_state *state, const struct gnp_flow_move *move, struct gnp_pool *pool,
                         struct gnp_task *task, struct gnp_flow_state *next, struct gnp_flow_moved *moved, struct gnp_error *error);

#endif
