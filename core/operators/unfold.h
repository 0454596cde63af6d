/* Where a neighbour lies in the plane tangent at a point: the chord between them, turned as the surface turns on the
 * way.
 *
 * The mean m of both normals is, to third order, at right angles to the chord. What is at right angles to it exactly is
 * turned by the smallest rotation that takes m to the point's normal. The coordinates agree with those of the
 * orthogonal projection to third order and are smooth, so that first and second derivatives at the point are the same;
 * but a piece of surface that bends away does not shrink in them as its shadow does, where neighbours crowd and
 * polynomials fail. */
#ifndef GNP_CORE_UNFOLD_H
#define GNP_CORE_UNFOLD_H

/* from: the point, with its unit normal n and unit tangents (psi1, psi2, n right-handed or not); to: the neighbour,
 * with its unit normal m. u, v out [length]. Where the normals do not agree (patch.h, another sheet) the orthogonal
 * projection. */
void gnp_unfold(const double from[3], const double n[3], double tangents[2][3], const double to[3], const double m[3],
                double *u, double *v);

#endif
