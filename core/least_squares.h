/* Weighted linear least squares for many small problems: normal equations, Cholesky with diagonal scaling.
 *
 * The columns must be of comparable size (Legendre products on [-1, 1]^2 are); the condition number is then squared but
 * stays far from 1/epsilon, and a problem that is too near singular is refused rather than solved badly. */
#ifndef GNP_CORE_LEAST_SQUARES_H
#define GNP_CORE_LEAST_SQUARES_H

#include <stdbool.h>
#include <stddef.h>

/* gram (size, stride): lower triangle of sum_i weight_i phi_i phi_i^T; moment (stride): sum_i weight_i phi_i y_i.
 * phi (count, stride) with stride a multiple of 8, 64-byte aligned, zero past the size. */
void gnp_normal_equations(const double *phi, const double *weight, const double *y, size_t count, size_t stride,
                          double *gram, double *moment);

/* Factors the lower triangle of gram (size, stride) in place, S A S = L L^T with S the scaling that makes the diagonal 1; the
 * diagonal holds the inverses of L's
 * (scale (size) out). False when a pivot of the scaled matrix falls below 1e-11: then gram is spoilt. */
bool gnp_cholesky_factor(double *gram, size_t size, size_t stride, double *scale);

/* Solves A x = b with that factor; b and x may be the same array. */
void gnp_cholesky_solve(const double *factor, const double *scale, size_t size, size_t stride, const double *b, double *x);

#endif
