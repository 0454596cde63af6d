/* Who is judged: an estimator and, where it is learned, the weights it is given in each regime. */
#ifndef GNP_WEIGHTS_CONTENDER_H
#define GNP_WEIGHTS_CONTENDER_H

#include "core/estimate/estimator.h"
#include "core/model/models.h"
#include "weights/protocol/protocol.h"

enum gnp_contender { GNP_CONTENDER_GNP, GNP_CONTENDER_POOLED, GNP_CONTENDER_GMLS, GNP_CONTENDER_ADAPTIVE, GNP_CONTENDERS };

struct gnp_contender_info {
	const char *name;
	enum gnp_estimator_kind estimator;
	const char *suffix; /* its weights are named as the regime's, with this behind; NULL: it uses none */
};

/* NULL past the last. */
const struct gnp_contender_info *gnp_contender_info(enum gnp_contender contender);

/* The weights it is given in a regime, *out NULL when it uses none. GNP_INVALID_ARGUMENT: they are not among the models. */
gnp_status gnp_contender_model(enum gnp_contender contender, enum gnp_regime regime, const struct gnp_models *models,
                               const struct gnp_model **out, struct gnp_error *error);

#endif
