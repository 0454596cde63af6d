/* What a weighted model says on average: the outputs of its head over supports of the bodies it is trained for, which
 * are put in the place of every support's own to see what these are good for. */
#ifndef GNP_WEIGHTS_ABLATION_WEIGHTED_H
#define GNP_WEIGHTS_ABLATION_WEIGHTED_H

#include "core/base/pool.h"
#include "core/model/model.h"

/* A body of every kind (core/solids/solid.h) of at most so many points, even or random, in lines or uneven, with
 * noise of 0 to 2 spacings; its seeds are none of those that training is watched by. outputs (GNP_WEIGHTED_OUTPUTS)
 * out. */
gnp_status gnp_ablation_weighted_outputs(const struct gnp_model *model, size_t points, struct gnp_pool *pool,
                                         float *outputs, struct gnp_error *error);

#endif
