/* Nested dissection of a sparse matrix whose unknowns sit at points in space (George 1973): an elimination order
 * with little fill.
 *
 * A set of points is halved at the median along the axis that cuts fewest of its points from the other half; the
 * points on one side of the cut that touch the other are its separator and come last, after both halves, ordered
 * the same way. On surfaces that is as good as a graph partitioner at a fraction of its time, can be cancelled,
 * and holds no state of its own. */
#ifndef GNP_CORE_DISSECTION_H
#define GNP_CORE_DISSECTION_H

#include "core/linear/csr.h"

/* pattern (n, n): symmetric in structure, values not read. points (n, 3). order (n) out: the k-th unknown to
 * eliminate. Deterministic for any worker count. task may be NULL.
 * O((n + entries) log n); 1 byte an unknown, and 20 in the workers' scratch. */
gnp_status gnp_dissection_order(const struct gnp_csr *pattern, const double *points, struct gnp_pool *pool,
                                struct gnp_task *task, uint32_t *order, struct gnp_error *error);

#endif
