/* Which nodes of a patch its integrals are summed over. */
#ifndef GNP_CORE_QUADRATURE_H
#define GNP_CORE_QUADRATURE_H

#include <stddef.h>

/* Farthest-point order of nodes (count, stride) by their first two features, u and v, from the first node on: each next
 * node is the one farthest from all before it, the first of equals. chosen: min(wanted, count) different nodes, as many
 * as it returns; when that is all of them they are in their own order. distance (count): scratch. */
size_t gnp_quadrature_choose(const float *nodes, size_t stride, size_t count, size_t wanted, size_t *chosen,
                             float *distance);

#endif
