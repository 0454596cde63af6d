/* The projection head's row of train_head.c, which alone includes this. */
#ifndef GNP_WEIGHTS_TRAIN_HEAD_PARTS_H
#define GNP_WEIGHTS_TRAIN_HEAD_PARTS_H

#include "weights/train/train_head.h"

gnp_status gnp_train_projection_forward(const struct gnp_network *network, const struct gnp_train_patches *patches,
                                        double *coefficients, void **tape, struct gnp_scratch *scratch, struct gnp_error *error);
gnp_status gnp_train_projection_backward(const struct gnp_network *network, const struct gnp_train_patches *patches, const void *tape,
                                         const double *dcoefficients, float *gradient, struct gnp_scratch *scratch,
                                         struct gnp_error *error);
double gnp_train_projection_operations(const struct gnp_network *network, const struct gnp_train_patches *patches);
gnp_status gnp_train_projection_calibrate(const struct gnp_architecture *architecture, const struct gnp_layout *layout,
                                          const struct gnp_train_patches *sets, size_t count, float *parameters,
                                          struct gnp_scratch *scratch, struct gnp_error *error);

#endif
