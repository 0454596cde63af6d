/* Makes Poisson problems with known solutions on analytic clouds: u = U restricted to the surface, U a random Fourier
 * series in space, for which Delta u = lap U - n^T Hess(U) n + 2 H (n . grad U) with the signs of shapes.h. */
#ifndef GNP_WEIGHTS_PDE_TRUTH_H
#define GNP_WEIGHTS_PDE_TRUTH_H

#include "core/shapes/shapes.h"

enum { GNP_PDE_MODES = 10, GNP_PDE_SOLUTIONS_MAX = 16 };

/* u and f = -Delta u at the exact feet of the sample's points, a column each of `count` solutions (at most GNP_PDE_SOLUTIONS_MAX): value,
 * source (points, count) out. U is the Fourier series of period 2 with all modes m in {-10..10}^3 but 0 (the paper's), coefficients
 * N(0, 1) / |m|^2 of cosine and sine, so that f has the flat spectrum the paper draws f with, for a solution known in closed form.
 * Deterministic in seed for any worker count. */
gnp_status gnp_pde_truth(const struct gnp_sample *sample, uint64_t seed, size_t count, struct gnp_pool *pool,
                         struct gnp_task *task, double *value, double *source, struct gnp_error *error);

#endif
