#include "core/flow/flow.h"

#include <stdlib.h>
#include <string.h>

#include "core/flow/conformal.h"
#include "core/flow/flow_checkpoint.h"
#include "core/flow/flow_rules.h"
#include "core/flow/flow_setup.h"
#include "core/model/model.h"

enum { HALVINGS_MOST = 8 };

/* A flow under way. */
struct flow {
	const struct gnp_flow_options *options;
	struct gnp_pool *pool;
	struct gnp_task *task;
	struct gnp_flow_rule rule;
	struct gnp_flow_move move;
	struct gnp_flow_state now;        /* measured */
	struct gnp_conformal *conformal;  /* NULL with the other schemes */
	size_t unsorted;                  /* points inserted since the points were put in curve order */
	double time;                      /* of the state [length^2] */
	double clock;                     /* when the row before was made */
	size_t cloud_count;
	const struct gnp_checkpoint *checkpoint; /* NULL: none is kept */
	double keep_after;                /* gnp_clock() */
	size_t kept;                      /* the step that was kept last */
	char request[GNP_SHA256_TEXT];    /* of the checkpoint's flow */
	struct gnp_flow result;
};

/* ---- States ---- */

static gnp_status measure_by_estimate(struct flow *flow, struct gnp_flow_state *state, bool *finite,
                                      struct gnp_error *error)
{
	struct gnp_task part;
	gnp_task_init_part(&part, flow->task);
	gnp_status status = gnp_flow_measure(state, &flow->rule, flow->pool, &part, &flow->result.model, finite, error);
	gnp_task_book_part(flow->task, &part);
	return status;
}

/* Measures the next state; where it cannot be, *usable is false and the reason set. */
static gnp_status measure_next(struct flow *flow, struct gnp_flow_state *next, bool *usable, struct gnp_error *error)
{
	size_t least = gnp_flow_least_points(flow->options);
	struct gnp_error cause = {0};
	gnp_status status;
	*usable = false;
	if (next->count < least) {
		gnp_flow_result_stop(&flow->result, GNP_FLOW_VANISHED, "%zu points would be left, need at least %zu",
		                     next->count, least);
		return GNP_OK;
	}
	if (flow->conformal)
		status = gnp_conformal_measure(flow->conformal, next, flow->rule.origin, flow->pool, flow->task, usable, &cause);
	else
		status = measure_by_estimate(flow, next, usable, &cause);
	if (status == GNP_DEGENERATE) {
		gnp_flow_result_stop(&flow->result, GNP_FLOW_VANISHED, "the points no longer determine a surface: %.180s",
		                     cause.text);
		return GNP_OK;
	}
	if (status != GNP_OK)
		return gnp_error_set(error, status, "%s", cause.text);
	if (!*usable)
		gnp_flow_result_stop(&flow->result, GNP_FLOW_NOT_FINITE,
		                     "the geometry after the next step is not finite somewhere");
	return GNP_OK;
}

static gnp_status make_conformal(struct flow *flow, struct gnp_flow_state *next, struct gnp_task *task,
                                 struct gnp_error *error)
{
	double volume = flow->move.preserve ? flow->move.volume : 0;
	return gnp_conformal_step(flow->conformal, &flow->now, flow->move.dt, volume, flow->pool, task, next, error);
}

/* *made false: the step would be too far, and the reason is set. */
static gnp_status make_next(struct flow *flow, struct gnp_flow_state *next, struct gnp_flow_moved *moved, bool *made,
                            struct gnp_error *error)
{
	struct gnp_task part; /* whose solutions count points, while the flow counts steps */
	gnp_task_init_part(&part, flow->task);
	gnp_status status = flow->conformal ? make_conformal(flow, next, &part, error)
	                                    : gnp_flow_step(&flow->now, &flow->move, flow->pool, &part, next, moved, error);
	*made = status == GNP_OK && moved->too_far <= 1;
	if (status != GNP_OK || *made)
		return status;
	const char *than = flow->move.scheme == GNP_FLOW_EXPLICIT ? "half their spacing" : "half their radius of curvature";
	gnp_flow_result_stop(&flow->result, GNP_FLOW_UNSTABLE,
	     "dt: got %g, a step would move points by %.3g times %s, need at most 1: take at most %.3g, or more smoothing",
	     flow->move.dt, moved->too_far, than, flow->move.dt / moved->too_far);
	return GNP_OK;
}

