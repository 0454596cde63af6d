/* What an estimator is: a function from patches to coefficients of their heights. One file and one row in the table. */
#ifndef GNP_CORE_ESTIMATOR_H
#define GNP_CORE_ESTIMATOR_H

#include "legendre.h"
#include "patch.h"
#include "scratch.h"
#include "status.h"

enum gnp_estimator_kind { GNP_ESTIMATOR_GMLS, GNP_ESTIMATOR_KINDS };
enum gnp_weight_kind { GNP_WEIGHT_QUARTIC, GNP_WEIGHT_FLAT, GNP_WEIGHT_LINEAR };

/* How to fit; the fields an estimator has no use for are ignored by it. */
struct gnp_fit_options {
	struct gnp_basis basis;
	enum gnp_weight_kind weight; /* of a point at r = |(u, v)| in [0, 1]: (1 - r)^4, 1, or 1.2 - r */
};

/* What a fit tells of itself. */
struct gnp_fit {
	unsigned degree;  /* that the neighbourhood carried; below the basis's degree where it was too poor */
	double residual;  /* weighted root mean square of the heights' misfit, in units of scale_w */
};

/* Fits each patch: coefficients (count, gnp_basis_size(options->basis)), fits (count). */
typedef gnp_status (*gnp_fit_fn)(const struct gnp_fit_options *options, const struct gnp_patch *patches, size_t count,
                                 double *coefficients, struct gnp_fit *fits, struct gnp_scratch *scratch,
                                 struct gnp_error *error);

struct gnp_estimator {
	const char *name;
	double support;      /* how far its patches see, in units of epsilon */
	double delta0_ratio; /* smallest height scale, in units of epsilon */
	gnp_fit_fn fit;
};

/* The row of an estimator; NULL past the last. */
const struct gnp_estimator *gnp_estimator_at(enum gnp_estimator_kind kind);

#endif
