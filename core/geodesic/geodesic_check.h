/* Holds distances against the straight line to the nearest source: none may be shorter. */
#ifndef GNP_CORE_GEODESIC_CHECK_H
#define GNP_CORE_GEODESIC_CHECK_H

#include "core/base/task.h"
#include "core/cloud/prepare.h"

/* Lengthens what of distance (points, INFINITY where there is none) is shorter than the line to the nearest of the
 * sources (count, at least one). Where that was more than a few hundredths on average the task is warned, with the
 * value found and its limit (warning.h). In curve order. task may be NULL. Deterministic for any worker count. */
gnp_status gnp_geodesic_check(const struct gnp_prepared *prepared, const uint32_t *sources, size_t count,
                              struct gnp_pool *pool, struct gnp_task *task, double *distance, struct gnp_error *error);

#endif
