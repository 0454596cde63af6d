#include "weights/validate/contender.h"

#include <stdio.h>

static const struct gnp_contender_info contenders[GNP_CONTENDERS] = {
	[GNP_CONTENDER_GNP] = {"gnp", GNP_ESTIMATOR_GNP, ""},
	[GNP_CONTENDER_POOLED] = {"pooled", GNP_ESTIMATOR_GNP, "_pooled"},
	[GNP_CONTENDER_GMLS] = {"gmls", GNP_ESTIMATOR_GMLS, NULL},
	[GNP_CONTENDER_ADAPTIVE] = {"adaptive", GNP_ESTIMATOR_ADAPTIVE, NULL},
};

const struct gnp_contender_info *gnp_contender_info(enum gnp_contender contender)
{
	return (unsigned)contender < GNP_CONTENDERS ? &contenders[contender] : NULL;
}

gnp_status gnp_contender_model(enum gnp_contender contender, enum gnp_regime regime, const struct gnp_models *models,
                               const struct gnp_model **out, struct gnp_error *error)
{
	const struct gnp_contender_info *info = &contenders[contender];
	const struct gnp_regime_info *in = gnp_regime_info(regime);
	char name[GNP_MODEL_NAME_MAX + 1];
	struct gnp_error why = {0};
	*out = NULL;
	if (!info->suffix)
		return GNP_OK;
	snprintf(name, sizeof name, "%s%s", in->weights, info->suffix);
	gnp_status status = gnp_models_find(models, name, out, &why);
	return status == GNP_OK ? status : gnp_error_set(error, status, "%s in %s: %s", info->name, in->name, why.text);
}
