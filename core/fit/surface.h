/* Computes every geometric quantity of a fitted patch, in closed form from the height function's derivatives.
 *
 * Monge form (the paper's appendix A): with heights h and their derivatives in the caller's length unit,
 *   g = [[1 + h_u^2, h_u h_v], [h_u h_v, 1 + h_v^2]], det g = 1 + h_u^2 + h_v^2, n = (-h_u, -h_v, 1) / sqrt(det g),
 *   II = Hess(h) / sqrt(det g), W = g^-1 II, K = det W, H = tr W / 2, d_k g^ij = -g^ia (d_k g_ab) g^bj. */
#ifndef GNP_CORE_SURFACE_H
#define GNP_CORE_SURFACE_H

#include <stdint.h>

#include "core/fit/legendre.h"
#include "core/fit/quantity.h"

/* Height over the plane of a frame: h = scale_w * sum_i coefficients_i phi_i(u, v), (u, v) in units of scale_xy. */
struct gnp_surface {
	struct gnp_basis basis;
	const double *coefficients;
	double origin[3], frame[3][3]; /* rows psi1, psi2, psi3 */
	double scale_xy, scale_w;
	/* With error bars (Taylor basis only): the factor of regression.h and the noise variance in units of scale_w^2. */
	const double *factor; /* NULL without */
	double variance;
	double doubt[3]; /* factors of the posterior's variances of height, slopes and second derivatives for what the model cannot express */
	double noise;    /* standard deviation of the point's own place along the surface [length]; 0: doubt has it */
};

/* Scaled in-plane coordinates of a point in space. */
void gnp_surface_locate(const struct gnp_surface *surface, const double point[3], double *u, double *v);

/* The height and its derivatives in length units at scaled coordinates (u, v). */
struct gnp_jet gnp_surface_jet(const struct gnp_surface *surface, double u, double v);

/* Writes the quantities of `mask` (of those that follow from the surface alone: neither
 * surface_coefficients, residual, deviation, outlier nor boundary) at one point with scaled
 * coordinates (u, v) into row `row` of values[quantity]. */
void gnp_surface_evaluate(const struct gnp_surface *surface, double u, double v, uint64_t mask, size_t row,
                          double *const values[GNP_QUANTITY_COUNT]);

/* Laplace-Beltrami of a function p of the physical in-plane coordinates, given p's and h's derivatives there:
 * g^ij p_ij - (g^ij h_ij)(h_k p_k) / det g. */
double gnp_laplace_beltrami(const struct gnp_jet *height, const struct gnp_jet *p);

#endif
