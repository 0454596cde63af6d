/* Linear least squares for many small problems: normal equations and Cholesky factors, all in the upper triangle, rows
 * padded to whole vectors.
 *
 * The columns must be of comparable size (polynomials on the unit disk are); the condition number is squared, and a
 * problem that is too near singular is refused rather than solved badly. */
#ifndef GNP_CORE_LEAST_SQUARES_H
#define GNP_CORE_LEAST_SQUARES_H

#include <stdbool.h>
#include <stddef.h>

#define GNP_SMALLEST_PIVOT 1e-11 /* relative to the diagonal: what least squares without a ridge can trust */

/* gram (stride, stride): upper triangle of sum_i weight_i phi_i phi_i^T; moment (stride): sum_i weight_i phi_i y_i.
 * phi (count, stride) with stride a multiple of 8, zero past the columns in use. */
void gnp_normal_equations(const double *phi, const double *weight, const double *y, size_t count, size_t stride,
                          double *gram, double *moment);

/* residual (count) = y - phi c: what a fit leaves. c (stride), zero past the columns in use. */
void gnp_residuals(const double *phi, const double *y, size_t count, size_t stride, const double *c, double *residual);

/* Factors gram (size, stride) in place, A = U^T U; the diagonal then holds the inverses of U's. False when a pivot falls to
 * smallest_pivot of its diagonal entry or below: then gram is spoilt. Entries below the diagonal are undefined after. */
bool gnp_cholesky_factor(double *gram, size_t size, size_t stride, double smallest_pivot);

/* Solves U^T z = b and U x = z, the two halves of A x = b. The arrays (stride) may be the same; those past size are spoilt. */
void gnp_cholesky_forward(const double *factor, size_t size, size_t stride, const double *b, double *z);
void gnp_cholesky_backward(const double *factor, size_t size, size_t stride, const double *z, double *x);

/* log det A. */
double gnp_cholesky_log_determinant(const double *factor, size_t size, size_t stride);

#endif
