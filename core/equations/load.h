/* What drives an equation besides a right-hand side f at every point: flux through open edges (Neumann data), and
 * amounts at single points. Both are added to f, so that they can be used with any equation that has one. */
#ifndef GNP_CORE_LOAD_H
#define GNP_CORE_LOAD_H

#include "core/equations/poisson.h"

/* flux (n, count): the derivative of u along the outward normal of the open edge, in the surface; read at points of open
 * edges alone. source (n, count): changed in place. rim: the edges' length out, may be NULL. GNP_INVALID_ARGUMENT where
 * the operator is not the symmetric one, where the surface has no open edge, and for numbers that are not finite. task
 * may be NULL. */
gnp_status gnp_load_flux(const struct gnp_poisson *poisson, const double *flux, size_t count, struct gnp_pool *pool,
                         struct gnp_task *task, double *source, double *rim, struct gnp_error *error);

/* strength (points, count): what f has in all at each of these points, as a Dirac measure. source as above; what a point
 * gets is its strength over its area. GNP_INVALID_ARGUMENT for an index that the cloud does not have or the filter
 * dropped. */
gnp_status gnp_load_points(const struct gnp_poisson *poisson, const uint32_t *index, const double *strength,
                           size_t points, size_t count, double *source, struct gnp_error *error);

#endif
