/* Polynomial bases of the plane: products of Legendre polynomials on [-1, 1]^2 (the paper's eq. legendre).
 *
 * Tensor basis of degree d: P_a(v) P_b(u) at index (d + 1) a + b. Total-degree basis: the same products with
 * a + b <= d, in the order a = 0..d, b = 0..d - a. Taylor basis: the monomials of taylor.h. */
#ifndef GNP_CORE_LEGENDRE_H
#define GNP_CORE_LEGENDRE_H

#include <stddef.h>

#include "core/fit/jet.h"

enum gnp_basis_kind { GNP_BASIS_TENSOR, GNP_BASIS_TOTAL, GNP_BASIS_TAYLOR };

enum { GNP_DEGREE_MAX = 7, GNP_BASIS_MAX = 64 };

struct gnp_basis {
	enum gnp_basis_kind kind;
	unsigned degree; /* 0..GNP_DEGREE_MAX */
};

/* Coefficients: (d+1)^2 or (d+1)(d+2)/2. */
size_t gnp_basis_size(struct gnp_basis basis);

/* Index in `whole` of each function of `part` (the same Legendre kind, lower degree); index (gnp_basis_size(part)). */
void gnp_basis_embed(struct gnp_basis part, struct gnp_basis whole, size_t *index);

/* P_0..P_degree at x, and their first and second derivatives; arrays (degree + 1). */
void gnp_legendre(double x, unsigned degree, double *p, double *dp, double *ddp);

/* A Legendre basis at count points: phi (count, stride), stride >= the size rounded up to 8; columns past the size are zero. */
void gnp_basis_rows(struct gnp_basis basis, const double *u, const double *v, size_t count, size_t stride, double *phi);

/* Value and derivatives up to second order of each function at (u, v), in the basis's own coordinates: rows (6, stride) in the
 * order f, u, v, uu, uv, vv; stride >= the size. */
void gnp_basis_jets(struct gnp_basis basis, double u, double v, size_t stride, double *rows);

/* Value and derivatives up to second order of sum_i c_i phi_i at (u, v), in the basis's own coordinates. */
struct gnp_jet gnp_basis_jet(struct gnp_basis basis, const double *coefficients, double u, double v);

#endif
