/* Mends orientations that edges carried wrongly: where a thin wall or a touching limb led a sign astray, whole parts
 * of a closed surface are inside out, and the winding number at its points is far from 1/2. Clusters of points then
 * get the signs that bring it there (as Xu et al. 2023, "Globally consistent normal orientation for point clouds by
 * regularizing the winding-number field", do for single points), and cut the surface where its edges say least. */
#ifndef GNP_CORE_SETTLE_H
#define GNP_CORE_SETTLE_H

#include <stddef.h>

#include "core/base/status.h"
#include "core/cloud/clusters.h"
#include "core/cloud/orient_graph.h"

/* Of a graph whose edges are sorted and whose normals carry the signs of its forest. Each surface is settled by
 * itself, as if there were no other. Its normals change only where that brings the winding number close to 1/2 and
 * much closer than it was: open ones stay as they are. A closed one that stays far from it is warned of. O(n) where it
 * is near as it is; else about as long as making the graph, and gnp_settle_memory(n) bytes and 70 a point of the
 * surface. Deterministic. GNP_OUT_OF_MEMORY, or the task's reason to stop; normals are undefined then. */
gnp_status gnp_settle(struct gnp_orient_graph *graph, const struct gnp_surfaces *surfaces, struct gnp_error *error);

/* What settling a surface of a cloud of count points takes beyond so many bytes a point. */
size_t gnp_settle_memory(size_t count);

#endif
