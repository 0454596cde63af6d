/* Sorts points along a space-filling curve (Hilbert curve, 21 bits an axis over the bounding cube; far outliers do not
 * widen it), so that neighbours in space are neighbours in memory. Deterministic: ties keep the caller's order. */
#ifndef GNP_CORE_ORDER_H
#define GNP_CORE_ORDER_H

#include <stddef.h>
#include <stdint.h>

#include "core/base/status.h"

/* order[i] = caller's index of the i-th point along the curve. points (count, 3), order (count), count < 2^31.
 * O(n), a radix sort; 32 bytes a point. */
gnp_status gnp_order_compute(const double *points, size_t count, uint32_t *order, struct gnp_error *error);

#endif
