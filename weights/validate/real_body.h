/* Bodies and open patches of our own in the real table: exact surfaces, smooth and with creases, whose curvature is
 * known too. */
#ifndef GNP_WEIGHTS_REAL_BODY_H
#define GNP_WEIGHTS_REAL_BODY_H

#include <stdbool.h>

#include "core/base/pool.h"
#include "weights/validate/real_cloud.h"

struct gnp_real_body_name {
	char surface[64], sampling[32];
};

/* What the i-th is; false past the last. */
bool gnp_real_body_name(size_t i, struct gnp_real_body_name *out);

/* Its cloud. Of bodies with creases (core/solids/solid.h) points within a spacing of a crease, a rim or a tip are not
 * judged, but where the sampling says "edges too". */
gnp_status gnp_real_body_make(size_t i, struct gnp_pool *pool, struct gnp_real_cloud *out, struct gnp_error *error);

#endif
