/* First fits of a support: mildly regularised least squares over nested sets of nodes, from which a network is told how
 * noisy and how curved a neighbourhood is.
 *
 * Penalties are the same for every support: ridge 1e-6 a point on terms of order 3 and more, weighed as those of an
 * isotropic random surface (a1! a2!). */
#ifndef GNP_CORE_FIRST_FITS_H
#define GNP_CORE_FIRST_FITS_H

#include <stddef.h>

#include "core/fit/taylor.h"

/* Sums over nodes; begins as zeros. */
struct gnp_first_sums {
	double count, square; /* points; sum of y^2 */
	double moment[GNP_TAYLOR_STRIDE];
	_Alignas(64) double gram[GNP_TAYLOR_SIZE * GNP_TAYLOR_STRIDE];
};

/* rows (count, GNP_TAYLOR_STRIDE), weights and y (count). */
void gnp_first_sums_add(struct gnp_first_sums *sums, const double *rows, const double *weights, const double *y,
                        size_t count);

struct gnp_first_fit {
	double mean[GNP_TAYLOR_STRIDE]; /* 0 past the functions */
	double power[GNP_TAYLOR_DEGREE + 1]; /* of the radius */
	double misfit;                       /* mean square */
};

/* radius: of the points summed, in units of the rows. Where they determine nothing, mean is 0 and misfit that of 0. */
void gnp_first_fit_solve(const struct gnp_first_sums *sums, double radius, struct gnp_first_fit *out);

/* summary (1 + GNP_TAYLOR_DEGREE): logarithms of the misfit's root and of the coefficients' size by order from 1. */
void gnp_first_fit_summarise(const struct gnp_first_fit *fit, float *summary);

#endif
