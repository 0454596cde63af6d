#include "weights/train/train_network.h"

#include <stdio.h>
#include <stdlib.h>

#include "weights/train/initial.h"
#include "weights/train/train_head.h"

struct state {
	struct gnp_architecture architecture;
	struct gnp_layout layout;
	const struct gnp_train_head *head;
	struct gnp_network *network; /* of the parameters last taken; NULL before */
};

static void initialize(const void *context, uint64_t seed, float *parameters)
{
	const struct state *state = context;
	gnp_initial_parameters(&state->architecture, &state->layout, seed, parameters);
}

static gnp_status calibrate(const void *context, const struct gnp_train_patches *sets, size_t count, float *parameters,
                            struct gnp_scratch *scratch, struct gnp_error *error)
{
	const struct state *state = context;
	return state->head->calibrate(&state->architecture, &state->layout, sets, count, parameters, scratch, error);
}

static gnp_status load(void *context, const float *parameters, struct gnp_error *error)
{
	struct state *state = context;
	gnp_network_free(state->network);
	state->network = NULL;
	return gnp_network_create(&state->architecture, parameters, &state->network, error);
}

static gnp_status forward(const void *context, const struct gnp_train_patches *patches, double *coefficients,
                          void **tape, struct gnp_scratch *scratch, struct gnp_error *error)
{
	const struct state *state = context;
	return state->head->forward(state->network, patches, coefficients, tape, scratch, error);
}

static gnp_status backward(const void *context, const struct gnp_train_patches *patches, const void *tape,
                           const double *dcoefficients, float *gradient, struct gnp_scratch *scratch, struct gnp_error *error)
{
	const struct state *state = context;
	return state->head->backward(state->network, patches, tape, dcoefficients, gradient, scratch, error);
}

static double operations(const void *context, const struct gnp_train_patches *patches)
{
	const struct state *state = context;
	return state->head->operations(state->network, patches);
}

static void describe(const struct gnp_architecture *a, char *text, size_t size)
{
	size_t used = (size_t)snprintf(text, size, "%s %s features %u width %u channels %u neurons %u layers %u quadrature %u head %u",
	                               gnp_trunk_name(a->trunk), gnp_head_name(a->head), a->features, a->width, a->channels,
	                               a->neurons, a->layers, a->quadrature, a->head_width);
	for (unsigned i = 0; i < a->shells && used < size; i++)
		used += (size_t)snprintf(text + used, size - used, "%s%u", i ? "," : " shells ", a->shell[i]);
}

gnp_status gnp_train_network_open(const struct gnp_architecture *architecture, struct gnp_trainable *out,
                                   struct gnp_error *error)
{
	struct gnp_trainable network = {.initialize = initialize, .load = load, .forward = forward, .backward = backward,
	                                    .operations = operations};
	struct state *state = calloc(1, sizeof *state);
	if (!state)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "training: no memory");
	*state = (struct state){.architecture = *architecture, .head = gnp_train_head_at(architecture->head)};
	gnp_status status = gnp_architecture_layout(architecture, &state->layout, error);
	if (status != GNP_OK) {
		free(state);
		return status;
	}
	describe(architecture, network.name, sizeof network.name);
	network.state = state;
	network.parameter_count = state->layout.total;
	network.basis = state->head->basis;
	network.calibrate = state->head->calibrate ? calibrate : NULL;
	*out = network;
	return GNP_OK;
}

void gnp_train_network_close(struct gnp_trainable *network)
{
	struct state *state = network->state;
	if (state)
		gnp_network_free(state->network);
	free(state);
	*network = (struct gnp_trainable){.state = NULL};
}
