/* Finds, for many points of a cloud at once, all points within a multiple of the distance to the k-th nearest: the
 * fast path of patch building, fastest where consecutive centres are close together (order.h).
 *
 * O(entries found) a centre; memory 12 bytes an entry and 16 a centre, in scratch. */
#ifndef GNP_CORE_NEIGHBORHOODS_H
#define GNP_CORE_NEIGHBORHOODS_H

#include "core/search/neighbors.h"

/* Row r holds entries [start[r], start[r+1]) of index and distance, ascending by (distance, index); its first
 * entry is the centre itself or one that coincides with it. All arrays live in scratch. */
struct gnp_neighborhoods {
	size_t count;       /* centres */
	size_t *start;      /* (count + 1) */
	uint32_t *index;    /* (start[count]) */
	double *distance;   /* (start[count]) */
	double *r_k;        /* (count) distance to the k-th nearest */
};

/* For each centre (an indexed point): every point within ratio * (distance to the k-th nearest neighbour, the
 * centre itself counted). At most `most` entries a row are kept (the nearest ones); the limit guards against heavy
 * duplication and far outliers whose ball would hold the whole cloud. GNP_OUT_OF_MEMORY; on failure *out is
 * undefined. */
gnp_status gnp_neighborhoods_find(const struct gnp_neighbors *neighbors, const uint32_t *centres, size_t count,
                                  size_t k, double ratio, size_t most, struct gnp_scratch *scratch,
                                  struct gnp_neighborhoods *out, struct gnp_error *error);

#endif
