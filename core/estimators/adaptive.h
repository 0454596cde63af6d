/* The adaptive estimator: robust, no parameter to choose, an error bar on everything.
 *
 * Whole cloud: outliers by consensus (outliers.h); then, at representative points, the evidence of Bayesian polynomial
 * regressions (regression.h) sets the length and amplitude of the surface's variation against the noise for supports
 * from dozens to hundreds of points, and the support whose Hessian has the smallest posterior variance among
 * neighbouring representatives is taken. Each point, or the few next to it within a tenth or so of a wide support's
 * reach, then has a regression of degree 7 with its representative's prior, over the nearest points that are neither
 * outliers nor on another sheet (normals turned away), misfits above 4.5 sigma dropped. Standard errors are the
 * posterior's. Nothing is drawn at random; noise level, support and effective degree come from the data. */
#ifndef GNP_CORE_ADAPTIVE_H
#define GNP_CORE_ADAPTIVE_H

#include "core/estimators/estimator.h"

/* See struct gnp_estimator. */
gnp_status gnp_adaptive_prepare(const struct gnp_fit_cloud *cloud, const struct gnp_fit_options *options,
                                struct gnp_pool *pool, struct gnp_task *task, void **state, struct gnp_error *error);
void gnp_adaptive_release(void *state);
size_t gnp_adaptive_reach(const void *state, uint32_t point);
size_t gnp_adaptive_served(const void *state, uint32_t point);
const unsigned char *gnp_adaptive_outliers(const void *state);
const double *gnp_adaptive_normals(const void *state);
gnp_status gnp_adaptive_fit(const struct gnp_fit_options *options, const void *state, const struct gnp_patch *patches,
                            size_t count, struct gnp_fit *fits, struct gnp_scratch *scratch, struct gnp_error *error);

#endif
