/* Bodies and open patches of our own in the real table: exact surfaces, whose curvature is known too. A row of its table each. */
#ifndef GNP_WEIGHTS_REAL_BODY_H
#define GNP_WEIGHTS_REAL_BODY_H

#include "core/base/pool.h"
#include "weights/validate/real_cloud.h"

/* Name of the i-th body with its sampling; NULL past the last. */
const char *gnp_real_body_name(size_t i);

/* Its cloud. */
gnp_status gnp_real_body_make(size_t i, struct gnp_pool *pool, struct gnp_real_cloud *out, struct gnp_error *error);

#endif
