/* How noisy a cloud is. */
#ifndef GNP_CORE_NOISE_H
#define GNP_CORE_NOISE_H

#include "core/estimate/estimator.h"

/* The standard deviation of the points' distances to the surface, in units of epsilon (1.1 times the distance to the
 * 50th neighbour): what polynomials of degree 7 leave unexplained of the 48 and of the 72 nearest points that are no
 * outliers, degrees of freedom taken off, as medians over patches all over the cloud. What grows with the support is
 * curvature that the degree does not reach, as in sparse clouds, and is taken off: noise is the same on both. 0 for
 * clouds too small to tell. outlier (count): 0 or 1. Deterministic. */
gnp_status gnp_noise_measure(const struct gnp_fit_cloud *cloud, const unsigned char *outlier, struct gnp_pool *pool,
                             struct gnp_task *task, double *noise, struct gnp_error *error);

#endif
