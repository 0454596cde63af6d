/* Ties points that the stars of no others hold to the surface they lie at, by an edge.
 *
 * Where normals are wrong, at tips and between points that all but coincide, a point or a few of them find nobody
 * of their sheet. In equations they would be pieces of their own, with a constant that nothing fixes. By one edge
 * they have the values of the point they are tied to, and lead nothing across. */
#ifndef GNP_CORE_ATTACH_H
#define GNP_CORE_ATTACH_H

#include "core/cells/diffusion.h"
#include "core/cloud/prepare.h"

/* stiffness: what gnp_stiffness_make made of neighbor and weight (count, edges). Each piece of fewer than 12
 * points, which no estimator could tell a surface of, gets an edge to the nearest point of a larger one that is
 * among the nearest 32 of one of its own and not much farther than that one's neighbours are: as weights of a
 * triangle with three equal sides, written into neighbor and weight. *tied: edges written. Deterministic. */
gnp_status gnp_attach_pieces(const struct gnp_prepared *prepared, const struct gnp_stiffness *stiffness, size_t edges,
                             uint32_t *neighbor, float *weight, size_t *tied, struct gnp_error *error);

#endif
