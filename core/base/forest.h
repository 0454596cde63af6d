/* A forest of points whose signs are known relative to each other: disjoint sets that also remember, for each member,
 * whether it is flipped against the set's root. Joining sets in the order of ascending edge weight (Kruskal 1956)
 * propagates signs along the minimum spanning tree without ever storing the tree. */
#ifndef GNP_CORE_FOREST_H
#define GNP_CORE_FOREST_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct gnp_forest {
	size_t count;
	uint32_t *parent; /* (count) parent << 1 | flipped against the parent; a root is its own, not flipped */
	uint32_t *size;   /* (count) members of the set; at roots only */
};

/* count sets of one point, count < 2^31. false when memory is exhausted. Cleared by gnp_forest_clear, also on
 * failure. */
bool gnp_forest_init(struct gnp_forest *forest, size_t count);
void gnp_forest_clear(struct gnp_forest *forest);

/* Finding and joining among n points takes O(log n) at worst and hardly more than O(1) on average; 8 bytes a point. */

/* The root of point's set; *flipped: whether point's sign is opposite to the root's. */
uint32_t gnp_forest_find(struct gnp_forest *forest, uint32_t point, bool *flipped);

/* Makes one set of those of a and b, whose signs differ when opposite. Within one set already: false, nothing changes.
 * Sets of more than `most` points each stay apart (false as well); SIZE_MAX joins any. */
bool gnp_forest_join(struct gnp_forest *forest, uint32_t a, uint32_t b, bool opposite, size_t most);

#endif
