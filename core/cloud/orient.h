/* Estimates and orients normals for clouds that come without: estimation by local PCA, consistent orientation by a
 * minimum spanning tree on the Riemannian graph (Hoppe, DeRose, Duchamp, McDonald & Stuetzle 1992), per connected
 * component, mended by winding numbers (settle.h), outward for closed surfaces. */
#ifndef GNP_CORE_ORIENT_H
#define GNP_CORE_ORIENT_H

#include <stddef.h>

#include "core/base/pool.h"
#include "core/base/status.h"
#include "core/base/task.h"
#include "core/search/neighbors.h"

/* points (count, 3) in curve order, neighbors built over them; normals (count, 3) out, unit length. Any finite
 * points: coincident, collinear and few ones get some unit normal. k: neighbours used a point (0: the default, 16;
 * at most 256). *components (may be NULL): connected surfaces oriented. Sets of at most k points (outliers,
 * specks) are no components of their own but follow the nearest one; surfaces are never joined through them. Open
 * surfaces: outward.h says which side. A surface that meets itself more closely than its points are spaced may
 * come out wrong in part, and is warned of where that shows (settle.h, belief.h). Deterministic: the same bytes for
 * any number of workers. Adds 2 * count items to the task's progress, up to twice that where many points coincide;
 * O(n log n), about 230 bytes a point and at most 4 MB more while it runs, at k = 16. On failure normals are
 * undefined. */
gnp_status gnp_orient_normals(const double *points, size_t count, const struct gnp_neighbors *neighbors, size_t k,
                              struct gnp_pool *pool, struct gnp_task *task, double *normals,
                              size_t *components, struct gnp_error *error);

#endif
