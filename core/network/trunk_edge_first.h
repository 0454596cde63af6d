/* The integrals of the first layer, whose values are linear in the features: moments of the hidden activations replace
 * them, so that patches of any size cost one contraction. */
#ifndef GNP_CORE_TRUNK_EDGE_FIRST_H
#define GNP_CORE_TRUNK_EDGE_FIRST_H

#include "core/network/edge_kernel.h"

/* As gnp_integral_fn and gnp_integral_backward_fn of layer 0; kept->z is there. */
bool gnp_trunk_edge_first(const struct gnp_trunk_pass *pass, const struct gnp_edge_kernel *kernel,
                          struct gnp_trunk_kept *kept);
bool gnp_trunk_edge_first_backward(const struct gnp_trunk_pass *pass, const struct gnp_edge_kernel *kernel,
                                   const float *dz, float *dvalues);

#endif
