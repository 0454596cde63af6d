/* Generalised moving least squares, the paper's baseline (eq. gmls_surface): heights of a patch are fitted by
 * argmin_q sum_j w(|(u_j, v_j)|) (w_j - q(u_j, v_j))^2 over the basis, with w(r) = (1 - r)_+^4 by default. */
#ifndef GNP_CORE_GMLS_H
#define GNP_CORE_GMLS_H

#include "core/estimators/estimator.h"

/* See gnp_fit_fn. A neighbourhood too poor for the basis is fitted with the highest degree it carries, the other
 * coefficients being zero. */
gnp_status gnp_gmls_fit(const struct gnp_fit_options *options, const void *state, const struct gnp_patch *patches,
                        size_t count, struct gnp_fit *fits, struct gnp_scratch *scratch, struct gnp_error *error);

#endif
