/* Finds the shortest ways along the edges of a graph over points (Dijkstra 1959). */
#ifndef GNP_CORE_PATHS_H
#define GNP_CORE_PATHS_H

#include "core/base/task.h"
#include "core/cells/diffusion.h"

/* length (count) out: of the shortest way from any source along the edges, each as long as it is straight; INFINITY where none leads. points (count, 3),
 * source (count): 0 or 1. task may be NULL. */
gnp_status gnp_paths_find(const struct gnp_stiffness *graph, const double *points, const unsigned char *source, struct gnp_task *task,
                          double *length, struct gnp_error *error);

#endif
