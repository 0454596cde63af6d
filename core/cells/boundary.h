/* Finds the points of a cloud that lie within about a spacing of where it ends.
 *
 * A point is *outermost* where an empty disk touches it (disk.h) that is wider than usual gaps between points of this
 * cloud: the points of an alpha shape (Edelsbrunner, Kirkpatrick & Seidel 1983). The neighbours that bound its disks
 * follow it along the rim; chains of few points are of chance. What lies between the outermost ones of a long chain, or
 * near them with nobody on one side, is at the rim, too.
 *
 * There is no rim where the gap is wide for one side alone, for there the cloud becomes sparse, nor where the next
 * points face the other way, for there the surface folds back: thin bodies have none. */
#ifndef GNP_CORE_BOUNDARY_H
#define GNP_CORE_BOUNDARY_H

#include "core/base/pool.h"
#include "core/cloud/prepare.h"

/* rim (count) out, 0 or 1, in curve order. usual: what gnp_disk_usual says of the cloud. candidate (count): where
 * outermost points are looked for first, at some of each rim; NULL: everywhere. task may be NULL. Deterministic for any
 * worker count. */
gnp_status gnp_boundary_find(const struct gnp_prepared *prepared, double usual, const unsigned char *candidate,
                        struct gnp_pool *pool, struct gnp_task *task, unsigned char *rim, struct gnp_error *error);

/* Bytes it may take for so many points. */
size_t gnp_boundary_memory(size_t count);

#endif
