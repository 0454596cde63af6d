/* The paper's Table 1 as printed, and what it asks of an estimator. */
#ifndef GNP_WEIGHTS_PUBLISHED_H
#define GNP_WEIGHTS_PUBLISHED_H

#include <stdbool.h>

#include "weights/protocol/protocol.h"
#include "weights/protocol/score.h"

enum gnp_published_model { GNP_PUBLISHED_GNP, GNP_PUBLISHED_GMLS, GNP_PUBLISHED_MODELS };

const char *gnp_published_name(enum gnp_published_model model);

/* A printed error. */
double gnp_published_error(enum gnp_family family, enum gnp_regime regime, enum gnp_published_model model,
                           enum gnp_score score);

/* True for the two printed cells that do not fit the rest of their row and column (GMLS, toroidal, no noise, k = 50: the
 * normal is a hundred times better than at k = 30, the metric three thousand times worse). They bind nobody. */
bool gnp_published_is_outlying(enum gnp_family family, enum gnp_regime regime, enum gnp_published_model model,
                               enum gnp_score score);

/* Whether a cell is judged beside both rows, and the smaller of its printed errors: what an estimator's mean has to be below. */
bool gnp_published_target(enum gnp_family family, enum gnp_regime regime, enum gnp_score score, double *target);

#endif
