/* Exact nearest-neighbour and radius search (the one FLANN user).
 *
 * The index keeps its own reference to the points, which must stay unchanged and alive while it lives.
 * Searches are safe from many threads at once. Distances are Euclidean (not squared). */
#ifndef GNP_CORE_NEIGHBORS_H
#define GNP_CORE_NEIGHBORS_H

#include <stddef.h>
#include <stdint.h>

#include "core/base/scratch.h"
#include "core/base/status.h"

struct gnp_neighbors;

/* points (count, 3), 1 <= count < 2^31. Build it over points in curve order (order.h): it is faster then.
 * GNP_DEGENERATE for a coordinate that is not finite or over GNP_COORDINATE_MAX. */
gnp_status gnp_neighbors_build(const double *points, size_t count, struct gnp_neighbors **out,
                               struct gnp_error *error);
void gnp_neighbors_free(struct gnp_neighbors *neighbors);

/* The k nearest of each of `queries` points (queries, 3), the query itself included when it is a point of the
 * index. index, distance (queries, k), each row ascending by (distance, index). 1 <= k <= count.
 * Ties at the k-th distance may fall either way, the same way every time. GNP_DEGENERATE for a query that is not finite. */
gnp_status gnp_neighbors_knn(const struct gnp_neighbors *neighbors, const double *points, size_t queries, size_t k,
                             uint32_t *index, double *distance, struct gnp_scratch *scratch,
                             struct gnp_error *error);

/* For each centre (an indexed point): every point within ratio * (distance to the k-th nearest neighbour, the centre itself
 * counted), the fast path of patch building; fastest where consecutive centres are close together.
 * Row r holds entries [start[r], start[r+1]) of index and distance, ascending by (distance, index); its first entry
 * is the centre itself or one that coincides with it. r_k is returned too. All arrays live in scratch. */
struct gnp_neighborhoods {
	size_t count;       /* centres */
	size_t *start;      /* (count + 1) */
	uint32_t *index;    /* (start[count]) */
	double *distance;   /* (start[count]) */
	double *r_k;        /* (count) distance to the k-th nearest */
};
/* At most `most` entries a row are kept (the nearest ones); the limit guards against heavy duplication and far
 * outliers whose ball would hold the whole cloud. */
gnp_status gnp_neighborhoods_find(const struct gnp_neighbors *neighbors, const uint32_t *centres, size_t count,
                                  size_t k, double ratio, size_t most, struct gnp_scratch *scratch,
                                  struct gnp_neighborhoods *out, struct gnp_error *error);

#endif
