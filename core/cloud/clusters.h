/* Cuts an oriented surface into clusters of points whose normals belong together, and says how surely those that touch
 * belong together too. What may be inside out is a set of such clusters (settle.h). */
#ifndef GNP_CORE_CLUSTERS_H
#define GNP_CORE_CLUSTERS_H

#include <stddef.h>
#include <stdint.h>

#include "core/base/forest.h"
#include "core/base/status.h"
#include "core/cloud/orient_graph.h"

/* The surfaces of a cloud: those of members[ends[l - 1]] .. members[ends[l] - 1] (from 0 for the first) have label l.
 * Borrowed. */
struct gnp_surfaces {
	const uint32_t *label;   /* (n) */
	const uint32_t *members; /* (n) points by label */
	const size_t *ends;      /* (count) */
	size_t count;
};

/* Owned, but for graph and surfaces. The second group is that of one surface. */
struct gnp_clusters {
	const struct gnp_orient_graph *graph;
	const struct gnp_surfaces *surfaces;
	struct gnp_forest forest; /* its sets are the clusters of all surfaces */
	uint32_t *number;         /* (n) of a point's cluster within its surface, where that was made */

	size_t count;
	uint32_t *members;  /* (points of the surface) by cluster */
	size_t *start;      /* (count + 1) */
	size_t *link_start; /* (count + 1) links of a cluster; each is listed at both its ends */
	uint32_t *link_to;
	double *link_trust; /* over that of all edges of the surface; negative: the two should differ in sign */
};

/* Clusters of all surfaces: joined along edges, the most trusted first, up to a size of which gnp_clusters_most
 * follows. The graph's edges are sorted, its normals carry the signs of its forest. O(edges), 12 bytes a point.
 * GNP_OUT_OF_MEMORY, or the task's reason to stop; to be cleared also then. */
gnp_status gnp_clusters_init(struct gnp_clusters *clusters, const struct gnp_orient_graph *graph,
                             const struct gnp_surfaces *surfaces, struct gnp_error *error);

/* The clusters of one surface and their links; those of the surface before are gone. Edges through places that are
 * flat for many points about are worth many others: no sheet ends there. O(points). */
gnp_status gnp_clusters_make(struct gnp_clusters *clusters, size_t surface, struct gnp_error *error);

void gnp_clusters_clear(struct gnp_clusters *clusters);

/* No surface of so many points has more clusters than this. */
size_t gnp_clusters_most(size_t points);

#endif
