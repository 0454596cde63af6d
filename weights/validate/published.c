#include "weights/validate/published.h"

#include <math.h>

static const double printed[GNP_FAMILIES][GNP_REGIMES][GNP_PUBLISHED_MODELS][GNP_SCORES] = {
	[GNP_FAMILY_RADIAL] = {
		[GNP_REGIME_CLEAN_30] = {{2.04e-06, 6.57e-04, 1.89e-02, 4.07e-02, 1.93e-02}, {3.11e-08, 5.95e-05, 4.10e-03, 1.92e-02, 7.15e-03}},
		[GNP_REGIME_CLEAN_50] = {{4.55e-06, 7.99e-04, 1.70e-02, 4.56e-02, 2.24e-02}, {1.89e-07, 1.16e-04, 7.06e-03, 3.17e-02, 1.21e-02}},
		[GNP_REGIME_OUTLIER_50] = {{3.70e-05, 1.97e-03, 2.75e-02, 6.26e-02, 3.14e-02}, {3.39e-04, 7.34e-03, 3.72e-01, 1.01e+00, 4.11e-01}},
		[GNP_REGIME_NOISE_70] = {{6.10e-05, 5.62e-03, 1.32e-01, 1.75e-01, 1.03e-01}, {6.11e-04, 1.79e-02, 1.17e+00, 2.19e+00, 7.00e-01}},
	},
	[GNP_FAMILY_TOROIDAL] = {
		[GNP_REGIME_CLEAN_30] = {{6.19e-07, 3.79e-05, 2.30e-02, 4.03e-02, 2.50e-02}, {3.97e-08, 1.27e-06, 5.90e-03, 2.10e-02, 8.34e-03}},
		[GNP_REGIME_CLEAN_50] = {{1.43e-06, 6.07e-05, 2.48e-02, 4.38e-02, 3.34e-02}, {3.97e-10, 3.61e-03, 1.03e-02, 2.55e-02, 1.49e-02}},
		[GNP_REGIME_OUTLIER_50] = {{4.16e-05, 2.11e-04, 3.71e-02, 6.31e-02, 4.45e-02}, {2.43e-04, 3.98e-04, 3.58e-01, 1.41e+00, 3.94e-01}},
		[GNP_REGIME_NOISE_70] = {{7.80e-05, 6.25e-04, 1.54e-01, 2.16e-01, 1.19e-01}, {8.74e-05, 1.25e-03, 1.25e+00, 2.24e+00, 6.93e-01}},
	},
};

const char *gnp_published_name(enum gnp_published_model model)
{
	return model == GNP_PUBLISHED_GNP ? "gnp" : "gmls";
}

double gnp_published_error(enum gnp_family family, enum gnp_regime regime, enum gnp_published_model model,
                           enum gnp_score score)
{
	return printed[family][regime][model][score];
}

bool gnp_published_is_outlying(enum gnp_family family, enum gnp_regime regime, enum gnp_published_model model,
                               enum gnp_score score)
{
	return family == GNP_FAMILY_TOROIDAL && regime == GNP_REGIME_CLEAN_50 && model == GNP_PUBLISHED_GMLS &&
	       (score == GNP_SCORE_NORMAL || score == GNP_SCORE_INVERSE_METRIC);
}

bool gnp_published_target(enum gnp_family family, enum gnp_regime regime, enum gnp_score score, double *target)
{
	*target = INFINITY;
	for (int model = 0; model < GNP_PUBLISHED_MODELS; model++) {
		if (gnp_published_is_outlying(family, regime, (enum gnp_published_model)model, score))
			return false;
		*target = fmin(*target, printed[family][regime][model][score]);
	}
	return true;
}
