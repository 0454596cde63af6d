/* What may be asked of an estimate, and what its estimator makes of it. */
#ifndef GNP_CORE_ESTIMATE_OPTIONS_H
#define GNP_CORE_ESTIMATE_OPTIONS_H

#include <stdbool.h>
#include <stdint.h>

#include "core/base/status.h"
#include "core/estimators/estimator.h"
#include "core/fit/quantity.h"

enum gnp_cover_kind { GNP_COVER_COVER, GNP_COVER_ALL };

struct gnp_estimate_options {
	int estimator;        /* enum gnp_estimator_kind */
	int cover;            /* enum gnp_cover_kind */
	int k;                /* neighbours that set the patch radius epsilon = 1.1 r_k; 12..500 */
	int degree;           /* of the Legendre basis; 1..7 */
	int basis;            /* enum gnp_basis_kind */
	int weight;           /* enum gnp_weight_kind */
	int outliers;         /* enum gnp_outliers_kind */
	uint64_t quantities;  /* GNP_QUANTITY_BIT mask: all of them, or what the estimator has no answer for is an error */
	uint64_t if_offered;  /* the same, of those that are left out where the estimator has none */
	const struct gnp_model *model;   /* of estimators that use one; NULL: the one of models for any cloud */
	const struct gnp_models *models; /* to choose from; may be NULL: none */
	bool unjudged;        /* whether the answer is to be believed is not looked at (belief_answer.h) */
};

/* k 30, cover cover, the paper's GMLS (tensor degree 3, quartic weight); normals and both curvatures. */
struct gnp_estimate_options gnp_estimate_defaults(void);

/* Whether options are in their ranges and go together; gnp_estimate_run and the others check it themselves. */
gnp_status gnp_estimate_check(const struct gnp_estimate_options *options, struct gnp_error *error);

/* ---- What the estimator makes of them; the options are in their ranges ---- */

const struct gnp_estimator *gnp_estimate_estimator(const struct gnp_estimate_options *options);
struct gnp_basis gnp_estimate_basis(const struct gnp_estimate_options *options);

/* The mask of those asked for that it has an answer for. */
uint64_t gnp_estimate_quantities(const struct gnp_estimate_options *options);

/* Numbers a row of a quantity; basis_size: coefficients of a surface. */
size_t gnp_estimate_width(enum gnp_quantity quantity, size_t basis_size);

#endif
