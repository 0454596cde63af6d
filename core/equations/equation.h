/* The linear system of alpha u - Delta u = f on a domain, ready for a solver: every free constant is held by a pin.
 *
 * Derivatives do not see constants: each part of the system that stands alone (components.h) has one that is free.
 * Adding to the diagonal at one unknown of each, its anchor, makes the system regular: what is inconsistent in f comes
 * out as the solution's value there, from which the constant that has to be taken off f follows (poisson.c). */
#ifndef GNP_CORE_EQUATION_H
#define GNP_CORE_EQUATION_H

#include "core/linear/components.h"
#include "core/operators/laplacian.h"

/* Owned; freed by gnp_equation_clear. Rows are the domain's points, unknowns the kept ones. */
struct gnp_equation {
	int system;              /* enum gnp_system */
	size_t rows, unknowns;
	struct gnp_csr matrix;   /* (rows, unknowns) alpha - Delta; square: with pins; rows of given points: the identity's, of least squares zero */
	struct gnp_csr transpose; /* least squares: of the matrix without columns of given points */
	struct gnp_csr normal;   /* least squares, until the factor is made: transpose * matrix, with pins, the identity at given points */
	uint32_t *kept;          /* (unknowns) the row of each */
	unsigned char *given;    /* (unknowns) 1: the value is known; NULL: none is */
	struct gnp_components components; /* none where alpha is not 0: nothing is free */
	double *pin;             /* (components.count) what was added at each anchor */
	double alpha;            /* [1 / length^2] */
	size_t reduced;          /* rows fitted with a lower degree */
};

/* given (points): as above for all points of the domain, in curve order; NULL: none is. On failure *out is
 * unchanged. */
gnp_status gnp_equation_make(const struct gnp_domain *domain, const struct gnp_laplacian_options *options, double alpha,
                             const unsigned char *given, struct gnp_pool *pool, struct gnp_task *task, struct gnp_equation *out,
                             struct gnp_error *error);
void gnp_equation_clear(struct gnp_equation *equation);
size_t gnp_equation_bytes(const struct gnp_equation *equation);

/* Which part of the cloud an unknown is of; components.count: none that stands alone. */
size_t gnp_equation_part(const struct gnp_equation *equation, size_t unknown);

#endif
