#include "weights/train/train_head.h"

#include "core/fit/taylor.h"
#include "core/network/pooled.h"
#include "weights/train/train_head_parts.h"

/* ---- Pooled, the paper's: the tensor basis of degree 3 ---- */

static struct gnp_network_batch batch_of(const struct gnp_train_patches *patches)
{
	return (struct gnp_network_batch){patches->count, patches->start, patches->inner, patches->nodes};
}

static gnp_status pooled_forward(const struct gnp_network *network, const struct gnp_train_patches *patches,
                                 double *coefficients, void **tape, struct gnp_scratch *scratch, struct gnp_error *error)
{
	struct gnp_network_batch batch = batch_of(patches);
	const struct gnp_pooled_tape *taped = NULL;
	size_t count = patches->count * network->architecture.outputs;
	float *single = gnp_scratch_take(scratch, count, sizeof *single);
	if (!single)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "training: no memory for %zu patches", patches->count);
	gnp_status status = gnp_pooled_forward(network, &batch, single, tape ? &taped : NULL, scratch, error);
	for (size_t i = 0; status == GNP_OK && i < count; i++)
		coefficients[i] = single[i];
	if (tape)
		*tape = (void *)(uintptr_t)taped;
	return status;
}

static gnp_status pooled_backward(const struct gnp_network *network, const struct gnp_train_patches *patches, const void *tape,
                                  const double *dcoefficients, float *gradient, struct gnp_scratch *scratch,
                                  struct gnp_error *error)
{
	size_t count = patches->count * network->architecture.outputs;
	float *single = gnp_scratch_take(scratch, count, sizeof *single);
	if (!single)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "training: no memory for %zu patches", patches->count);
	for (size_t i = 0; i < count; i++)
		single[i] = (float)dcoefficients[i];
	return gnp_pooled_backward(network, tape, single, gradient, scratch, error);
}

static double pooled_operations(const struct gnp_network *network, const struct gnp_train_patches *patches)
{
	struct gnp_network_batch batch = batch_of(patches);
	return gnp_trunk_operations(network, &batch, false) + gnp_trunk_operations(network, &batch, true);
}

static const struct gnp_train_head heads[GNP_HEADS] = {
	[GNP_HEAD_PROJECTION] = {{GNP_BASIS_TAYLOR, GNP_TAYLOR_DEGREE}, gnp_train_projection_forward,
	                         gnp_train_projection_backward, gnp_train_projection_operations, gnp_train_projection_calibrate},
	[GNP_HEAD_POOLED] = {{GNP_BASIS_TENSOR, 3}, pooled_forward, pooled_backward, pooled_operations, NULL},
};

const struct gnp_train_head *gnp_train_head_at(enum gnp_head_kind kind)
{
	return (unsigned)kind < GNP_HEADS ? &heads[kind] : NULL;
}
