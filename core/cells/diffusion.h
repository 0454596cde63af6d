/* Implicit diffusion steps on a cloud: (M + c S) x = b with lumped masses M and a symmetric stiffness S whose rows sum
 * to zero, both of finite volumes on the points' cells (cell.h). S is positive semidefinite for any points, so every
 * step is stable. */
#ifndef GNP_CORE_DIFFUSION_H
#define GNP_CORE_DIFFUSION_H

#include <stddef.h>
#include <stdint.h>

#include "core/base/pool.h"
#include "core/base/status.h"

/* S u at i = sum_j s_ij (u_i - u_j), s_ij = s_ji >= 0: the integral of -Delta u over the cell. Freed by gnp_stiffness_clear. */
struct gnp_stiffness {
	size_t count;
	size_t *start;    /* (count + 1) */
	uint32_t *column; /* (start[count]) neighbours of a point, ascending */
	double *value;    /* (start[count]) s_ij */
	double *diagonal; /* (count) their sum */
};

/* neighbor, weight (count, edges): of each edge of a point's cell or star, 0 past the last one. Those of two points are
 * found in two planes and differ a little: s is the mean of both, one that lacks the edge counting 0, and where that is
 * negative there is no edge. task may be NULL; polled. */
gnp_status gnp_stiffness_make(size_t count, size_t edges, const uint32_t *neighbor, const float *weight, struct gnp_task *task,
                              struct gnp_stiffness *out, struct gnp_error *error);
void gnp_stiffness_clear(struct gnp_stiffness *stiffness);
size_t gnp_stiffness_bytes(const struct gnp_stiffness *stiffness);

struct gnp_diffusion {
	const struct gnp_stiffness *stiffness;
	const double *mass;         /* (count) > 0 */
	double factor;              /* c >= 0 */
	const unsigned char *fixed; /* (count) 1 where x = 0 is given; NULL: nowhere */
};

/* out (count, 3) = S in; rows in parallel. */
gnp_status gnp_stiffness_apply(const struct gnp_stiffness *stiffness, const double *in, double *out, struct gnp_pool *pool,
                               struct gnp_task *task, struct gnp_error *error);

/* Solves for three right-hand sides (count, 3) at once by conjugate gradients, diagonally scaled, to a relative residual of 1e-10 each. x
 * (count, 3): a guess in, the solution out; undefined on failure (GNP_NO_CONVERGENCE after 5,000 iterations or where numbers are not
 * finite, GNP_CANCELLED). Deterministic for any worker count. */
gnp_status gnp_diffusion_solve(const struct gnp_diffusion *diffusion, const double *rhs, double *x, struct gnp_pool *pool,
                               struct gnp_task *task, size_t *iterations, struct gnp_error *error);

#endif
