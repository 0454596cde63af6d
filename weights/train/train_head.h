/* Heads in training: how patches become coefficients of surfaces, trunk and all, and the way back. One row a head. */
#ifndef GNP_WEIGHTS_TRAIN_HEAD_H
#define GNP_WEIGHTS_TRAIN_HEAD_H

#include "core/fit/legendre.h"
#include "core/network/network.h"
#include "weights/train/train_patches.h"

struct gnp_train_head {
	struct gnp_basis basis; /* of its surfaces */
	/* As of trainable.h, with the operator of the parameters taken last; calibrate may be NULL. */
	gnp_status (*forward)(const struct gnp_network *network, const struct gnp_train_patches *patches, double *coefficients,
	                      void **tape, struct gnp_scratch *scratch, struct gnp_error *error);
	gnp_status (*backward)(const struct gnp_network *network, const struct gnp_train_patches *patches, const void *tape,
	                       const double *dcoefficients, float *gradient, struct gnp_scratch *scratch, struct gnp_error *error);
	double (*operations)(const struct gnp_network *network, const struct gnp_train_patches *patches);
	gnp_status (*calibrate)(const struct gnp_architecture *architecture, const struct gnp_layout *layout,
	                        const struct gnp_train_patches *sets, size_t count, float *parameters, struct gnp_scratch *scratch,
	                        struct gnp_error *error);
};

/* The row of a head; NULL past the last. */
const struct gnp_train_head *gnp_train_head_at(enum gnp_head_kind kind);

#endif
