/* Chooses points that are far apart, by farthest-point choice (Gonzalez 1985): each point chosen is the one farthest
 * from those chosen before it. */
#ifndef GNP_CORE_FARTHEST_H
#define GNP_CORE_FARTHEST_H

#include <stddef.h>

#include "core/base/status.h"
#include "core/base/task.h"

/* points (count, 3), fastest in curve order. excluded (count): 1 for points never chosen; NULL: none. Sets
 * chosen[i] (count) to 1 for `wanted` points, fewer where fewer places are left, and to 0 for all others; the
 * first is the one farthest from the mean. Exact; ties go to the lowest index. O(n log wanted) on surfaces; 26
 * bytes a point. task may be NULL. */
gnp_status gnp_farthest_choose(const double *points, size_t count, const unsigned char *excluded, size_t wanted,
                               struct gnp_task *task, unsigned char *chosen, struct gnp_error *error);

#endif
