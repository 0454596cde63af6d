/* The edge kernel's hidden activations, h_ij = max(a_i + b_j, 0) (n) for target i and source j, made where they are
 * used: all of them would not fit a cache. a (targets, n), b (sources, n), the bias in one of them. Where a sum is 0,
 * so is the derivative. */
#ifndef GNP_CORE_EDGES_H
#define GNP_CORE_EDGES_H

#include <stddef.h>

/* h (targets, n) of one source, whose b is (n). */
void gnp_edges_fill(size_t targets, size_t n, const float *a, const float *b, float *h);
/* da (targets, n) and db (n) += dh where h > 0. */
void gnp_edges_fill_backward(size_t targets, size_t n, const float *h, const float *dh, float *da, float *db);

/* h (targets, count, sources) of `count` neurons of all sources: a (targets, n) from the first of them on, b (count,
 * sources). */
void gnp_edges_fill_slice(size_t targets, size_t sources, size_t n, size_t count, const float *a, const float *b,
                          float *h);

/* moments (targets, terms, n) = sum_j x_j[f] h_ij; x (sources, terms). */
void gnp_edges_moments(size_t targets, size_t sources, size_t n, size_t terms, const float *a, const float *b,
                       const float *x, float *moments);
void gnp_edges_moments_backward(size_t targets, size_t sources, size_t n, size_t terms, const float *a, const float *b,
                                const float *x, const float *dmoments, float *da, float *db);

/* mean (sources, n) = sum_i share_i h_ij; share (targets). */
void gnp_edges_mean(size_t targets, size_t sources, size_t n, const float *share, const float *a, const float *b,
                    float *mean);
void gnp_edges_mean_backward(size_t targets, size_t sources, size_t n, const float *share, const float *a,
                             const float *b, const float *dmean, float *da, float *db);

#endif
