/* Turns coefficients of fitted surfaces into their jets at given places, and gradients of jets into those of
 * coefficients. */
#ifndef GNP_WEIGHTS_TRAIN_FIT_H
#define GNP_WEIGHTS_TRAIN_FIT_H

#include "core/cloud/patch.h"
#include "core/fit/legendre.h"

/* The jet in length units of h = scale_w sum_i c_i phi_i at scaled coordinates (u, v) of the patch. rows (6, GNP_BASIS_MAX) out:
 * d jet / d c. */
struct gnp_jet gnp_train_fit_jet(struct gnp_basis basis, const double *coefficients, const struct gnp_patch *patch, double u,
                                 double v, double *rows);

/* Adds rows^T times the gradient by the jet to that by the coefficients. */
void gnp_train_fit_back(struct gnp_basis basis, const double *rows, const struct gnp_jet *djet, double *dcoefficients);

#endif
