/* The graded monomial basis u^a v^b, a + b <= degree, ordered by degree and then by b: a local Taylor expansion, whose
 * leading functions are those of every lower degree and on which rotations act within each degree. */
#ifndef GNP_CORE_TAYLOR_H
#define GNP_CORE_TAYLOR_H

#include <stddef.h>

#include "core/fit/jet.h"

enum { GNP_TAYLOR_DEGREE = 7, GNP_TAYLOR_SIZE = 36, GNP_TAYLOR_STRIDE = 40 };

/* Functions of degree at most `degree`. */
size_t gnp_taylor_size(unsigned degree);

/* rows (count, stride): the first gnp_taylor_size(degree) columns filled, the rest zero; stride a multiple of 8. */
void gnp_taylor_rows(unsigned degree, const double *u, const double *v, size_t count, size_t stride, double *rows);

/* Means over points of all functions, of up to 8 sets of points at once: u, v (many, 8) by point and set, where a set
 * has fewer points than many the rest at (0, 0); share (sets): 1 / a set's points. rows (sets, GNP_TAYLOR_STRIDE). */
void gnp_taylor_means(const double *u, const double *v, size_t many, const double *share, size_t sets, double *rows);

/* factor[i] = a! b! and order[i] = a + b of the i-th function; arrays (GNP_TAYLOR_SIZE). */
void gnp_taylor_indices(double *factor, unsigned *order);

/* Value and derivatives up to second order of each function at (u, v): rows (6, stride) in the order f, u, v, uu, uv, vv. */
void gnp_taylor_jets(unsigned degree, double u, double v, size_t stride, double *rows);

struct gnp_jet gnp_taylor_jet(unsigned degree, const double *coefficients, double u, double v);

#endif
