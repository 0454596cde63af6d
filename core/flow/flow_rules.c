#include "core/flow/flow_rules.h"

#include <math.h>

double gnp_flow_mean_spacing(const struct gnp_flow_state *state)
{
	return sqrt(state->total_area / (double)state->count);
}

double gnp_flow_fling(const struct gnp_flow_state *state, double dt)
{
	return dt * state->overshoot / gnp_flow_mean_spacing(state);
}

/* With the paper's scheme, or a limit that is given: the nearly largest curvature. Else by how many points more than at
 * the start are not resolved: those that were not are rounded first. */
static bool is_singular(const struct gnp_flow_options *options, const struct gnp_flow_state *now,
                        struct gnp_flow *result)
{
	static const double MORE = 0.1, WORSE = 1.25;
	bool simple = options->scheme == GNP_FLOW_EXPLICIT || !isnan(options->singularity);
	double limit = isnan(options->singularity) ? GNP_FLOW_RESOLVED : options->singularity;
	double share = MORE + WORSE * result->unresolved;
	if (simple ? now->resolution <= limit : now->unresolved <= share)
		return false;
	if (simple)
		gnp_flow_result_stop(result, GNP_FLOW_SINGULARITY,
		                     "curvature times spacing is %.3g (largest |H| %.3g, spacing %.3g), the limit is %g",
		                     now->resolution, now->curvature, gnp_flow_mean_spacing(now), limit);
	else
		gnp_flow_result_stop(result, GNP_FLOW_SINGULARITY,
		                     "curvature times spacing is above %g at %.3g %% of the points (largest |H| %.3g, spacing "
		                     "%.3g), the limit is %.3g %%: a neck or a thin part collapses",
		                     limit, 100 * now->unresolved, now->curvature, gnp_flow_mean_spacing(now), 100 * share);
	return true;
}

static double spacing_limit(const struct gnp_flow_options *options, const struct gnp_flow *result)
{
	static const double WIDER = 2; /* than the widest at the start, where those are few */
	return fmax(options->spacing_limit * result->spacing, WIDER * result->wide);
}

bool gnp_flow_may_go_on(const struct gnp_flow_options *options, const struct gnp_flow_move *move,
                        const struct gnp_flow_state *now, struct gnp_flow *result)
{
	bool conformal = options->scheme == GNP_FLOW_CONFORMAL;
	double start = result->records[0].area, fling = gnp_flow_fling(now, move->dt);
	double apart = spacing_limit(options, result);
	if (!conformal && is_singular(options, now, result))
		return false;
	if (!conformal && fling > GNP_FLOW_FLING_MOST)
		gnp_flow_result_stop(result, GNP_FLOW_UNSTABLE,
		                     "points move to and fro by %.3g times their spacing, %.3g: dt, %.3g, is too large, or the "
		                     "curvature is noise: take a smaller one, or scheme=semi_implicit",
		                     fling, now->dense, move->dt);
	else if (!conformal && now->spread > apart)
		gnp_flow_result_stop(result, GNP_FLOW_SPACING,
		                     "points are %.3g apart, the limit is %.3g (%g times the start's)",
		                     now->spread, apart, apart / result->spacing);
	else if (now->total_area < 1e-6 * start)
		gnp_flow_result_stop(result, GNP_FLOW_VANISHED, "the area is %.3g, at the start it was %.3g",
		                     now->total_area, start);
	else
		return true;
	return false;
}
