/* The trunk of a network: its layers for a batch of patches, up to the mean of the values over each patch, which is
 * all that heads ask of them but for `weighted`, which reads the values at the nodes too.
 *
 * A layer is v_i <- sigma(v_i + mix(z_i)), sigma(x) = max(x, 0) but for the last layer's identity, and the integral
 * z_i is a mean over sources j. `edge`: z_i = mean_j K(x_i, x_j) v_j, the sources being the patch's quadrature points
 * (quadrature.h); `separable`: z_i = K2(x_i) mean_j K1(x_j) v_j, all nodes being sources. Kernels are never formed:
 * their last layer is linear, and is contracted with values once a source or once a patch (blocks.h). Two layers of
 * the edge trunk cost little more than their hidden activations: the first, whose values are affine in the features,
 * so that an edge counts by (features + 1) moments, and the last, of which the mean is all that is wanted. `none` has
 * no layers and an empty mean. */
#ifndef GNP_CORE_TRUNK_H
#define GNP_CORE_TRUNK_H

#include <stdbool.h>

#include "core/base/scratch.h"
#include "core/network/network.h"

/* What backward needs of a forward pass. */
struct gnp_trunk_tape;

/* mean (patches, width): of the values of each patch's inner nodes. *tape lies in scratch, as long as what the caller
 * marked before it stays; NULL: not wanted, and nothing stays taken. GNP_OUT_OF_MEMORY, and then the outputs are
 * undefined. */
gnp_status gnp_trunk_forward(const struct gnp_network *network, const struct gnp_network_batch *batch, float *mean,
                             const struct gnp_trunk_tape **tape, struct gnp_scratch *scratch, struct gnp_error *error);

/* The values at the nodes (rows, width) that go into the last layer, of the separable trunk with all nodes inner: in
 * the batch's order. */
const float *gnp_trunk_nodes(const struct gnp_network *network, const struct gnp_trunk_tape *tape);

/* The same mean and values without a tape: nodes (rows, width) out. Nothing stays taken of scratch. */
gnp_status gnp_trunk_forward_nodes(const struct gnp_network *network, const struct gnp_network_batch *batch,
                                   float *mean, float *nodes, struct gnp_scratch *scratch, struct gnp_error *error);

/* Adds d loss / d parameters to gradient (the layout's total), given dmean = d loss / d mean and dnodes = d loss / d
 * values at nodes (gnp_trunk_nodes), or NULL. GNP_OUT_OF_MEMORY. */
gnp_status gnp_trunk_backward(const struct gnp_network *network, const struct gnp_trunk_tape *tape, const float *dmean,
                              const float *dnodes, float *gradient, struct gnp_scratch *scratch,
                              struct gnp_error *error);

/* Floating-point operations in the matrix products of a forward pass, or of a backward pass. */
double gnp_trunk_operations(const struct gnp_network *network, const struct gnp_network_batch *batch, bool backward);

#endif
