/* The table of all estimators. */
#ifndef GNP_CORE_ESTIMATORS_H
#define GNP_CORE_ESTIMATORS_H

#include "core/estimators/estimator.h"

/* The row of an estimator; NULL past the last. */
const struct gnp_estimator *gnp_estimator_at(enum gnp_estimator_kind kind);

#endif
