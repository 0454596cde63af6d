/* What an estimator answers at the points that judge, as its user would get it. */
#ifndef GNP_WEIGHTS_JUDGED_H
#define GNP_WEIGHTS_JUDGED_H

#include "core/estimate/estimate.h"

/* As gnp_estimate_at, rows by at (count); but where the model weighs nodes, the whole cloud is estimated with its
 * default cover, because there neighbours serve each other and vote on outliers. */
gnp_status gnp_judged_at(const struct gnp_cloud *cloud, const struct gnp_estimate_options *options, const uint32_t *at,
                         size_t count, struct gnp_pool *pool, struct gnp_estimate *out, struct gnp_error *error);

#endif
