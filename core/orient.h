/* Normals for clouds that come without: estimation by local PCA, consistent orientation by a minimum spanning
 * tree on the Riemannian graph (Hoppe, DeRose, Duchamp, McDonald & Stuetzle 1992), per connected component,
 * outward for closed surfaces. */
#ifndef GNP_CORE_ORIENT_H
#define GNP_CORE_ORIENT_H

#include <stddef.h>

#include "neighbors.h"
#include "pool.h"
#include "status.h"
#include "task.h"

/* points (count, 3) in curve order, neighbors built over them; normals (count, 3) out, unit length.
 * Deterministic: the same bytes for any number of workers. k: neighbours used a point (0: the default).
 * *components (may be NULL): connected
 * components oriented. On failure normals are undefined. */
gnp_status gnp_orient_normals(const double *points, size_t count, const struct gnp_neighbors *neighbors, size_t k,
                              struct gnp_pool *pool, struct gnp_task *task, double *normals,
                              size_t *components, struct gnp_error *error);

#endif
