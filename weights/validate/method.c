#include "weights/validate/method.h"

#include <stdio.h>

static const struct gnp_method_info methods[GNP_METHODS] = {
	[GNP_METHOD_GNP] = {"gnp", GNP_ESTIMATOR_GNP, true, NULL, NULL},
	[GNP_METHOD_FIT] = {"fit", GNP_ESTIMATOR_GNP, false, "fit_", ""},
	[GNP_METHOD_POOLED] = {"pooled", GNP_ESTIMATOR_GNP, false, "", "_pooled"},
	[GNP_METHOD_GMLS] = {"gmls", GNP_ESTIMATOR_GMLS, false, NULL, NULL},
	[GNP_METHOD_ADAPTIVE] = {"adaptive", GNP_ESTIMATOR_ADAPTIVE, false, NULL, NULL},
};

const struct gnp_method_info *gnp_method_info(enum gnp_method method)
{
	return (unsigned)method < GNP_METHODS ? &methods[method] : NULL;
}

const struct gnp_model *gnp_method_any(const struct gnp_models *models)
{
	for (size_t i = 0; i < gnp_models_count(models); i++)
		if (gnp_models_at(models, i)->architecture.head == GNP_HEAD_WEIGHTED)
			return gnp_models_at(models, i);
	return NULL;
}

gnp_status gnp_method_model(enum gnp_method method, enum gnp_regime regime, const struct gnp_models *models,
                               const struct gnp_model **out, struct gnp_error *error)
{
	const struct gnp_method_info *info = &methods[method];
	const struct gnp_regime_info *in = gnp_regime_info(regime);
	char name[GNP_MODEL_NAME_MAX + 1];
	struct gnp_error why = {0};
	*out = NULL;
	if (info->any) {
		*out = gnp_method_any(models);
		return *out ? GNP_OK
		            : gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                            "%s in %s: none of the %zu models is for any cloud (head %s)", info->name, in->name,
		                            gnp_models_count(models), gnp_head_name(GNP_HEAD_WEIGHTED));
	}
	if (!info->before)
		return GNP_OK;
	snprintf(name, sizeof name, "%s%s%s", info->before, in->weights, info->behind);
	gnp_status status = gnp_models_find(models, name, out, &why);
	return status == GNP_OK ? status : gnp_error_set(error, status, "%s in %s: %s", info->name, in->name, why.text);
}
