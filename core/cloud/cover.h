/* Decides which patch serves which point, so that fewer patches than points need to be fitted. */
#ifndef GNP_CORE_COVER_H
#define GNP_CORE_COVER_H

#include <stddef.h>
#include <stdint.h>

#include "core/base/pool.h"
#include "core/search/neighbors.h"

/* Patch p has centre[p] and serves member[start[p]] .. member[start[p + 1] - 1]; every point is served exactly once.
 * Indices are positions in the index's order. Freed by gnp_cover_clear. */
struct gnp_cover {
	size_t count;
	uint32_t *centre; /* (count) */
	size_t *start;    /* (count + 1) */
	uint32_t *member; /* (points) */
};

/* One patch a point, serving itself. */
gnp_status gnp_cover_all(size_t points, struct gnp_cover *out, struct gnp_error *error);

/* How many points a patch round a centre may serve. */
struct gnp_cover_rule {
	size_t fixed; /* >= 1: the same everywhere, unless: */
	size_t (*served)(const void *context, uint32_t centre); /* 1..fixed */
	const void *context;
	const double *normals; /* (points, 3) unit: serve only points of the centre's sheet (patch.h); NULL: any */
};

/* A greedy cover: along the curve, each point not yet served becomes a centre and serves those of its nearest, as
 * many as the rule allows, that are not served yet. Blocks of fixed length are covered on their own, so the result
 * does not depend on the pool. A search a patch; the cover takes 16 bytes a point. */
gnp_status gnp_cover_greedy(const struct gnp_neighbors *neighbors, const double *points, size_t count,
                            const struct gnp_cover_rule *rule, struct gnp_pool *pool, struct gnp_task *task,
                            struct gnp_cover *out, struct gnp_error *error);

void gnp_cover_clear(struct gnp_cover *cover);

#endif
