/* Surface derivatives at every point of a cloud as sparse rows over its values.
 *
 * At each point the frame is tangent to the surface there (psi3 = the point's normal). In Monge form, and so in the
 * unfolded coordinates that agree with it to third order (unfold.h), the metric at the point is the identity and its
 * derivatives vanish: Delta_LB f = p_uu + p_vv and grad f = p_u t1 + p_v t2 of the polynomial p fitted to the values of
 * the point's neighbours (stencil.h). Points of another sheet (patch.h) take no part. */
#ifndef GNP_CORE_COLLOCATION_H
#define GNP_CORE_COLLOCATION_H

#include "core/cloud/prepare.h"
#include "core/linear/csr.h"
#include "core/operators/copies.h"

/* The divergence matrices take a field's ambient components and give the divergence of its tangential part. */
#define GNP_DERIVATIVE_TABLE(X)                      \
	X(GNP_DERIVATIVE_VALUE, "value")                 \
	X(GNP_DERIVATIVE_LAPLACIAN, "laplacian")         \
	X(GNP_DERIVATIVE_GRADIENT_X, "gradient_x")       \
	X(GNP_DERIVATIVE_GRADIENT_Y, "gradient_y")       \
	X(GNP_DERIVATIVE_GRADIENT_Z, "gradient_z")       \
	X(GNP_DERIVATIVE_DIVERGENCE_X, "divergence_x")   \
	X(GNP_DERIVATIVE_DIVERGENCE_Y, "divergence_y")   \
	X(GNP_DERIVATIVE_DIVERGENCE_Z, "divergence_z")   \
	X(GNP_DERIVATIVE_STIFFNESS, "stiffness") /* of the weak form alone (weak.h) */

enum gnp_derivative {
#define GNP_DERIVATIVE_ENUM(id, name) id,
	GNP_DERIVATIVE_TABLE(GNP_DERIVATIVE_ENUM)
#undef GNP_DERIVATIVE_ENUM
	GNP_DERIVATIVE_COUNT
};
#define GNP_DERIVATIVE_BIT(derivative) (1u << (derivative))

const char *gnp_derivative_name(enum gnp_derivative derivative);

struct gnp_collocation_rule {
	unsigned degree;    /* of the polynomials, 1..7; 2 at least for the Laplacian */
	size_t neighbors;   /* points of a stencil, the point itself included; 0: twice the polynomial's coefficients */
	unsigned which;     /* mask of GNP_DERIVATIVE_BIT */
	const unsigned char *keep; /* (count) 1: the point's value may be used; NULL: every point's */
};

/* Matrices of one sparsity: rows are points, columns the kept ones, both in curve order. Freed by
 * gnp_collocation_clear. */
struct gnp_collocation {
	size_t rows, columns;
	size_t *row_offsets;                  /* (rows + 1) */
	uint32_t *column;                     /* (row_offsets[rows]) ascending within a row */
	double *value[GNP_DERIVATIVE_COUNT];  /* (row_offsets[rows]) each; NULL where not asked for */
	uint32_t *kept;                       /* (columns) the point of each column, ascending */
	double *mass;                         /* (columns) of the weak form: what the stiffness is divided by; else NULL */
	size_t reduced;                       /* rows fitted with a lower degree, or by the mean of the others, for want of neighbours */
};

/* prepared: normals are those of the surface. GNP_INVALID_ARGUMENT; GNP_DEGENERATE when no point is kept.
 * Deterministic for any worker count. On failure *out is unchanged. task may be NULL. */
gnp_status gnp_collocation_make(const struct gnp_prepared *prepared, const struct gnp_collocation_rule *rule,
                                struct gnp_pool *pool, struct gnp_task *task, struct gnp_collocation *out,
                                struct gnp_error *error);
void gnp_collocation_clear(struct gnp_collocation *collocation);

/* The same as rows and columns of a list of `points` points that holds these among others: row and point i become row
 * and point position[i] < points, no two the same. copies: points that have the rows of others. kept and the columns stay
 * ascending; rows of points that are none of these are empty. On failure *collocation is unchanged. */
gnp_status gnp_collocation_reorder(struct gnp_collocation *collocation, const uint32_t *position,
                                   const struct gnp_copies *copies, size_t points, struct gnp_error *error);

/* A matrix of it that borrows the arrays. */
struct gnp_csr gnp_collocation_view(const struct gnp_collocation *collocation, enum gnp_derivative which);

#endif
