/* Measures the area that each point of a cloud stands for: its part of the triangles about it (star.h). */
#ifndef GNP_CORE_AREA_H
#define GNP_CORE_AREA_H

#include "core/base/pool.h"
#include "core/cloud/prepare.h"

/* area (count) out, in the prepared cloud's curve order, > 0. Points whose
 * triangles do not close around them are counted in *open (may be NULL). task may be NULL. Deterministic for any worker count. */
gnp_status gnp_area_measure(const struct gnp_prepared *prepared, struct gnp_pool *pool, struct gnp_task *task, double *area, size_t *open,
                            struct gnp_error *error);

#endif
