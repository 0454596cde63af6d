/* Geodesic distances by the heat method (Crane, Weischedel & Wardetzky 2013) on the finite volumes of a cloud (volume.h).
 *
 * Heat u flows for a short time t from the sources, (M + t S) u = delta; far away u falls like exp(-d / sqrt t), so the gradient of
 * -sqrt(t) log u points where distance grows; the function whose gradient comes nearest to those directions at unit length
 * is the distance: S d = -div X. All matrices are M-matrices, so u is positive and its logarithm keeps its digits. */
#ifndef GNP_CORE_GEODESIC_H
#define GNP_CORE_GEODESIC_H

#include "core/operators/domain.h"

struct gnp_geodesic; /* opaque, immutable, shared between threads */

/* Prepares the factors for any sources; borrows nothing. GNP_INVALID_ARGUMENT; GNP_DEGENERATE, also where points
 * coincide. On failure *out is unchanged. The task is warned of sheets taken for one (operator_check.h). */
gnp_status gnp_geodesic_create(const struct gnp_cloud *cloud, const struct gnp_domain_options *options,
                               struct gnp_pool *pool, struct gnp_task *task, struct gnp_geodesic **out,
                               struct gnp_error *error);
void gnp_geodesic_free(struct gnp_geodesic *geodesic);
size_t gnp_geodesic_bytes(const struct gnp_geodesic *geodesic);
const struct gnp_domain *gnp_geodesic_domain(const struct gnp_geodesic *geodesic);

/* distance (n) out [length], to the nearest of the sources (count, each < n, none dropped by a filter); INFINITY at
 * points of parts of the cloud that hold no source, and at points the filter dropped. On failure distance is undefined.
 * task may be NULL; it is warned of distances that are not to be believed (geodesic_check.h). */
gnp_status gnp_geodesic_distance(const struct gnp_geodesic *geodesic, const uint32_t *sources, size_t count,
                                 struct gnp_pool *pool, struct gnp_task *task, double *distance,
                                 struct gnp_error *error);

#endif
