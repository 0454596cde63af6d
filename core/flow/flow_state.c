#include "core/flow/flow_state.h"

#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/vector.h"
#include "core/search/order.h"

gnp_status gnp_flow_state_reserve(struct gnp_flow_state *state, size_t count, struct gnp_error *error)
{
	*state = (struct gnp_flow_state){.count = count};
	state->points = gnp_array_new(count, 3 * sizeof *state->points);
	state->normals = gnp_array_new(count, 3 * sizeof *state->normals);
	state->index = gnp_array_new(count, sizeof *state->index);
	state->fixed = gnp_array_zero(count, sizeof *state->fixed);
	state->before = gnp_array_new(count, sizeof *state->before);
	if (!state->points || !state->normals || !state->index || !state->fixed || !state->before) {
		gnp_flow_state_clear(state);
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "flow: no memory for %zu points", count);
	}
	for (size_t i = 0; i < count; i++)
		state->before[i] = NAN;
	return GNP_OK;
}

void gnp_flow_state_clear(struct gnp_flow_state *state)
{
	void *arrays[] = {state->points,   state->normals,        state->index,  state->fixed,     state->before,
	                  state->lift,     state->mean_curvature, state->smooth, state->principal, state->directions,
	                  state->rough,    state->area,           state->apart,      state->gap,    state->corner,
	                  state->shift,
	                  state->neighbor, state->weight};
	for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++)
		free(arrays[i]);
	*state = (struct gnp_flow_state){0};
}

size_t gnp_flow_state_memory(size_t count, bool along, bool tangential, bool edges)
{
	const struct gnp_flow_state *s = NULL;
	size_t carried = 3 * sizeof *s->points + 3 * sizeof *s->normals + sizeof *s->index + sizeof *s->fixed + sizeof *s->before;
	size_t measured = sizeof *s->mean_curvature + sizeof *s->smooth + sizeof *s->rough +
	                  2 * sizeof *s->principal + sizeof *s->area + sizeof *s->apart +
	                  sizeof *s->gap + 3 * sizeof *s->corner + sizeof *s->lift;
	measured += along ? 6 * sizeof *s->directions : 0;
	measured += tangential ? 3 * sizeof *s->shift : 0;
	measured += edges ? GNP_FLOW_EDGES * (sizeof *s->neighbor + sizeof *s->weight) : 0;
	return count * (carried + measured);
}

gnp_status gnp_flow_state_sort(struct gnp_flow_state *state, struct gnp_error *error)
{
	struct gnp_flow_state sorted;
	uint32_t *order = gnp_array_new(state->count, sizeof *order);
	gnp_status status = order ? gnp_order_compute(state->points, state->count, order, error)
	                          : gnp_error_set(error, GNP_OUT_OF_MEMORY, "flow: no memory for %zu points", state->count);
	if (status == GNP_OK)
		status = gnp_flow_state_reserve(&sorted, state->count, error);
	for (size_t i = 0; status == GNP_OK && i < state->count; i++) {
		size_t from = order[i];
		memcpy(sorted.points + 3 * i, state->points + 3 * from, 3 * sizeof(double));
		memcpy(sorted.normals + 3 * i, state->normals + 3 * from, 3 * sizeof(double));
		sorted.index[i] = state->index[from];
		sorted.fixed[i] = state->fixed[from];
		sorted.before[i] = state->before[from];
	}
	free(order);
	if (status != GNP_OK)
		return status;
	gnp_flow_state_clear(state);
	*state = sorted;
	return GNP_OK;
}

gnp_status gnp_flow_state_rank(const struct gnp_flow_state *state, bool fixed_first, uint32_t **order, size_t *fixed,
                               struct gnp_error *error)
{
	int64_t last = -1;
	for (size_t i = 0; i < state->count; i++)
		last = state->index[i] > last ? state->index[i] : last;
	uint32_t *ranked = gnp_array_new(state->count, sizeof *ranked), *at = gnp_array_zero((size_t)(last + 1), sizeof *at);
	if (!ranked || !at) {
		free(ranked);
		free(at);
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "flow: no memory for %zu points", state->count);
	}
	size_t made = 0;
	for (size_t i = 0; i < state->count; i++) {
		if (fixed_first && state->fixed[i])
			ranked[made++] = (uint32_t)i;
		else if (state->index[i] >= 0)
			at[state->index[i]] = (uint32_t)i + 1;
	}
	if (fixed)
		*fixed = made;
	for (int64_t index = 0; index <= last; index++)
		if (at[index])
			ranked[made++] = at[index] - 1;
	for (size_t i = 0; i < state->count; i++)
		if (state->index[i] < 0)
			ranked[made++] = (uint32_t)i;
	free(at);
	*order = ranked;
	return GNP_OK;
}

double gnp_flow_second_form(const struct gnp_flow_state *state, size_t i, const double d[3])
{
	const double *direction = state->directions + 6 * i, a = gnp_dot(d, direction), b = gnp_dot(d, direction + 3);
	return state->principal[2 * i] * a * a + state->principal[2 * i + 1] * b * b;
}

void gnp_flow_normal_along(const struct gnp_flow_state *state, size_t i, const double d[3], double out[3])
{
	const double *direction = state->directions + 6 * i, *k = state->principal + 2 * i;
	double a = k[0] * gnp_dot(d, direction), b = k[1] * gnp_dot(d, direction + 3);
	for (size_t c = 0; c < 3; c++)
		out[c] = state->normals[3 * i + c] - a * direction[c] - b * direction[3 + c];
	double length = sqrt(gnp_dot(out, out));
	for (int c = 0; c < 3; c++)
		out[c] /= length;
}
