/* The open edges of a surface: how much of their length each point stands for. */
#ifndef GNP_CORE_RIM_H
#define GNP_CORE_RIM_H

#include "core/base/pool.h"
#include "core/cloud/prepare.h"

/* length (prepared->count) out [length]: 0 at points that are at no open edge (star.h). Their sum is the edges' length
 * where points lie on them, and within a tenth of it in random samples. Deterministic for any worker count. task may be
 * NULL. */
gnp_status gnp_rim_measure(const struct gnp_prepared *prepared, struct gnp_pool *pool, struct gnp_task *task,
                           double *length, struct gnp_error *error);

#endif
