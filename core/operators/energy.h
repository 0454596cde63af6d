/* Whether a solution of alpha u - Delta u = f can be believed: the energy of u by finite volumes, u^T S u, over what f
 * says it is, the integral of u (f - alpha u). Two discretisations that know nothing of each other: on a cloud that
 * resolves the surface and f the quotient is near 1, while a collocation that has lost its way answers with large u for
 * no reason in f. */
#ifndef GNP_CORE_ENERGY_H
#define GNP_CORE_ENERGY_H

#include <stdbool.h>

#include "core/cells/diffusion.h"

/* Beyond these a solution is not to be believed: resolved ones have 0.9 to 1.1, as finite volumes miss some of the
 * energy of rough ones. */
#define GNP_ENERGY_LEAST 0.5
#define GNP_ENERGY_MOST 1.5

/* u^T S u: the integral of |grad u|^2. */
double gnp_energy_stored(const struct gnp_stiffness *stiffness, const double *u);
/* area, u, f (stiffness->count). Boundaries are taken to let nothing through. held: u is given somewhere, and zero
 * there; else its mean, which no derivative sees, is left out. 1 where u is constant. */
double gnp_energy_quotient(const struct gnp_stiffness *stiffness, const double *area, const double *u, const double *f,
                           double alpha, bool held);

#endif
