#include "estimator.h"

#include "gmls.h"

static const struct gnp_estimator table[GNP_ESTIMATOR_KINDS] = {
	[GNP_ESTIMATOR_GMLS] = {.name = "gmls", .support = 1, .delta0_ratio = 0.1, .fit = gnp_gmls_fit},
};

const struct gnp_estimator *gnp_estimator_at(enum gnp_estimator_kind kind)
{
	return (unsigned)kind < GNP_ESTIMATOR_KINDS ? &table[kind] : NULL;
}
