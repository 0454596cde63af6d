/* Finds the nearest points of a cloud, and those within a distance, exactly.
 *
 * The points are the caller's: they must stay unchanged and alive while the index lives. Searches are safe from many
 * threads at once. Distances are Euclidean (not squared). Building takes O(n log n) and 64 bytes a point, of which 48
 * stay; a search O(log n + points found). The tree itself is index.h's. */
#ifndef GNP_CORE_NEIGHBORS_H
#define GNP_CORE_NEIGHBORS_H

#include <stddef.h>
#include <stdint.h>

#include "core/base/scratch.h"
#include "core/base/status.h"
#include "core/search/index.h"

struct gnp_neighbors;

/* points (count, 3), 1 <= count < 2^31. Build it over points in curve order (order.h): it is faster then.
 * GNP_DEGENERATE for a coordinate that is not finite or over GNP_COORDINATE_MAX. */
gnp_status gnp_neighbors_build(const double *points, size_t count, struct gnp_neighbors **out, struct gnp_error *error);

/* The same on a search tree of the caller's choice, which must outlive it. */
gnp_status gnp_neighbors_build_on(const struct gnp_index_kind *kind, const double *points, size_t count,
                                  struct gnp_neighbors **out, struct gnp_error *error);
void gnp_neighbors_free(struct gnp_neighbors *neighbors);

const double *gnp_neighbors_points(const struct gnp_neighbors *neighbors); /* (count, 3) */
size_t gnp_neighbors_count(const struct gnp_neighbors *neighbors);
size_t gnp_neighbors_bytes(const struct gnp_neighbors *neighbors); /* memory beside the points, at most */

/* The k nearest of each of `queries` points (queries, 3), the query itself included when it is a point of the index.
 * index, distance (queries, k), each row ascending by (distance, index). 1 <= k <= count. Ties at the k-th distance may
 * fall either way, the same way every time. GNP_DEGENERATE for a query that is not finite. */
gnp_status gnp_neighbors_knn(const struct gnp_neighbors *neighbors, const double *points, size_t queries, size_t k,
                             uint32_t *index, double *distance, struct gnp_scratch *scratch, struct gnp_error *error);

/* Searches within a radius, for neighborhoods.c. Before some of them: whether there is memory for those that keep
 * at most `most` points. */
gnp_status gnp_neighbors_prepare(const struct gnp_neighbors *neighbors, size_t most, struct gnp_error *error);

/* The points within radius of a place (3), or the nearest `most` of them. index, distance (most): ascending by
 * (distance, index). *count: how many. */
gnp_status gnp_neighbors_within(const struct gnp_neighbors *neighbors, const double *place, double radius, size_t most,
                                uint32_t *index, double *distance, size_t *count, struct gnp_scratch *scratch,
                                struct gnp_error *error);

/* The same, as the search tree has them: in its order and perhaps with some that are a millionth farther: found,
 * and spare memory in square, (most) each. Returns how many. */
size_t gnp_neighbors_candidates(const struct gnp_neighbors *neighbors, const double *place, double radius, size_t most,
                                int *found, double *square);

/* Sorts a row ascending by (distance, index); for short ones. */
void gnp_neighbors_sort(double *distance, uint32_t *index, size_t count);

#endif
