#include "core/flow/flow_result.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/flow/flow_state.h"

const char *gnp_flow_stop_name(enum gnp_flow_stop stop)
{
	static const char *const names[] = {"steps", "singularity", "spacing", "unstable", "not_finite", "vanished"};
	return (unsigned)stop < sizeof names / sizeof *names ? names[stop] : "unknown";
}

void gnp_flow_result_stop(struct gnp_flow *result, enum gnp_flow_stop why, const char *format, ...)
{
	va_list arguments;
	va_start(arguments, format);
	vsnprintf(result->reason, sizeof result->reason, format, arguments);
	va_end(arguments);
	result->stop = why;
}

void gnp_flow_clear(struct gnp_flow *flow)
{
	free(flow->points);
	free(flow->normals);
	free(flow->mean_curvature);
	free(flow->index);
	free(flow->records);
	free(flow->snapshots.start);
	free(flow->snapshots.step);
	free(flow->snapshots.time);
	free(flow->snapshots.points);
	free(flow->snapshots.normals);
	free(flow->snapshots.mean_curvature);
	*flow = (struct gnp_flow){0};
}

/* Makes room for count items; the array's pointer is at `array`. Growing by little is cheap: the C library moves pages,
 * not bytes. */
static bool extend(void *array, size_t count, size_t size)
{
	void *old, *new;
	size_t bytes;
	memcpy(&old, array, sizeof old);
	if (!gnp_size_multiply(count, size, &bytes) || !(new = realloc(old, bytes ? bytes : 1)))
		return false;
	memcpy(array, &new, sizeof new);
	return true;
}

static void copy_rows(const struct gnp_flow_state *state, const uint32_t *ranked, double *points, double *normals,
                      double *curvature)
{
	for (size_t i = 0; i < state->count; i++) {
		memcpy(points + 3 * i, state->points + 3 * (size_t)ranked[i], 3 * sizeof *points);
		memcpy(normals + 3 * i, state->normals + 3 * (size_t)ranked[i], 3 * sizeof *normals);
		curvature[i] = state->mean_curvature[ranked[i]];
	}
}

gnp_status gnp_flow_result_snapshot(struct gnp_flow *result, const struct gnp_flow_state *state,
                                    const struct gnp_flow_record *record, struct gnp_error *error)
{
	struct gnp_flow_snapshots *s = &result->snapshots;
	size_t first = s->count ? s->start[s->count] : 0, total = first + state->count;
	if (!extend(&s->start, s->count + 2, sizeof *s->start) || !extend(&s->step, s->count + 1, sizeof *s->step) ||
	    !extend(&s->time, s->count + 1, sizeof *s->time) || !extend(&s->points, total, 3 * sizeof(double)) ||
	    !extend(&s->normals, total, 3 * sizeof(double)) || !extend(&s->mean_curvature, total, sizeof(double)))
		return gnp_no_memory("flow", state->count, "points of its results", error);
	uint32_t *ranked;
	gnp_status status = gnp_flow_state_rank(state, false, &ranked, NULL, error);
	if (status != GNP_OK)
		return status;
	copy_rows(state, ranked, s->points + 3 * first, s->normals + 3 * first, s->mean_curvature + first);
	s->start[s->count] = first;
	s->start[s->count + 1] = total;
	s->step[s->count] = (uint64_t)record->step;
	s->time[s->count++] = record->time;
	free(ranked);
	return GNP_OK;
}

gnp_status gnp_flow_result_record(struct gnp_flow *result, const struct gnp_flow_record *record,
                                  struct gnp_error *error)
{
	size_t row = (size_t)record->step;
	if (!extend(&result->records, row + 1, sizeof *result->records))
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "flow: no memory for %zu records", row + 1);
	result->records[row] = *record;
	result->steps = row;
	return GNP_OK;
}

gnp_status gnp_flow_result_take(struct gnp_flow *result, const struct gnp_flow_state *state, struct gnp_error *error)
{
	uint32_t *ranked;
	gnp_status status = gnp_flow_state_rank(state, false, &ranked, NULL, error);
	if (status != GNP_OK)
		return status;
	result->count = state->count;
	result->points = gnp_array_new(state->count, 3 * sizeof(double));
	result->normals = gnp_array_new(state->count, 3 * sizeof(double));
	result->mean_curvature = gnp_array_new(state->count, sizeof(double));
	result->index = gnp_array_new(state->count, sizeof *result->index);
	if (!result->points || !result->normals || !result->mean_curvature || !result->index) {
		free(ranked);
		return gnp_no_memory("flow", state->count, "points of its results", error);
	}
	copy_rows(state, ranked, result->points, result->normals, result->mean_curvature);
	for (size_t i = 0; i < state->count; i++)
		result->index[i] = state->index[ranked[i]];
	free(ranked);
	return GNP_OK;
}
