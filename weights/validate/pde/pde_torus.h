/* What is known of equations on a torus: eigenvalues by an ordinary differential equation, and a solution. */
#ifndef GNP_WEIGHTS_PDE_TORUS_H
#define GNP_WEIGHTS_PDE_TORUS_H

#include "weights/validate/pde/pde_case.h"

/* The radii of shapes.h's torus. */
#define GNP_PDE_TORUS_TURN (2.0 / 3)
#define GNP_PDE_TORUS_TUBE (1.0 / 3)

/* Normals, eigenvalues, source and solution for the points of the case. With s along the tube and w(s) away from
 * the axis an eigenfunction is f(s) times the cosine or sine of m turns, -(w f')' + m^2 f / w = lambda w f: solved
 * by finite volumes for each m, to some 1e-5. u is sin turn + cos tube. */
gnp_status gnp_pde_torus_set(struct gnp_pde_case *known, struct gnp_pool *pool, struct gnp_task *task,
                             struct gnp_error *error);

/* Sorted, the `count` lowest (at most 25), 0 first. */
gnp_status gnp_pde_torus_values(size_t count, struct gnp_pool *pool, struct gnp_task *task, double *value,
                                struct gnp_error *error);

#endif
