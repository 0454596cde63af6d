/* Bayesian polynomial regression of heights: the local fit behind the adaptive estimator.
 *
 * Heights y_i = sum_a c_a u_i^a1 v_i^a2 + noise, noise ~ N(0, sigma^2), Taylor coefficients of order j >= 3 with the
 * prior of a Gaussian process of amplitude tau sigma and length `length`: c_a ~ N(0, sigma^2 tau^2 rho^(2j) / (a1!
 * a2!)) in coordinates divided by the radius R, rho = R / length (the expansion of its squared-exponential
 * covariance). Height, slopes and Hessian are unconstrained: shrinking what is to be measured would make its error
 * look small. The evidence, sigma profiled out, says how well a (length, tau) explains the data; see Rasmussen &
 * Williams 2006, chapters 2 and 5. The prior plays the part of the degree: terms the data cannot carry shrink to zero.
 */
#ifndef GNP_CORE_REGRESSION_H
#define GNP_CORE_REGRESSION_H

#include <stdbool.h>
#include <stddef.h>

#include "core/fit/taylor.h"

struct gnp_prior {
	double rho; /* radius / length */
	double tau; /* amplitude / noise */
};

/* The data's moments, everything that is needed of them: filled once, asked for many priors. */
struct gnp_regression {
	size_t count;
	double *rows;   /* (count, GNP_TAYLOR_STRIDE) */
	double *gram;   /* (GNP_TAYLOR_SIZE, GNP_TAYLOR_STRIDE) upper */
	double *moment; /* (GNP_TAYLOR_STRIDE) */
	double square;  /* sum of y^2 */
};

/* ones (count): all 1. The arrays of regression are the caller's, filled here. u, v in units of the radius. */
void gnp_regression_fill(struct gnp_regression *regression, const double *u, const double *v, const double *y,
                         const double *ones, size_t count);

/* Adds points whose coordinates and heights are in units of some outer radius, and restates sums so gathered in units of
 * share * that radius: supports nested in each other share their sums. The rows of the last points added stay in rows. */
void gnp_regression_clear(struct gnp_regression *regression);
void gnp_regression_add(struct gnp_regression *regression, const double *u, const double *v, const double *y,
                        const double *ones, size_t count);
void gnp_regression_rescale(const struct gnp_regression *regression, double share, struct gnp_regression *inner);

/* What a prior makes of the data. */
struct gnp_posterior {
	double evidence;   /* log marginal likelihood up to a constant of the data */
	double variance;   /* sigma^2, the noise variance profiled out */
	double *factor;    /* (GNP_TAYLOR_SIZE, GNP_TAYLOR_STRIDE) Cholesky factor of the posterior precision times sigma^2 */
	double *mean;      /* (GNP_TAYLOR_STRIDE) coefficients, of u^a v^b in units of the radius */
};

/* factor and mean are the caller's storage. False when the data do not carry even the prior's shape. The mean is only
 * filled by gnp_regression_mean. */
bool gnp_regression_condition(const struct gnp_regression *regression, struct gnp_prior prior, struct gnp_posterior *posterior);
void gnp_regression_mean(struct gnp_posterior *posterior);

/* Moves the prior's mean, and the posterior's with it, from the paraboloid to what is as round: where curvatures do not
 * change, a height of second order q = (k1 u^2 + k2 v^2) / 2 has the fourth order H q^2 / 2 (a sphere's), and a prior
 * about 0 would take that out of q, the same way at every point. By the mean's own second order; fades where the
 * surface turns over within the radius. posterior: of this prior, with its mean. */
void gnp_regression_round(struct gnp_prior prior, struct gnp_posterior *posterior);

/* Covariance of jets / variance: for rows (6, GNP_TAYLOR_STRIDE) of gnp_taylor_jets, covariance (6, 6) of their values. */
void gnp_regression_covariance(const double *factor, const double *rows, double covariance[36]);

/* Variance of one coefficient / variance. */
double gnp_regression_variance(const double *factor, size_t coefficient);

#endif
