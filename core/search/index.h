/* What neighbors.h asks of a search tree: the one place where the library that answers can be changed.
 *
 * A kind is a table of functions over an index of its own making. index_flann.c is the one that serves; tests put
 * a plain one beside it and demand the same rows (gnp_neighbors_build_on). Searches are exact and safe from many
 * threads at once. Their order is free, ties at the end of an answer too, and neighbors.c computes all distances
 * anew. */
#ifndef GNP_CORE_INDEX_H
#define GNP_CORE_INDEX_H

#include <stddef.h>

#include "core/base/status.h"

struct gnp_index; /* each kind has one of its own */

struct gnp_index_kind {
	/* points (count, 3), 1 <= count < 2^31, finite; borrowed, and unchanged while the index lives.
	 * GNP_OUT_OF_MEMORY. */
	gnp_status (*build)(const double *points, size_t count, struct gnp_index **out, struct gnp_error *error);

	/* found, square (queries, k): the k nearest of each query of points (queries, 3), 1 <= k <= count. Points as
	 * far as the k-th nearest may be any of those. square is spare memory. GNP_OUT_OF_MEMORY. */
	gnp_status (*nearest)(const struct gnp_index *index, const double *points, size_t queries, size_t k, int *found,
	                      double *square, struct gnp_error *error);

	/* Whether there is memory for searches by `within` that keep at most `most` points: asked once before many of
	 * them. */
	gnp_status (*prepare)(const struct gnp_index *index, size_t most, struct gnp_error *error);

	/* found, square (most): all points within radius of centre (3), and perhaps some that are farther by a
	 * millionth of it; where those are more than `most`, the nearest of them. Returns how many. square is spare
	 * memory. */
	size_t (*within)(const struct gnp_index *index, const double *centre, double radius, size_t most, int *found,
	                 double *square);

	/* Memory it takes beside the points, at most, but for a few kilobytes. */
	size_t (*bytes)(const struct gnp_index *index);

	void (*free)(struct gnp_index *index); /* accepts NULL */
};

/* A k-d tree of FLANN's. Building takes O(n log n), a search O(log n + points found). */
extern const struct gnp_index_kind gnp_index_flann;

#endif
