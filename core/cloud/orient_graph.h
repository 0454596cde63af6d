/* The Riemannian graph of a cloud: every point with its nearest neighbours, a plane's normal at each, and how far
 * each edge is to be trusted to carry an orientation from one end to the other. What orient.c grows its forest on.
 *
 * O(n log n). With k neighbours a point 6 k + 9 bytes a point, and 8 bytes an edge when they are sorted, of which
 * there are between k / 2 and k a point. */
#ifndef GNP_CORE_ORIENT_GRAPH_H
#define GNP_CORE_ORIENT_GRAPH_H

#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

#include "core/base/pool.h"
#include "core/base/status.h"
#include "core/base/task.h"
#include "core/search/neighbors.h"

struct gnp_orient_edge {
	uint32_t from, to; /* to << 1 | opposite */
};

/* The first group is the caller's and borrowed; the rest is filled in, and owned unless it says otherwise. */
struct gnp_orient_graph {
	const double *points; /* (count, 3) in curve order */
	size_t count, k;      /* k: neighbours of a point, itself not counted; count > k >= 1 */
	const struct gnp_neighbors *neighbors; /* over the points */
	struct gnp_pool *pool;
	struct gnp_task *task;
	double *normals;      /* (count, 3) out, unit, of no particular side */
	bool stop_if_crowded; /* leave it at the planes where many points coincide */

	atomic_bool crowded;  /* some neighbourhood is mostly points that coincide */
	uint32_t *index;      /* (count, k) */
	uint16_t *key;        /* (count, k) level << 1 | opposite; NULL once edges are sorted */
	double *radius;       /* (count) distance to the k-th neighbour; the root of a relative area */
	unsigned char *thickness; /* (count) of a neighbourhood over its width, the smaller one: 255 as thick as wide */
	struct gnp_orient_edge *edges; /* (edge_count) the most trusted first */
	size_t edge_count;
	size_t sound_count;   /* edges before this one are sound; from it on the normals or the edge tell two stories */
	size_t short_count;   /* from this one on they are longer than the spacing of their ends */
};

/* Neighbours, planes and the edges' keys. Adds 2 * count items to the task's progress, count where it stops.
 * *graph is to be cleared also on failure. */
gnp_status gnp_orient_graph_make(struct gnp_orient_graph *graph, struct gnp_error *error);

/* Makes the edges of the keys, which are freed. */
gnp_status gnp_orient_graph_sort(struct gnp_orient_graph *graph, struct gnp_error *error);

/* How far the edge between two points is to be trusted to say whether their normals, as they are now, look to the same
 * side: 1 surely, -1 surely not, 0 where the edge is not sound. */
double gnp_orient_graph_trust(const struct gnp_orient_graph *graph, size_t i, size_t j);

void gnp_orient_graph_clear(struct gnp_orient_graph *graph);

#endif
