/* The weak form of -Delta on the stars of a cloud's points (star.h, diffusion.h): second order at best, but
 * symmetric, positive and cheap to factor. What heat flows by, and what collocation is preconditioned with. */
#ifndef GNP_CORE_VOLUME_H
#define GNP_CORE_VOLUME_H

#include "core/cells/diffusion.h"
#include "core/cloud/prepare.h"
#include "core/linear/csr.h"

/* S over the points in curve order. Freed by gnp_stiffness_clear. task may be NULL. Deterministic for any worker count. */
gnp_status gnp_volume_stiffness(const struct gnp_prepared *prepared, struct gnp_pool *pool, struct gnp_task *task,
                                struct gnp_stiffness *out, struct gnp_error *error);

/* S + diag(added) as a matrix; rows of given points (count, 0 or 1; NULL: none) are those of the identity. Freed by gnp_csr_clear. */
gnp_status gnp_volume_matrix(const struct gnp_stiffness *stiffness, const double *added, const unsigned char *given,
                             struct gnp_csr *out, struct gnp_error *error);

#endif
