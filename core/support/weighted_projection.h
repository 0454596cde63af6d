/* The weighted projection: the surface at a point as a regularised least-squares fit to the nodes of its support, whose
 * weights, reach and penalties a network chooses.
 *
 *   c = argmin sum_i a_i (y_i - c . phi_i)^2 + sum_b lambda_|b| b1! b2! c_b^2,   a_i = m_i s_i / (1 + (d_i / rho)^4)
 * over nodes i of m_i points at distance d_i (support.h), monomials phi of degree at most 7. s_i in (0, 1) says whether
 * the node is of the centre's smooth piece, rho how far the piece reaches, lambda_j = exp(4 o_j) how smooth it is. It
 * is differentiated through the solution. Compare weights learned for local fits: Ben-Shabat & Gould 2020 (DeepFit),
 * Zhu et al. 2021 (AdaFit).
 *
 * Errors of the fit are those of its covariance under noise as large as the weighted misfit, and of the pull of its
 * penalties towards 0, B^2 with B = A^-1 L c (A of the normal equations with the penalties L, c the fit's own);
 * scaled, and with a bias, both as the network says: var = exp(4 o) (V + B^2) + exp(4 o'), for slopes and for second
 * derivatives. */
#ifndef GNP_CORE_WEIGHTED_PROJECTION_H
#define GNP_CORE_WEIGHTED_PROJECTION_H

#include <stdbool.h>

#include "core/support/support.h"

/* What a network says of a support, besides logits of nodes. */
enum gnp_weighted_output {
	GNP_WEIGHTED_RIDGE,                                         /* o_0 .. o_7 */
	GNP_WEIGHTED_REACH = GNP_WEIGHTED_RIDGE + 1 + GNP_TAYLOR_DEGREE, /* log(rho) / 2 */
	GNP_WEIGHTED_SLOPE_SCALE,
	GNP_WEIGHTED_SLOPE_BIAS,
	GNP_WEIGHTED_SECOND_SCALE,
	GNP_WEIGHTED_SECOND_BIAS,
	GNP_WEIGHTED_CREASE,  /* logit: the centre is within a spacing of a crease, rim or tip */
	GNP_WEIGHTED_OUTLIER, /* logit: the centre is not of the surface about it */
	GNP_WEIGHTED_OUTPUTS
};

struct gnp_weighted_fit {
	bool solved;                              /* else coefficients are 0 */
	double coefficients[GNP_TAYLOR_STRIDE];   /* of heights in units of R */
	double share[GNP_SUPPORT_NODES];          /* s */
	double window[GNP_SUPPORT_NODES];         /* 1 / (1 + (d / rho)^4) */
	double weight[GNP_SUPPORT_NODES];         /* a */
	double total;                             /* sum of a */
	double misfit;                            /* weighted mean of squared residuals of points */
	double ridge[GNP_TAYLOR_DEGREE + 1];
	_Alignas(64) double factor[GNP_TAYLOR_SIZE * GNP_TAYLOR_STRIDE]; /* Cholesky's, of the normal equations */
};

/* outputs (GNP_WEIGHTED_OUTPUTS), logits (nodes). */
void gnp_weighted_solve(const struct gnp_support *support, const float *outputs, const float *logits,
                        struct gnp_weighted_fit *fit);

/* d loss / d outputs of ridges and reach (others are left alone) and d loss / d logits, from d loss / d coefficients
 * (GNP_TAYLOR_SIZE) and d loss / d share (nodes). */
void gnp_weighted_solve_backward(const struct gnp_support *support, const float *outputs,
                                 const struct gnp_weighted_fit *fit, const double *dcoefficients, const double *dshare,
                                 float *doutputs, float *dlogits);

/* Variances at the centre in units of R: of a slope, and of a component of the Hessian in an orthonormal basis of
 * symmetric matrices, a third of what its squared Frobenius norm varies by. */
struct gnp_weighted_variance {
	double slope, second;
};

/* V + B^2: under noise that is independent from point to point, and by the penalties. All of B^2 counts in every
 * direction, since it lies in one that is not known. */
struct gnp_weighted_variance gnp_weighted_error(const struct gnp_support *support, const struct gnp_weighted_fit *fit);

/* With what the network says. */
struct gnp_weighted_variance gnp_weighted_variance(const float *outputs, struct gnp_weighted_variance error);

#endif
