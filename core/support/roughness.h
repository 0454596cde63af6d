/* How rough a cloud is about its points, at two scales: it tells noise, which is everywhere, from detail, which is not.
 *
 * Roughness is half the logarithm of the flatness lambda_3 / lambda_2 of the principal axes of a point's nearest 12 or
 * 64 (surface variation; Pauly, Gross & Kobbelt 2002). It does not change with the scale of the cloud. It is measured
 * at every fourth point along the curve, and read as means over many points. */
#ifndef GNP_CORE_ROUGHNESS_H
#define GNP_CORE_ROUGHNESS_H

#include <stddef.h>
#include <stdint.h>

#include "core/base/pool.h"
#include "core/base/status.h"
#include "core/base/task.h"
#include "core/search/neighbors.h"

enum { GNP_ROUGHNESS_SCALES = 2, GNP_ROUGHNESS_EVERY = 4 };

/* Owned; freed by gnp_roughness_clear. */
struct gnp_roughness {
	size_t count;                       /* points measured */
	float *value[GNP_ROUGHNESS_SCALES]; /* (count) of the nearest 12, 64 */
};

/* Of indexed points in curve order. GNP_OUT_OF_MEMORY; on failure *out is unchanged. A search of 64 for every fourth
 * point; 2 bytes a point. */
gnp_status gnp_roughness_measure(const struct gnp_neighbors *neighbors, struct gnp_pool *pool, struct gnp_task *task,
                                 struct gnp_roughness *out, struct gnp_error *error);
void gnp_roughness_clear(struct gnp_roughness *roughness);

/* Roughness about a point of the cloud at a scale. */
static inline float gnp_roughness_at(const struct gnp_roughness *roughness, int scale, uint32_t point)
{
	return roughness->value[scale][point / GNP_ROUGHNESS_EVERY];
}

#endif
