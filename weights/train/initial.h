/* Draws the parameters of a network before training. */
#ifndef GNP_WEIGHTS_INITIAL_H
#define GNP_WEIGHTS_INITIAL_H

#include <stdint.h>

#include "core/network/architecture.h"

/* Fills parameters (layout->total). Weights and biases of a linear layer with m inputs are uniform in +-1/sqrt(m), as
 * in PyTorch; the last layer of a kernel, whose outputs are summed against the values of a block too, has the variance
 * 1 / (neurons * block) and no bias, so that a block keeps the size of what it is given; hidden layers of separable
 * kernels keep the size of theirs: sqrt(2), with biases within 1, where they read coordinates, then sqrt(6 / m) and
 * 0.1.
 * The projection head starts as the same for every patch: its last layer's weights are zero. */
void gnp_initial_parameters(const struct gnp_architecture *architecture, const struct gnp_layout *layout, uint64_t seed,
                            float *parameters);

#endif
