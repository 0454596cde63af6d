/* The projection head: the coefficients of a patch as a learned, regularised L2 projection of its heights onto a
 * basis.
 *
 * The paper projects heights onto Legendre polynomials through a pooled feature (its operator Q). Here the projection itself is exact and the
 * network says how it is made: with heights y_i at the patch's nearest points, nested supports ("shells") S_1, S_2, ... and monomials phi of
 * degree at most 7 (taylor.h),
 *   c = argmin sum_l a_l sum_{i in S_l} (y_i - c . phi(u_i, v_i))^2 + sum_a lambda_|a| a1! a2! c_a^2.
 * Outputs o of the head: lambda_j = exp(4 o_j) for the orders j = 0..7, a_l = exp(-sum_{m <= l} softplus(2 o_{8+m})): the network chooses
 * the support (it fades outwards) and how smooth the surface is. The penalty is that of an isotropic random surface
 * (regression.h), so the answer turns with the patch. Its inputs: the mean of the trunk's values over nodes of the patch, that carry the
 * residual of a first fit, and a summary of first fits of each nested support. Everything is in units of the patch's in-plane radius, so
 * that scaling a cloud changes nothing. Compare weights and bases learned for local fits: Ben-Shabat & Gould 2020 (DeepFit).
 */
#ifndef GNP_CORE_PROJECTION_H
#define GNP_CORE_PROJECTION_H

#include <stdbool.h>

#include "core/base/scratch.h"
#include "core/cloud/patch.h"
#include "core/fit/taylor.h"
#include "core/network/architecture.h"

enum { GNP_PROJECTION_NODES = 48 };

/* The sums of one patch, each shell's alone. */
struct gnp_projection {
	unsigned shells;
	size_t count[GNP_SHELLS_MAX];   /* points */
	double square[GNP_SHELLS_MAX];  /* sum of y^2 */
	double moment[GNP_SHELLS_MAX][GNP_TAYLOR_STRIDE];
	_Alignas(64) double gram[GNP_SHELLS_MAX][GNP_TAYLOR_SIZE * GNP_TAYLOR_STRIDE]; /* upper triangles */
};

/* Room for the points of a patch. */
struct gnp_projection_work {
	double *u, *v, *y, *ones; /* (points) */
	double *rows;             /* (points, GNP_TAYLOR_STRIDE) */
};

/* Of the architecture's last shell. False when memory is exhausted. */
bool gnp_projection_work_take(const struct gnp_architecture *architecture, struct gnp_projection_work *work,
                              struct gnp_scratch *scratch);

/* Sums over the patch's points at the positions usable (count), ascending by distance; what is beyond the last shell is
 * left out. u, v, y of work hold those points' coordinates and heights in units of scale_xy. */
void gnp_projection_gather(const struct gnp_architecture *architecture, const struct gnp_patch *patch,
                           const uint32_t *usable, size_t count, struct gnp_projection_work *work,
                           struct gnp_projection *out);

/* summary (gnp_projection_summary): for every nested support the logarithms of the first fit's misfit and of its
 * coefficients' size by order; nodes (GNP_PROJECTION_NODES, features): u, v, y and residual of the middle support's
 * fit, u and v in units of the last shell's radius, at points spread over the shells. k: the neighbours that set the
 * patches. features >= 4 (further ones are 0), or 0 where no trunk sees the nodes. */
void gnp_projection_describe(const struct gnp_architecture *architecture, size_t k, const struct gnp_projection *sums,
                             const struct gnp_projection_work *work, float *summary, float *nodes);

/* The solution; coefficients are those of heights in units of scale_xy. */
struct gnp_projection_fit {
	double factor[GNP_TAYLOR_SIZE * GNP_TAYLOR_STRIDE]; /* Cholesky's, of the normal equations */
	double coefficients[GNP_TAYLOR_STRIDE];
	double share[GNP_SHELLS_MAX];           /* a */
	double ridge[GNP_TAYLOR_DEGREE + 1];    /* lambda */
	double misfit;                          /* what was minimised */
	double weight;                          /* sum of a over the points */
};

/* outputs (gnp_projection_outputs). False when the points do not determine a surface; then the coefficients are 0. */
bool gnp_projection_solve(const struct gnp_projection *sums, const float *outputs, struct gnp_projection_fit *fit);

/* Outputs to begin training with: penalties like those of the first fit of the last shell, whose area is `spread` times
 * that of the k neighbours' disk, and shells that fade outwards. */
void gnp_projection_begin(const struct gnp_architecture *architecture, double spread, float *outputs);

/* doutputs = d loss / d outputs from d loss / d coefficients (GNP_TAYLOR_SIZE). */
void gnp_projection_solve_backward(const struct gnp_projection *sums, const float *outputs,
                                   const struct gnp_projection_fit *fit, const double *dcoefficients, float *doutputs);

#endif
