/* A cloud made ready for work: in curve order, indexed, with unit normals. What estimation and everything built on
 * patches starts from. */
#ifndef GNP_CORE_PREPARE_H
#define GNP_CORE_PREPARE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/base/pool.h"
#include "core/cloud/cloud.h"
#include "core/search/neighbors.h"

/* Owned; freed by gnp_prepared_clear. */
struct gnp_prepared {
	size_t count;
	uint32_t *order;   /* (count) caller's index of each point */
	double *points;    /* (count, 3) */
	double *normals;   /* (count, 3) unit, outward */
	double *unfitted;  /* (count, 3) those that an estimator's took the place of, to the same side; NULL: none did */
	struct gnp_neighbors *neighbors;
	size_t components; /* connected components oriented; 0 when normals were given */
};

/* cloud has passed gnp_cloud_check. Normals are scaled to unit length, or estimated and oriented (orient.h) when
 * absent. What cannot be believed of the cloud is warned of (belief.h). On failure *out is unchanged. O(n log n);
 * what is prepared takes 100 bytes a point, and 240 more while normals are estimated. */
gnp_status gnp_prepare(const struct gnp_cloud *cloud, struct gnp_pool *pool, struct gnp_task *task,
                       struct gnp_prepared *out, struct gnp_error *error);

/* The same of what is left of a cloud that was prepared before, with normals of fits: nothing of it is judged again. */
gnp_status gnp_prepare_fitted(const struct gnp_cloud *cloud, struct gnp_pool *pool, struct gnp_task *task,
                              struct gnp_prepared *out, struct gnp_error *error);

/* The same without normals, which are NULL: for what goes by distances alone. */
gnp_status gnp_prepare_points(const struct gnp_cloud *cloud, struct gnp_task *task, struct gnp_prepared *out,
                              struct gnp_error *error);
/* Anew, of points that have moved. On failure there is no index. */
gnp_status gnp_prepared_index(struct gnp_prepared *prepared, struct gnp_error *error);
void gnp_prepared_clear(struct gnp_prepared *prepared);

/* Bytes a prepared cloud of count points holds, and the most that gnp_prepare may allocate to make it; given: it comes with normals. */
size_t gnp_prepared_memory(size_t count);
size_t gnp_prepare_memory(size_t count, bool given);

#endif
