/* Measures how fast this machine multiplies matrices right now: the yardstick of everything that is made of such
 * products. */
#ifndef GNP_WEIGHTS_SGEMM_RATE_H
#define GNP_WEIGHTS_SGEMM_RATE_H

#include "core/base/pool.h"
#include "core/base/status.h"

/* Floating-point operations a second of all workers at once, each multiplying 512 x 512 matrices for one or two tenths of a second. */
gnp_status gnp_sgemm_rate(struct gnp_pool *pool, double *rate, struct gnp_error *error);

#endif
