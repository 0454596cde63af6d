/* What the operation filter, with its defaults, does to samples of meshes: how many good points it drops, and how
 * many planted outliers it finds. */
#ifndef GNP_WEIGHTS_REAL_FILTER_H
#define GNP_WEIGHTS_REAL_FILTER_H

#include "core/base/pool.h"
#include "core/model/models.h"
#include "weights/validate/real_cloud.h"

/* A tenth of the points get isotropic Gaussian noise of this deviation on top of what they have. Of those, outliers
 * are the ones that are then farther than `beyond` from where they were, along the normal; the others count nowhere.
 */
struct gnp_real_planting {
	double deviation; /* [length]; 0: none are planted */
	double beyond;    /* [length] */
	uint64_t seed;
};

struct gnp_real_filtered {
	size_t good, dropped; /* points that were not displaced, and those of them that were dropped */
	size_t outliers, found;
};

/* On failure *out is unchanged. */
gnp_status gnp_real_filter_judge(const struct gnp_real_cloud *cloud, const struct gnp_real_planting *planting,
                                 const struct gnp_models *models, struct gnp_pool *pool,
                                 struct gnp_real_filtered *out, struct gnp_error *error);

#endif