static gnp_status sort_if_scattered(struct flow *flow, struct gnp_flow_state *state, size_t inserted,
                                    struct gnp_error *error)
{
	enum { SHARE = 64 };
	flow->unsorted += inserted;
	if (flow->unsorted * SHARE <= state->count)
		return GNP_OK;
	flow->unsorted = 0;
	return gnp_flow_state_sort(state, error);
}

static gnp_status record(struct flow *flow, size_t step, const struct gnp_flow_moved *moved, struct gnp_error *error)
{
	const struct gnp_flow_state *now = &flow->now;
	int every = flow->options->snapshot_every;
	double clock = gnp_clock();
	const struct gnp_flow_record row = {.step = (double)step, .time = flow->time, .points = (double)now->count,
	                                    .area = now->total_area, .volume = now->volume, .curvature = now->curvature,
	                                    .resolution = now->resolution, .thinned = (double)moved->thinned,
	                                    .inserted = (double)moved->inserted, .seconds = clock - flow->clock};
	flow->clock = clock;
	gnp_status status = gnp_flow_result_record(&flow->result, &row, error);
	if (status == GNP_OK && every && step % (size_t)every == 0)
		status = gnp_flow_result_snapshot(&flow->result, now, &row, error);
	return status;
}

/* A step that is left open goes by the start's spacing, explicit ones by the densest points. */
static void follow_spacing(struct flow *flow)
{
	flow->move.dt = gnp_flow_default_step(flow->options, &flow->result, flow->now.dense);
}

/* *next: measured; *usable false: it cannot be, and the reason is set. */
static gnp_status try_step(struct flow *flow, struct gnp_flow_state *next, struct gnp_flow_moved *moved, bool *usable,
                           struct gnp_error *error)
{
	gnp_status status = make_next(flow, next, moved, usable, error);
	if (status == GNP_OK)
		status = gnp_task_check(flow->task, error); /* much of a step is serial, and so is sorting */
	if (status == GNP_OK && *usable)
		status = sort_if_scattered(flow, next, moved->inserted, error);
	if (status == GNP_OK && *usable)
		status = measure_next(flow, next, usable, error);
	if (status != GNP_OK || !*usable)
		gnp_flow_state_clear(next);
	return status;
}

/* A dt that is left open is halved until the step can be made. *stopped: it cannot, the reason is set, and the state is
 * the one before. */
static gnp_status advance(struct flow *flow, size_t step, bool *stopped, struct gnp_error *error)
{
	struct gnp_flow_state next = {0};
	struct gnp_flow_moved moved = {0};
	bool usable = false;
	int halvings = isnan(flow->options->dt) && !flow->conformal ? HALVINGS_MOST : 0;
	size_t unsorted = flow->unsorted;
	gnp_status status = try_step(flow, &next, &moved, &usable, error);
	for (; status == GNP_OK && !usable && halvings > 0; halvings--) {
		flow->move.dt /= 2;
		flow->unsorted = unsorted;
		status = try_step(flow, &next, &moved, &usable, error);
	}
	*stopped = !usable;
	if (status != GNP_OK || !usable)
		return status;
	gnp_flow_state_clear(&flow->now);
	flow->now = next;
	flow->time += flow->move.dt;
	return record(flow, step, &moved, error);
}

/* ---- Checkpoints ---- */

/* Of the time a flow takes, at most a tenth goes into checkpoints, unless one is wanted of every step. */
static const double COST = 10;

static struct gnp_flow_middle middle_of(struct flow *flow)
{
	return (struct gnp_flow_middle){.now = &flow->now, .result = &flow->result, .cloud_count = flow->cloud_count,
	                                .steps_most = (size_t)flow->options->steps, .conformal = flow->conformal != NULL, .time = &flow->time,
	                                .dt = &flow->move.dt, .unsorted = &flow->unsorted, .request = flow->request};
}

/* The flow goes on without, where it cannot be kept. */
static void keep(struct flow *flow)
{
	struct gnp_flow_middle middle = middle_of(flow);
	double begun = gnp_clock();
	if (!flow->checkpoint || flow->kept == flow->result.steps)
		return;
	if (gnp_flow_checkpoint_save(&middle, flow->checkpoint, NULL) == GNP_OK)
		flow->kept = flow->result.steps;
	double now = gnp_clock();
	flow->keep_after = flow->checkpoint->seconds > 0 ? now + fmax(flow->checkpoint->seconds, COST * (now - begun)) : now;
}

