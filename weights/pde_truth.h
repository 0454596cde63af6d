/* Poisson problems with known solutions on analytic clouds: u = U restricted to the surface, U a random Fourier sum in space, for which
 * Delta u = lap U - n^T Hess(U) n + 2 H (n . grad U) with the signs of shapes.h. */
#ifndef GNP_WEIGHTS_PDE_TRUTH_H
#define GNP_WEIGHTS_PDE_TRUTH_H

#include "shapes.h"

enum { GNP_PDE_WAVES = 100, GNP_PDE_MODES = 10 };

/* u and f = -Delta u at the exact feet of the sample's points, a column each of `count` solutions: value, source (points, count) out. U is
 * of 100 waves sin(pi k . x + p), k drawn from the integers of -10..10 in each direction (the paper's modes, period 2), with amplitudes
 * N(0, 1) / |k|^2, so that f has the flat spectrum the paper draws f with. Deterministic in seed for any worker count. */
gnp_status gnp_pde_truth(const struct gnp_sample *sample, uint64_t seed, size_t count, struct gnp_pool *pool, struct gnp_task *task,
                         double *value, double *source, struct gnp_error *error);

#endif
