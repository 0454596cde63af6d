/* Measures a state of a flow: its geometry by the estimator, then what each point sees about it (its cell, the smoothed
 * curvature), then sums over the points. O(n log n). */
#ifndef GNP_CORE_FLOW_MEASURE_H
#define GNP_CORE_FLOW_MEASURE_H

#include "core/estimate/estimate.h"
#include "core/flow/flow_state.h"

/* What every state is estimated for, and where points move along the surface also principal directions. */
#define GNP_FLOW_QUANTITIES                                                                                 \
	(GNP_QUANTITY_BIT(GNP_POINTS) | GNP_QUANTITY_BIT(GNP_NORMALS) | GNP_QUANTITY_BIT(GNP_MEAN_CURVATURE) | \
	 GNP_QUANTITY_BIT(GNP_PRINCIPAL_CURVATURES))

/* What a flow settles once and every state is measured by. */
struct gnp_flow_rule {
	struct gnp_estimate_options estimate;
	double origin[3]; /* volumes are taken about it */
	double smoothing, tangential;
	bool weak;        /* where the estimate is not to be believed, H is that of finite volumes */
	bool along;       /* points are inserted or moved along the surface: directions are wanted */
	bool edges;       /* an implicit step will be made */
};

/* Estimates the geometry and fills the rest. model (may be NULL): the one used. GNP_DEGENERATE when the cloud no longer
 * determines a surface; *finite: false when it has a value that is not a number, and then the measures are not to be
 * used. */
gnp_status gnp_flow_measure(struct gnp_flow_state *state, const struct gnp_flow_rule *rule, struct gnp_pool *pool,
                            struct gnp_task *task, const struct gnp_model **model, bool *finite, struct gnp_error *error);

#endif
