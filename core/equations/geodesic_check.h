/* Whether distances can be believed: none is shorter than the straight line to the nearest source, or longer than a way
 * from point to point. Records a warning with the value found and its limit (warning.h). */
#ifndef GNP_CORE_GEODESIC_CHECK_H
#define GNP_CORE_GEODESIC_CHECK_H

#include "core/cells/diffusion.h"
#include "core/cloud/prepare.h"

/* volumes: whose edges lead from point to point. source (points): 0 or 1, some are; distance (points), INFINITY where
 * there is none. In curve order. task may be NULL: then nothing is done. Deterministic for any worker count. */
gnp_status gnp_geodesic_check(const struct gnp_prepared *prepared, const struct gnp_stiffness *volumes,
                              const unsigned char *source, const double *distance, struct gnp_pool *pool,
                              struct gnp_task *task, struct gnp_error *error);

#endif
