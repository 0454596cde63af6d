#include "weights/validate/method.h"

#include <stdio.h>

static const struct gnp_method_info methods[GNP_METHODS] = {
	[GNP_METHOD_GNP] = {"gnp", GNP_ESTIMATOR_GNP, "fit_", ""},
	[GNP_METHOD_POOLED] = {"pooled", GNP_ESTIMATOR_GNP, "", "_pooled"},
	[GNP_METHOD_GMLS] = {"gmls", GNP_ESTIMATOR_GMLS, NULL, NULL},
	[GNP_METHOD_ADAPTIVE] = {"adaptive", GNP_ESTIMATOR_ADAPTIVE, NULL, NULL},
};

const struct gnp_method_info *gnp_method_info(enum gnp_method method)
{
	return (unsigned)method < GNP_METHODS ? &methods[method] : NULL;
}

gnp_status gnp_method_model(enum gnp_method method, enum gnp_regime regime, const struct gnp_models *models,
                               const struct gnp_model **out, struct gnp_error *error)
{
	const struct gnp_method_info *info = &methods[method];
	const struct gnp_regime_info *in = gnp_regime_info(regime);
	char name[GNP_MODEL_NAME_MAX + 1];
	struct gnp_error why = {0};
	*out = NULL;
	if (!info->before)
		return GNP_OK;
	snprintf(name, sizeof name, "%s%s%s", info->before, in->weights, info->behind);
	gnp_status status = gnp_models_find(models, name, out, &why);
	return status == GNP_OK ? status : gnp_error_set(error, status, "%s in %s: %s", info->name, in->name, why.text);
}
