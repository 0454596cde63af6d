/* Sums and updates of long vectors, through the pool in chunks of fixed length: the same bytes for any number of
 * workers. O(count n); a sum takes 8 count bytes a chunk of 8192 entries. */
#ifndef GNP_CORE_VECTORS_H
#define GNP_CORE_VECTORS_H

#include <stddef.h>

#include "core/base/pool.h"
#include "core/base/status.h"

/* sums (count) = V w for vectors V (count, n) and weights (n), or NULL for ones: sum_i V[k][i] weights[i] w[i]. */
gnp_status gnp_vectors_dot(const double *vectors, size_t count, size_t n, const double *weights, const double *w,
                           struct gnp_pool *pool, double *sums, struct gnp_error *error);

/* w (n) += factor sum_k shares[k] V[k]. */
gnp_status gnp_vectors_add(const double *vectors, size_t count, size_t n, const double *shares, double factor,
                           struct gnp_pool *pool, double *w, struct gnp_error *error);

/* sqrt(sum_i weights[i] w[i]^2). */
gnp_status gnp_vectors_norm(size_t n, const double *weights, const double *w, struct gnp_pool *pool, double *norm,
                            struct gnp_error *error);

/* The same for blocks of vectors W (width, n), as products of matrices: many times as fast for one. shares and sums are
 * (count, width), column by column. sums = V (weights W)^T; */
gnp_status gnp_vectors_block_dot(const double *vectors, size_t count, size_t n, const double *weights, const double *w,
                                 size_t width, struct gnp_pool *pool, double *sums, struct gnp_error *error);

/* W[c] -= sum_k shares[c][k] V[k]; */
gnp_status gnp_vectors_block_subtract(const double *vectors, size_t count, size_t n, const double *shares,
                                      size_t width, struct gnp_pool *pool, double *w, struct gnp_error *error);

/* W[c] = sum_k shares[c][k] V[k]. W may be V, or begin where V does. */
gnp_status gnp_vectors_combine(const double *vectors, size_t count, size_t n, const double *shares, size_t width,
                               struct gnp_pool *pool, double *w, struct gnp_error *error);

#endif
