/* Estimates how ill-conditioned the square system of a cloud is. */
#ifndef GNP_WEIGHTS_PDE_CONDITION_H
#define GNP_WEIGHTS_PDE_CONDITION_H

#include "core/equations/poisson.h"

/* The largest |eigenvalue| of the Laplacian, by 60 steps of power iteration (a few percent low at most), over the smallest that is not zero,
 * by spectrum.h. The cloud is connected. */
gnp_status gnp_pde_condition(const struct gnp_cloud *cloud, const struct gnp_poisson_options *options,
                             struct gnp_pool *pool, struct gnp_task *task, double *condition, struct gnp_error *error);

#endif
