/* Heat on a cloud: u_t = Delta u by implicit Euler steps, (1 / dt - Delta) u' = u / dt, which are stable for any dt. */
#ifndef GNP_CORE_HEAT_H
#define GNP_CORE_HEAT_H

#include "core/equations/poisson.h"

/* A Poisson object whose screening is 1 / dt; all steps use its factor. dt > 0 [length^2]. As gnp_poisson_prepare. */
gnp_status gnp_heat_prepare(const struct gnp_cloud *cloud, const struct gnp_poisson_options *options, double dt,
                            struct gnp_pool *pool, struct gnp_task *task, struct gnp_poisson **out,
                            struct gnp_error *error);

/* steps of dt from u (n, count), in place. source (n, count): heat added in unit time, NULL for none. values as in
 * gnp_poisson_solve. On failure u is undefined: GNP_NO_CONVERGENCE where it grows beyond all numbers. The task is
 * warned of heat that is not to be believed (heat_check.h), unless values are given. */
gnp_status gnp_heat_step(const struct gnp_poisson *poisson, double dt, size_t steps, const double *source,
                         const double *values, size_t count, struct gnp_pool *pool, struct gnp_task *task, double *u,
                         struct gnp_error *error);

#endif
