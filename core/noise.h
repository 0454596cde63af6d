/* How noisy a cloud is. */
#ifndef GNP_CORE_NOISE_H
#define GNP_CORE_NOISE_H

#include "estimator.h"

/* The standard deviation of the points' distances to the surface, in units of epsilon (1.1 times the distance to the 50th neighbour):
 * the median over patches all over the cloud of what polynomials of degree 7 leave unexplained of their 48 nearest points that are no outliers
 * (outlier (count): 0 or 1), degrees of freedom taken off. Deterministic. */
gnp_status gnp_noise_measure(const struct gnp_fit_cloud *cloud, const unsigned char *outlier, struct gnp_pool *pool,
                             struct gnp_task *task, double *noise, struct gnp_error *error);

#endif
