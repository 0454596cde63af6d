/* Finds the points of a cloud that coincide exactly. */
#ifndef GNP_CORE_DISTINCT_H
#define GNP_CORE_DISTINCT_H

#include <stddef.h>
#include <stdint.h>

#include "core/base/status.h"
#include "core/base/task.h"

/* points (count, 3), count < 2^31. which[i]: the number, in order of first appearance, of the place point i lies at
 * (count); first[place]: the lowest index there (count entries provided, *places used).
 * O(n) on average, by hashing; between 8 and 16 bytes a point. */
gnp_status gnp_distinct_find(const double *points, size_t count, struct gnp_task *task, uint32_t *which,
                             uint32_t *first, size_t *places, struct gnp_error *error);

#endif
