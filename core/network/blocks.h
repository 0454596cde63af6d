/* The last, linear layer of a kernel's MLP, never evaluated for a node or an edge: contracted with what it is multiplied by.
 *
 * The kernel's value is a matrix of c diagonal blocks of h x h,
 *   K[c][in][out] = sum_p weight[(c, in, out)][p] g_p + bias[(c, in, out)],
 * g (n) the hidden activations, and a row y (width = c h) becomes (y K)[c][out] = sum_in y[c][in] K[c][in][out]. Backward
 * functions add to what they write. */
#ifndef GNP_CORE_BLOCKS_H
#define GNP_CORE_BLOCKS_H

#include <stddef.h>

struct gnp_blocks {
	size_t channels, side, neurons; /* c, h, n */
	const float *weight;            /* (c h h, n) */
	const float *bias;              /* (c h h) */
};

/* spread (rows, width, n): y K without the bias as a linear form of the hidden activations,
 * spread[r][(c, out)][p] = sum_in y[r][(c, in)] weight[(c, in, out)][p]; y is (rows, width). */
void gnp_blocks_spread(const struct gnp_blocks *blocks, size_t rows, const float *y, float *spread);
void gnp_blocks_spread_backward(const struct gnp_blocks *blocks, size_t rows, const float *y, const float *dspread,
                                float *dy, float *dweight);

/* The same for a few neurons at a time, so that what comes out stays in cache until it is used. sliced (c h h, n) holds
 * the weights of neurons p .. p + count - 1 from c h h p on, as (c h h, count), for p = 0, step, 2 step ..., the last
 * slice the shorter one. spread (width, count, rows), the rows innermost. */
void gnp_blocks_slice(const struct gnp_blocks *blocks, size_t step, float *sliced);
void gnp_blocks_spread_slice(const struct gnp_blocks *blocks, const float *slice, size_t count, size_t rows,
                             const float *y, float *spread);

/* z (rows, width) = sums of y K over nodes, from moments (rows, width, n), sums of y[(c, in)] g[p], without the bias:
 * z[r][(c, out)] = sum_in sum_p weight[(c, in, out)][p] moments[r][(c, in)][p]. dmoments is written, not added to. */
void gnp_blocks_gather(const struct gnp_blocks *blocks, size_t rows, const float *moments, float *z);
void gnp_blocks_gather_backward(const struct gnp_blocks *blocks, size_t rows, const float *moments, const float *dz,
                                float *dmoments, float *dweight);

/* The bias's part: z (rows, width) += y K for g = 0. */
void gnp_blocks_bias(const struct gnp_blocks *blocks, size_t rows, const float *y, float *z);
void gnp_blocks_bias_backward(const struct gnp_blocks *blocks, size_t rows, const float *y, const float *dz, float *dy,
                              float *dbias);

#endif
