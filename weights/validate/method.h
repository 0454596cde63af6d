/* What is judged: an estimator and, where it is learned, the weights it is given in each regime. */
#ifndef GNP_WEIGHTS_METHOD_H
#define GNP_WEIGHTS_METHOD_H

#include <stdbool.h>

#include "core/estimators/estimator.h"
#include "core/model/models.h"
#include "weights/protocol/protocol.h"

enum gnp_method {
	GNP_METHOD_GNP, /* by the model for any cloud, which weights=auto is */
	GNP_METHOD_FIT, /* by the model trained for the regime */
	GNP_METHOD_POOLED,
	GNP_METHOD_GMLS,
	GNP_METHOD_ADAPTIVE,
	GNP_METHODS
};

struct gnp_method_info {
	const char *name;
	enum gnp_estimator_kind estimator;
	bool any;                    /* its weights are those for any cloud */
	const char *before, *behind; /* else they are named as the regime's, with these about it; NULL: it uses none */
};

/* NULL past the last. */
const struct gnp_method_info *gnp_method_info(enum gnp_method method);

/* The first by name that weighs nodes, as weights=auto takes it; NULL: there is none. models may be NULL. */
const struct gnp_model *gnp_method_any(const struct gnp_models *models);

/* The weights it is given in a regime, *out NULL when it uses none. GNP_INVALID_ARGUMENT: they are not among the
 * models. */
gnp_status gnp_method_model(enum gnp_method method, enum gnp_regime regime, const struct gnp_models *models,
                               const struct gnp_model **out, struct gnp_error *error);

#endif
