/* Geodesic distances on a cloud, and what goes along the shortest ways: vectors in parallel, the log map. By fronts
 * over the triangles of the points' stars (front.h): no system is solved, and several sources are as exact as one.
 *
 * The heat method (Crane, Weischedel & Wardetzky 2013) smears over a mean spacing what a front keeps sharp: the rims
 * where fronts of different sources meet, and the sources' own surroundings. Parallel transport and the log map are
 * what the vector heat method (Sharp, Soliman & Crane 2019) tends to as its time does to zero: along the shortest way
 * alone, tangent planes turning as the normals turn (carry.h). */
#ifndef GNP_CORE_GEODESIC_H
#define GNP_CORE_GEODESIC_H

#include "core/operators/domain.h"

struct gnp_geodesic; /* opaque, immutable, shared between threads */

/* Prepares the triangles for any sources; borrows nothing. GNP_INVALID_ARGUMENT; GNP_DEGENERATE. Points that coincide
 * are one, and have the same answers. On failure *out is unchanged. The task is warned of sheets taken for one
 * (operator_check.h). */
gnp_status gnp_geodesic_create(const struct gnp_cloud *cloud, const struct gnp_domain_options *options,
                               struct gnp_pool *pool, struct gnp_task *task, struct gnp_geodesic **out,
                               struct gnp_error *error);
void gnp_geodesic_free(struct gnp_geodesic *geodesic);
size_t gnp_geodesic_bytes(const struct gnp_geodesic *geodesic);
const struct gnp_domain *gnp_geodesic_domain(const struct gnp_geodesic *geodesic);

/* distance (n) out [length], to the nearest of the sources (count, each < n, none dropped by a filter), never less than
 * straight; INFINITY at points of parts of the cloud that hold no source, and at points the filter dropped. On failure
 * distance is undefined. task may be NULL; it is warned of distances that are not to be believed (geodesic_check.h). */
gnp_status gnp_geodesic_distance(const struct gnp_geodesic *geodesic, const uint32_t *sources, size_t count,
                                 struct gnp_pool *pool, struct gnp_task *task, double *distance,
                                 struct gnp_error *error);

/* distance (count) out [length]: of the points of each pair (each < n), as gnp_geodesic_distance has it from one of
 * them; INFINITY where no way leads, and at points the filter dropped. One front for each distinct point of the side
 * that has fewer, which ends where its pairs do, four at a time. On failure distance is undefined. */
gnp_status gnp_geodesic_pairs(const struct gnp_geodesic *geodesic, const uint32_t (*pairs)[2], size_t count,
                              struct gnp_pool *pool, struct gnp_task *task, double *distance, struct gnp_error *error);

/* parallel (n, 3) out: the tangential part of the nearest source's row of vectors (n, 3; other rows are not read),
 * carried along the shortest way from there; zero where none leads. GNP_INVALID_ARGUMENT where a source's row is not
 * finite. On failure parallel is undefined. */
gnp_status gnp_geodesic_parallel(const struct gnp_geodesic *geodesic, const uint32_t *sources, size_t count,
                                 const double *vectors, struct gnp_task *task, double *parallel,
                                 struct gnp_error *error);

/* log (n, 2) out [length]: where the shortest way from the source to each point sets out, times its length, in the
 * basis (2, 3) out, orthonormal in the source's tangent plane and right-handed about its normal; zero where no way
 * leads. On failure both are undefined. */
gnp_status gnp_geodesic_log(const struct gnp_geodesic *geodesic, uint32_t source, struct gnp_pool *pool,
                            struct gnp_task *task, double *log, double basis[2][3], struct gnp_error *error);

#endif
