/* The paper's head: the trunk's mean over the patch, and an MLP of one hidden layer to Legendre coefficients. */
#ifndef GNP_CORE_POOLED_H
#define GNP_CORE_POOLED_H

#include "core/network/trunk.h"

/* What backward needs of a forward pass. */
struct gnp_pooled_tape;

/* coefficients (patches, outputs): of P_a(v) P_b(u) at 4 a + b, in the patch's scales. *tape as the trunk's.
 * GNP_OUT_OF_MEMORY, and then the outputs are undefined. */
gnp_status gnp_pooled_forward(const struct gnp_network *network, const struct gnp_network_batch *batch,
                              float *coefficients, const struct gnp_pooled_tape **tape, struct gnp_scratch *scratch,
                              struct gnp_error *error);

/* Adds d loss / d parameters to gradient (the layout's total), given d loss / d coefficients. GNP_OUT_OF_MEMORY. */
gnp_status gnp_pooled_backward(const struct gnp_network *network, const struct gnp_pooled_tape *tape,
                               const float *dcoefficients, float *gradient, struct gnp_scratch *scratch,
                               struct gnp_error *error);

#endif
