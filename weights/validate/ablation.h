/* Models with a part of them taken away, to see what that part does: the weights of a copy are altered, nothing else.
 *
 * Of models with the heads projection and weighted alone: what the pooled head says is all of its trunk's doing. Models
 * without a part are left out where it is taken away. */
#ifndef GNP_WEIGHTS_ABLATION_H
#define GNP_WEIGHTS_ABLATION_H

#include <stdbool.h>

#include "core/base/pool.h"
#include "core/model/models.h"

/* enumerator, name, what is done. */
#define GNP_ABLATION_TABLE(X) \
	X(GNP_ABLATION_NONE, "whole", "nothing") \
	X(GNP_ABLATION_REMOVED, "trunk removed", "the head, and what weighs nodes, is told 0 of the trunk") \
	X(GNP_ABLATION_RANDOM, "trunk random", "each tensor of the trunk is Gaussian, of the same root mean square") \
	X(GNP_ABLATION_CONSTANT, "outputs constant", "every patch gets the head's mean outputs, nodes keep their weights") \
	X(GNP_ABLATION_WEIGHTS, "node weights one", "every node is taken for one of the centre's smooth piece")

enum gnp_ablation_part {
#define GNP_ABLATION_ENUM(id, name, help) id,
	GNP_ABLATION_TABLE(GNP_ABLATION_ENUM)
#undef GNP_ABLATION_ENUM
	GNP_ABLATION_PARTS
};

/* NULL past the last. */
const char *gnp_ablation_name(unsigned part);
const char *gnp_ablation_help(unsigned part);

/* What the head says on average, outputs (gnp_projection_outputs) out. projection: over patches of shapes that
 * training is watched by, sampled by so many points and displaced as in the protocol's regimes that are the model's, or
 * all of them where none is; weighted: over supports of bodies (ablation_weighted.h). */
gnp_status gnp_ablation_mean_outputs(const struct gnp_model *model, size_t points, struct gnp_pool *pool,
                                     float *outputs, struct gnp_error *error);

/* Whether there is such a part to be taken of a model. */
bool gnp_ablation_has(const struct gnp_model *model, enum gnp_ablation_part part);

/* The models that have the part, altered, as a set of their own with the same names (released by the caller); of
 * GNP_ABLATION_NONE all. points: as above. */
gnp_status gnp_ablation_models(const struct gnp_models *models, enum gnp_ablation_part part, size_t points,
                               struct gnp_pool *pool, struct gnp_models **out, struct gnp_error *error);

#endif
