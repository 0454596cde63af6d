#include "weights/train/train_network.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/model/model.h"
#include "weights/train/initial.h"
#include "weights/train/train_head.h"

struct state {
	struct gnp_architecture architecture;
	struct gnp_layout layout;
	const struct gnp_train_head *head;
	struct gnp_network *network; /* of the parameters last taken; NULL before */
	float *begin;                /* (layout.total) what to begin with; NULL: what is drawn */
};

static void initialize(const void *context, uint64_t seed, float *parameters)
{
	const struct state *state = context;
	if (state->begin)
		memcpy(parameters, state->begin, state->layout.total * sizeof *parameters);
	else
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
                           const double *dcoefficients, float *gradient, struct gnp_scratch *scratch,
                           struct gnp_error *error)
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
	size_t used = (size_t)snprintf(text, size,
	                               "%s %s features %u width %u channels %u neurons %u layers %u quadrature %u head %u",
	                               gnp_trunk_name(a->trunk), gnp_head_name(a->head), a->features, a->width, a->channels,
	                               a->neurons, a->layers, a->quadrature, a->head_width);
	for (unsigned i = 0; i < a->shells && used < size; i++)
		used += (size_t)snprintf(text + used, size - used, "%s%u", i ? "," : " shells ", a->shell[i]);
}

/* Takes what to begin with from a file; name: what the network must be. */
static gnp_status begin_from(struct state *state, const char *from, const char *name, struct gnp_error *error)
{
	struct gnp_model *model = NULL;
	struct gnp_trainable found;
	gnp_status status = gnp_model_load(from, &model, error);
	if (status != GNP_OK)
		return status;
	describe(&model->architecture, found.name, sizeof found.name);
	if (strcmp(found.name, name) != 0)
		status =
			gnp_error_set(error, GNP_INVALID_ARGUMENT, "--from: %.60s is \"%s\", need \"%s\"", from, found.name, name);
	if (status == GNP_OK && !(state->begin = gnp_array_new(state->layout.total, sizeof *state->begin)))
		status = gnp_no_memory("training", state->layout.total, "parameters", error);
	if (status == GNP_OK)
		memcpy(state->begin, model->network->parameters, state->layout.total * sizeof *state->begin);
	gnp_model_free(model);
	return status;
}

gnp_status gnp_train_network_open(const struct gnp_architecture *architecture, const char *from,
                                  struct gnp_trainable *out, struct gnp_error *error)
{
	struct gnp_trainable network = {.initialize = initialize, .load = load, .forward = forward, .backward = backward,
	                                    .operations = operations};
	struct state *state = calloc(1, sizeof *state);
	if (!state)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "training: no memory");
	*state = (struct state){.architecture = *architecture, .head = gnp_train_head_at(architecture->head)};
	network.state = state;
	describe(architecture, network.name, sizeof network.name);
	gnp_status status = gnp_architecture_layout(architecture, &state->layout, error);
	if (status == GNP_OK && from)
		status = begin_from(state, from, network.name, error);
	if (status != GNP_OK) {
		gnp_train_network_close(&network);
		return status;
	}
	network.layout = &state->layout;
	network.parameter_count = state->layout.total;
	network.basis = state->head->basis;
	network.calibrate = state->head->calibrate && !from ? calibrate : NULL;
	*out = network;
	return GNP_OK;
}

void gnp_train_network_close(struct gnp_trainable *network)
{
	struct state *state = network->state;
	if (state) {
		gnp_network_free(state->network);
		free(state->begin);
	}
	free(state);
	*network = (struct gnp_trainable){.state = NULL};
}
