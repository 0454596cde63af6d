/* Thins a cloud to a least distance (Poisson disks), in a fixed order: of points closer together than a distance,
 * those that come first stay. */
#ifndef GNP_CORE_THIN_H
#define GNP_CORE_THIN_H

#include <stddef.h>
#include <stdint.h>

#include "core/base/status.h"
#include "core/base/task.h"

/* points (count, 3), count < 2^31; distance > 0. Visits the points order[0] .. order[count - 1] (a permutation;
 * NULL: ascending) and keeps each that is at least `distance` from all kept before it. The first `certain` visited
 * are kept whatever their distance. keep (count) out: 1 or 0; their number in *kept. On failure keep is undefined.
 * task may be NULL; polled. O(n) where few points lie closer than the distance; 15 bytes a point. */
gnp_status gnp_thin(const double *points, size_t count, double distance, const uint32_t *order, size_t certain,
                    struct gnp_task *task, unsigned char *keep, size_t *kept, struct gnp_error *error);

#endif
