/* What fronts (front.h) carry with them along the shortest ways: vectors in parallel, and the directions in which the
 * ways set out. From point to point the tangent plane turns by the smallest rotation that takes one normal to the
 * other. */
#ifndef GNP_CORE_CARRY_H
#define GNP_CORE_CARRY_H

#include <stddef.h>
#include <stdint.h>

/* Borrowed; both may be NULL. */
struct gnp_carried {
	double *vector; /* (points, 3) tangent vectors: at sources given */
	double *start;  /* (points, 3) unit directions at the source, tangent there; zero at sources */
};

/* From a point to the next, straight along the edge. */
void gnp_carry_along(const struct gnp_carried *carried, const double *points, const double *normals, uint32_t from,
                     uint32_t to);

/* From the side between a and b, where the way to `to` divides the angle between the ways to a and b by share : 1 -
 * share. source: where all three ways began. */
void gnp_carry_between(const struct gnp_carried *carried, const double *normals, const uint32_t side[2], double share,
                       uint32_t source, uint32_t to);

/* From `from`, where the way to `to` sets out turned by an angle about the source's normal. */
void gnp_carry_turned(const struct gnp_carried *carried, const double *normals, uint32_t from, double angle,
                      uint32_t source, uint32_t to);

#endif
