/* Linear layers and rectifiers over rows of floats. Gradients of parameters are added to, those of activations
 * written. */
#ifndef GNP_CORE_DENSE_H
#define GNP_CORE_DENSE_H

#include <stddef.h>

/* y (rows, out) = x (rows, in) W^T + bias. W is (out, in); ldx and ldw are the distances of rows in x and W. bias (out)
 * or NULL. */
void gnp_dense_forward(size_t rows, size_t in, size_t out, const float *x, size_t ldx, const float *weight, size_t ldw,
                       const float *bias, float *y);

/* The same with y += . */
void gnp_dense_forward_add(size_t rows, size_t in, size_t out, const float *x, size_t ldx, const float *weight,
                           size_t ldw, float *y);

/* dx (rows, in), whose rows lie ldx apart; dweight, with the layout of W, and dbias (out) are added to. Each may be
 * NULL. */
void gnp_dense_backward(size_t rows, size_t in, size_t out, const float *x, size_t ldx, const float *weight, size_t ldw,
                        const float *dy, float *dx, float *dweight, float *dbias);

/* sum (width) += the rows' sum. */
void gnp_rows_sum(size_t rows, size_t width, const float *x, float *sum);

/* x (rows, width) = max(x + bias, 0). */
void gnp_bias_relu(size_t rows, size_t width, const float *bias, float *x);

/* x = max(x, 0), and dx = 0 where that was not x itself. */
void gnp_relu(size_t count, float *x);
void gnp_relu_backward(size_t count, const float *x, float *dx);

#endif