/* From the start to where it was kept; what is not this flow's is left aside. */
static void take_up(struct flow *flow, const struct gnp_cloud *cloud, const unsigned char *fixed)
{
	struct gnp_flow_middle middle = middle_of(flow);
	if (!flow->checkpoint)
		return;
	gnp_flow_checkpoint_request(cloud, fixed, flow->options, flow->result.model, flow->request);
	flow->keep_after = gnp_clock() + flow->checkpoint->seconds;
	if (flow->checkpoint->kept && gnp_flow_checkpoint_load(&middle, flow->checkpoint->kept, flow->checkpoint->size, NULL) == GNP_OK)
		flow->kept = flow->result.steps;
	flow->clock = gnp_clock();
}

static const char *advice(const struct flow *flow)
{
	if (flow->result.stop != GNP_FLOW_SINGULARITY)
		return "";
	return flow->move.scheme == GNP_FLOW_EXPLICIT
	           ? ": take scheme=semi_implicit, which rounds such places first, or smooth the cloud before"
	           : ": take singularity=auto, or smooth the cloud before";
}

static gnp_status take_steps(struct flow *flow, struct gnp_error *error)
{
	size_t steps = (size_t)flow->options->steps;
	gnp_task_stage(flow->task, GNP_STAGE_FLOW, steps);
	gnp_task_skip(flow->task, flow->result.steps);
	for (size_t step = flow->result.steps + 1; step <= steps; step++) {
		follow_spacing(flow);
		bool stopped = !gnp_flow_may_go_on(flow->options, &flow->move, &flow->now, &flow->result);
		gnp_status status = stopped ? GNP_OK : advance(flow, step, &stopped, error);
		if (status == GNP_OK && stopped && step == 1)
			status = gnp_error_set(error, GNP_INVALID_ARGUMENT, "flow: no step can be taken (%s): %s%s",
			                       gnp_flow_stop_name(flow->result.stop), flow->result.reason, advice(flow));
		if (status == GNP_DRAINING)
			keep(flow);
		if (status != GNP_OK || stopped)
			return status;
		gnp_task_advance(flow->task, 1);
		if (flow->checkpoint && gnp_clock() >= flow->keep_after)
			keep(flow);
	}
	gnp_flow_result_stop(&flow->result, GNP_FLOW_STEPS, "all %zu steps were taken", steps);
	return GNP_OK;
}

/* ---- Start and end ---- */

static gnp_status set_start(struct flow *flow, const struct gnp_prepared *prepared, const unsigned char *fixed,
                            struct gnp_error *error)
{
	struct gnp_flow_state *now = &flow->now;
	gnp_status status = gnp_flow_state_reserve(now, prepared->count, error);
	if (status != GNP_OK)
		return status;
	memcpy(now->points, prepared->points, 3 * now->count * sizeof *now->points);
	memcpy(now->normals, prepared->normals, 3 * now->count * sizeof *now->normals);
	for (size_t i = 0; i < now->count; i++) {
		now->index[i] = prepared->order[i];
		now->fixed[i] = fixed && fixed[prepared->order[i]];
	}
	return GNP_OK;
}

/* The model that the start was measured by stays the flow's. The start was judged, steps are not: what they become is
 * for the rules that stop a flow. */
static void keep_model(struct flow *flow)
{
	flow->rule.estimate.unjudged = true;
	if (flow->result.model)
		flow->rule.estimate.model = flow->result.model;
}

static gnp_status measure_start(struct flow *flow, struct gnp_error *error)
{
	bool finite;
	gnp_status status = measure_by_estimate(flow, &flow->now, &finite, error);
	if (status == GNP_OK && !finite)
		status = gnp_error_set(error, GNP_DEGENERATE, "flow: the geometry at the start is not finite somewhere");
	if (status != GNP_OK)
		return status;
	keep_model(flow);
	flow->move.volume = flow->now.volume;
	flow->result.unresolved = flow->now.unresolved;
	if (flow->options->scheme == GNP_FLOW_CONFORMAL)
		status = gnp_conformal_create(&flow->now, flow->task, &flow->conformal, error);
	return status == GNP_OK ? record(flow, 0, &(struct gnp_flow_moved){0}, error) : status;
}

