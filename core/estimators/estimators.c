#include "core/estimators/estimators.h"

#include "core/estimators/adaptive.h"
#include "core/estimators/gmls.h"
#include "core/estimators/learned.h"
#include "core/fit/taylor.h"

static struct gnp_basis as_wanted(struct gnp_basis wanted)
{
	return wanted;
}

static struct gnp_basis taylor(struct gnp_basis wanted)
{
	(void)wanted;
	return (struct gnp_basis){GNP_BASIS_TAYLOR, GNP_TAYLOR_DEGREE};
}

static const struct gnp_estimator table[GNP_ESTIMATOR_KINDS] = {
	[GNP_ESTIMATOR_GNP] = {.name = "gnp", .basis = taylor, .prepare = gnp_learned_prepare,
	                       .release = gnp_learned_release, .model = gnp_learned_model, .rule = gnp_learned_rule,
	                       .reach = gnp_learned_reach, .served = gnp_learned_served, .outliers = gnp_learned_outliers,
	                       .normals = gnp_learned_normals, .fit = gnp_learned_fit,
	                       .weighted = gnp_learned_weighted},
	[GNP_ESTIMATOR_GMLS] = {.name = "gmls", .basis = as_wanted, .fit = gnp_gmls_fit},
	[GNP_ESTIMATOR_ADAPTIVE] = {.name = "adaptive", .errors = true, .basis = taylor,
	                            .prepare = gnp_adaptive_prepare, .release = gnp_adaptive_release,
	                            .reach = gnp_adaptive_reach, .served = gnp_adaptive_served,
	                            .outliers = gnp_adaptive_outliers, .normals = gnp_adaptive_normals, .fit = gnp_adaptive_fit},
};

const struct gnp_estimator *gnp_estimator_at(enum gnp_estimator_kind kind)
{
	return (unsigned)kind < GNP_ESTIMATOR_KINDS ? &table[kind] : NULL;
}
