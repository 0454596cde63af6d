/* The weak Laplacian of a cloud as the rows of a Laplacian: -M^-1 S, with the stiffness S of the points' stars (star.h)
 * and what they measure as masses M.
 *
 * S is symmetric with weights that are not negative and rows that sum to zero, for any points: -Delta is positive
 * semidefinite, implicit steps keep between the least and the largest value, and open edges are natural (no flux). Of
 * second order at best. */
#ifndef GNP_CORE_WEAK_H
#define GNP_CORE_WEAK_H

#include "core/cells/diffusion.h"
#include "core/operators/collocation.h"
#include "core/operators/domain.h"

/* which: mask of GNP_DERIVATIVE_BIT of the Laplacian and the stiffness S, which it has alone. Every point kept, in
 * curve order; mass: M, the domain's areas. known: S, where it is known; NULL: it is made. Deterministic for any worker
 * count. On failure *out is unchanged. task may be NULL. */
gnp_status gnp_weak_make(const struct gnp_domain *domain, unsigned which, const struct gnp_stiffness *known,
                         struct gnp_pool *pool, struct gnp_task *task, struct gnp_collocation *out,
                         struct gnp_error *error);

#endif
