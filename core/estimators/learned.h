/* The estimator `gnp`: surfaces by a geometric neural operator (the paper's section on GNPs), run from a model's
 * weights.
 *
 * Models with the pooled head are the paper's networks: a patch's coordinates in, 16 Legendre coefficients out. Models
 * with the projection head (projection.h) also see the residuals of first fits; outliers are found first (outliers.h)
 * for models of the regime `outlier`, or where they are to be left out, and no point is told what lies on another
 * sheet. Models with the weighted head are for any cloud (weighted_fit.h); one of them is taken where no model is
 * named. */
#ifndef GNP_CORE_LEARNED_H
#define GNP_CORE_LEARNED_H

#include "core/estimators/estimator.h"

/* See struct gnp_estimator. Without a model that fits: GNP_INVALID_ARGUMENT. */
gnp_status gnp_learned_prepare(const struct gnp_fit_cloud *cloud, const struct gnp_fit_options *options,
                               struct gnp_pool *pool, struct gnp_task *task, void **state, struct gnp_error *error);
void gnp_learned_release(void *state);
const struct gnp_model *gnp_learned_model(const void *state);
void gnp_learned_rule(const void *state, struct gnp_patch_rule *rule);
size_t gnp_learned_reach(const void *state, uint32_t point);
size_t gnp_learned_served(const void *state, uint32_t point);
const unsigned char *gnp_learned_outliers(const void *state);
const double *gnp_learned_normals(const void *state);
const struct gnp_weighted_cloud *gnp_learned_weighted(const void *state);
gnp_status gnp_learned_fit(const struct gnp_fit_options *options, const void *state, const struct gnp_patch *patches,
                           size_t count, struct gnp_fit *fits, struct gnp_scratch *scratch, struct gnp_error *error);

#endif
