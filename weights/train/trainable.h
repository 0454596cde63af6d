/* What is trained, as the loop sees it: a function from patches and parameters to the coefficients of surfaces, and its
 * derivative. */
#ifndef GNP_WEIGHTS_TRAINABLE_H
#define GNP_WEIGHTS_TRAINABLE_H

#include "core/fit/legendre.h"
#include "core/network/architecture.h"
#include "weights/train/train_patches.h"

struct gnp_trainable {
	char name[160];         /* tells it from networks whose parameters it could not take */
	size_t parameter_count;
	const struct gnp_layout *layout; /* of its parameters; NULL: they are no tensors */
	struct gnp_basis basis; /* h = scale_w sum_i c_i phi_i(u, v) */
	void *state;
	/* Fresh parameters (parameter_count) for a seed. */
	void (*initialize)(const void *state, uint64_t seed, float *parameters);
	/* Sets those of them that follow from data and are not trained, such as means of inputs; NULL: there are none.
	 * Before the first step, with sets (count) of patches of several clouds. */
	gnp_status (*calibrate)(const void *state, const struct gnp_train_patches *sets, size_t count, float *parameters,
	                        struct gnp_scratch *scratch, struct gnp_error *error);
	/* Takes parameters, which stay as they are until the next call, before they are used. Not thread-safe. */
	gnp_status (*load)(void *state, const float *parameters, struct gnp_error *error);
	/* coefficients (patches, size of the basis) out. *tape, in scratch, holds what backward needs; NULL: not wanted. */
	gnp_status (*forward)(const void *state, const struct gnp_train_patches *patches, double *coefficients, void **tape,
	                      struct gnp_scratch *scratch, struct gnp_error *error);
	/* Adds d loss / d parameters (parameter_count) to gradient, given d loss / d coefficients. */
	gnp_status (*backward)(const void *state, const struct gnp_train_patches *patches, const void *tape,
	                       const double *dcoefficients, float *gradient, struct gnp_scratch *scratch, struct gnp_error *error);
	/* Floating-point operations in matrix products of a forward and a backward pass; NULL: not told. */
	double (*operations)(const void *state, const struct gnp_train_patches *patches);
};

#endif
