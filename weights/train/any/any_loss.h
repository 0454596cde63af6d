/* The loss of the model for every cloud, and its derivatives: of the surface at a support's centre, of what the model
 * says about the centre and its nodes, of the errors it expects, and of the frame it chooses.
 *
 * With e the chord between the normals and E the squared error of the Hessian over its size, all at the centre:
 *   surface = sum_k w_k log sqrt(1 + (e / d_k)^2) + 3 e^2 + 0.1 log sqrt(E + 1e-8) + 0.15 log sqrt(E + 0.02),
 *   d = 1e-4, 4e-3, 6e-2, w = 0.08, 0.3, 0.4,
 * and half of the terms of e at one of the nearest 20 points, so that a surface can serve its neighbours;
 * so that a tenth less of an error counts about as much where errors are small as where they are large. A crease within
 * one spacing and an outlier are judged by cross entropy, nodes by how much weight strange ones have (any_truth.h), and
 * expected errors by the likelihood of those made. */
#ifndef GNP_WEIGHTS_ANY_LOSS_H
#define GNP_WEIGHTS_ANY_LOSS_H

#include "core/support/weighted_projection.h"
#include "weights/train/any/any_truth.h"

/* What a surface is off by at its centre. */
struct gnp_any_error {
	double angle;    /* between the normals [rad] */
	double hessian;  /* h_uu^2 + 2 h_uv^2 + h_vv^2 of the difference in units of R; where curved */
	double relative; /* square root of that over the Hessian's own size + 0.1; where curved */
};

/* coefficients, dcoefficients (GNP_TAYLOR_SIZE), of which those of degree 1 and 2 count. Returns the loss. */
double gnp_any_loss_surface(const struct gnp_any_truth *truth, const double *coefficients, double *dcoefficients,
                            struct gnp_any_error *made);

/* The terms of the normal at a node, of which `normal` is true (any_truth.h); dcoefficients (GNP_TAYLOR_SIZE) out. */
double gnp_any_loss_near(const struct gnp_support *support, size_t node, const double normal[3],
                         const double *coefficients,
                         double *dcoefficients);

/* Cross entropy of a logit, and its derivative. */
double gnp_any_loss_logit(float logit, bool is, double *dlogit);

/* Negative logarithm of the likelihood of a squared error, a sum over `dimensions` of variance
 * exp(4 scale) noise + exp(4 bias), but for a constant. Derivatives are by the two outputs; that by a scale beyond its
 * limits vanishes where it points outwards. */
double gnp_any_loss_errors(double squared, int dimensions, double noise, float scale, float bias, double *dscale,
                           double *dbias);

/* Means over supports, each by its factor in the loss but errors, whose factor is not in the sum that is reported. */
struct gnp_any_terms {
	double surface, crease, outlier, nodes, errors;
	double angle;  /* mean square of judged supports' angles [rad^2]; a sum until the caller divides by judged */
	double judged; /* supports that are no outliers */
};

/* The loss of one support, whose fit and outputs (GNP_WEIGHTED_OUTPUTS) are given, times share; adds to terms and sets
 * dcoefficients (GNP_TAYLOR_SIZE), dshares (nodes) and doutputs. strange (nodes): room. */
void gnp_any_loss_support(const struct gnp_any_cloud *cloud, const struct gnp_support *support,
                          const struct gnp_weighted_fit *fit, const float *outputs, double share, double *strange,
                          struct gnp_any_terms *terms, double *dcoefficients, double *dshares, float *doutputs);
double gnp_any_loss_total(const struct gnp_any_terms *terms);

/* What it costs to fit in a frame whose third axis and the true normal have this cosine. */
double gnp_any_loss_frame(double cosine);

#endif
