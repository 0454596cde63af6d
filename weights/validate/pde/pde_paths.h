/* Distances on a mesh along its triangles, which those of clouds are held against: shortest paths in a graph of
 * points on its edges.
 *
 * Points divide every edge; each is joined by straight lines to all that share a triangle with it. So every
 * distance is that of a path on the surface: never below the true one, and above it by a share that falls by nearly
 * three with twice the points an edge (0.1 % with eight of them): what changes from half as many to all is about
 * twice what is left. */
#ifndef GNP_WEIGHTS_PDE_PATHS_H
#define GNP_WEIGHTS_PDE_PATHS_H

#include "weights/validate/pde/pde_mesh.h"

/* distance (vertices) out [length] from a vertex; INFINITY on other pieces. density: points on an edge of the mean
 * length; longer ones have more, to 255, every one has one. Dijkstra's algorithm: O(n log n) for n points in all. */
gnp_status gnp_pde_paths(const struct gnp_pde_mesh *mesh, uint32_t source, unsigned density, double *distance,
                         struct gnp_error *error);

#endif