static gnp_status begin(struct flow *flow, const struct gnp_cloud *cloud, const unsigned char *fixed,
                        struct gnp_error *error)
{
	struct gnp_prepared prepared;
	gnp_status status = gnp_prepare(cloud, flow->pool, flow->task, &prepared, error);
	if (status != GNP_OK)
		return status;
	flow->result.normals_estimated = !cloud->normals;
	flow->result.components = prepared.components;
	gnp_task_stage(flow->task, GNP_STAGE_PREPARE, prepared.count);
	status = gnp_flow_setup(flow->options, &prepared, flow->pool, flow->task, &flow->rule, &flow->move,
	                        &flow->result, error);
	if (status == GNP_OK)
		status = set_start(flow, &prepared, fixed, error);
	gnp_prepared_clear(&prepared);
	flow->result.dt = flow->move.dt;
	flow->result.smoothing_radius = flow->rule.smoothing;
	flow->result.thinning = flow->move.thinning;
	flow->result.insertion = flow->move.insertion;
	return status == GNP_OK ? measure_start(flow, error) : status;
}

/* During the flow, geometry came from triangle fans. The cloud at the end is measured once more by the estimator,
 * unless that finds no surface any more. */
static gnp_status estimate_end(struct flow *flow, struct gnp_error *error)
{
	struct gnp_flow_state end;
	bool finite = false;
	struct gnp_error cause = {0};
	gnp_status status = gnp_flow_state_reserve(&end, flow->now.count, error);
	if (status != GNP_OK)
		return status;
	memcpy(end.points, flow->now.points, 3 * end.count * sizeof *end.points);
	memcpy(end.normals, flow->now.normals, 3 * end.count * sizeof *end.normals);
	memcpy(end.index, flow->now.index, end.count * sizeof *end.index);
	status = gnp_flow_state_sort(&end, error);
	if (status == GNP_OK)
		status = measure_by_estimate(flow, &end, &finite, &cause);
	if (status == GNP_OK && finite) {
		gnp_flow_state_clear(&flow->now);
		flow->now = end;
		return GNP_OK;
	}
	gnp_flow_state_clear(&end);
	return status == GNP_OK || status == GNP_DEGENERATE ? GNP_OK : gnp_error_set(error, status, "%s", cause.text);
}

/* The end is a snapshot too, unless it was its turn. */
static gnp_status finish(struct flow *flow, struct gnp_error *error)
{
	struct gnp_flow *result = &flow->result;
	const struct gnp_flow_snapshots *shots = &result->snapshots;
	gnp_status status = flow->conformal ? estimate_end(flow, error) : GNP_OK;
	if (status == GNP_OK && shots->count && shots->step[shots->count - 1] != result->steps)
		status = gnp_flow_result_snapshot(result, &flow->now, &result->records[result->steps], error);
	return status == GNP_OK ? gnp_flow_result_take(result, &flow->now, error) : status;
}

gnp_status gnp_flow_run(const struct gnp_cloud *cloud, const unsigned char *fixed,
                        const struct gnp_flow_options *options, struct gnp_pool *pool, struct gnp_task *task,
                        struct gnp_flow *out, struct gnp_error *error)
{
	return gnp_flow_run_kept(cloud, fixed, options, NULL, pool, task, out, error);
}

gnp_status gnp_flow_run_kept(const struct gnp_cloud *cloud, const unsigned char *fixed,
                             const struct gnp_flow_options *options, const struct gnp_checkpoint *checkpoint,
                             struct gnp_pool *pool, struct gnp_task *task, struct gnp_flow *out,
                             struct gnp_error *error)
{
	struct flow flow = {.options = options, .pool = pool, .task = task, .clock = gnp_clock(), .cloud_count = cloud->count,
	                    .checkpoint = checkpoint};
	gnp_status status = gnp_flow_check(options, cloud, error);
	if (status == GNP_OK)
		status = gnp_cloud_check(cloud, gnp_flow_least_points(options), error);
	if (status == GNP_OK)
		status = begin(&flow, cloud, fixed, error);
	if (status == GNP_OK)
		take_up(&flow, cloud, fixed);
	if (status == GNP_OK)
		status = take_steps(&flow, error);
	if (status == GNP_OK)
		status = finish(&flow, error);
	gnp_task_stage(task, GNP_STAGE_DONE, 0);
	gnp_conformal_free(flow.conformal);
	gnp_flow_state_clear(&flow.now);
	if (status == GNP_OK)
		*out = flow.result;
	else
		gnp_flow_clear(&flow.result);
	return status;
}
