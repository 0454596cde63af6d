/* The operation `flow`: its descriptor, and the way from tensors to gnp_flow_run and back. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/flow/flow.h"
#include "core/flow/flow_setup.h"
#include "proto/operation/operation_common.h"

/* The core's options, what stands for a model until it is found, and a bit for every wanted output. */
struct options {
	struct gnp_flow_options core;
	char weights[GNP_MODEL_NAME_MAX + 1];
	uint64_t outputs;
};

/* The paper's scheme, for clean clouds: what is taught on noise would not see small features. Semi-implicit steps take
 * clouds of any kind. */
static const char clean_weights[] = "fit_clean_50k";

static const struct gnp_tensor_info inputs[] = {
	GNP_COMMON_INPUTS,
	{"fixed", GNP_BOOL, 1, {-1}, true, "1 where a point stays where it is"},
};

enum output {
	POINTS, NORMALS, MEAN_CURVATURE, INDEX, RECORD,
	SNAPSHOT_START, SNAPSHOT_STEP, SNAPSHOT_TIME, SNAPSHOT_POINTS, SNAPSHOT_NORMALS, SNAPSHOT_MEAN_CURVATURE, OUTPUTS
};
#define ALL_OUTPUTS ((UINT64_C(1) << OUTPUTS) - 1)

static const struct gnp_tensor_info outputs[OUTPUTS] = {
	[POINTS] = {"points", GNP_FP32, 2, {-2, 3}, false, "the cloud at the end [length]"},
	[NORMALS] = {"normals", GNP_FP32, 2, {-2, 3}, false, "outward unit normals, on the side of those at the start"},
	[MEAN_CURVATURE] = {"mean_curvature", GNP_FP32, 1, {-2}, false,
	                    "H at the end, -1/R on a sphere, not smoothed [1/length]"},
	[INDEX] = {"index", GNP_INT64, 1, {-2}, false, "which point of the cloud each one was, from 0; -1: inserted"},
	[RECORD] = {"record", GNP_FP64, 2, {-3, 10}, true,
	            "a row of every state from the start: step, time [length^2], points, area, volume, curvature (largest "
	            "|H|), resolution (curvature times spacing, what singularity bounds), thinned, inserted, seconds since "
	            "the row before"},
	[SNAPSHOT_START] = {"snapshot_start", GNP_INT64, 1, {-6}, true,
	                    "snapshot i has rows snapshot_start[i] to snapshot_start[i + 1] - 1 of those below "
	                    "(snapshot_every)"},
	[SNAPSHOT_STEP] = {"snapshot_step", GNP_INT64, 1, {-5}, true, "the step of each snapshot"},
	[SNAPSHOT_TIME] = {"snapshot_time", GNP_FP64, 1, {-5}, true, "its time [length^2]"},
	[SNAPSHOT_POINTS] = {"snapshot_points", GNP_FP32, 2, {-4, 3}, true,
	                     "its points, those of all snapshots after each other [length]"},
	[SNAPSHOT_NORMALS] = {"snapshot_normals", GNP_FP32, 2, {-4, 3}, true, "their normals"},
	[SNAPSHOT_MEAN_CURVATURE] = {"snapshot_mean_curvature", GNP_FP32, 1, {-4}, true, "their mean curvature [1/length]"},
};
_Static_assert(GNP_FLOW_RECORD_WIDTH == 10, "the table names every column of a record");

/* In the order of the enumerations in flow.h. */
static const char *const schemes[] = {"explicit", "semi_implicit", "conformal", NULL};
static const char *const volumes[] = {"none", "preserve", NULL};

#define FIELD(name) offsetof(struct options, core.name)
static const struct gnp_parameter parameters[] = {
	{"steps", GNP_PARAMETER_INTEGER, FIELD(steps), 1, 1e6, NULL, "how many to take"},
	{"dt", GNP_PARAMETER_AUTO, FIELD(dt), GNP_ABOVE_ZERO, 1e200, NULL,
	 "the step [length^2]; auto: 0.8 of the spacing squared, explicit less as points crowd together, and halved "
	 "where a step cannot be made"},
	{"scheme", GNP_PARAMETER_CHOICE, FIELD(scheme), 0, 0, schemes,
	 "semi_implicit: takes any cloud, edges and noise are rounded first, stable at long steps; explicit: points move "
	 "by dt H along the normal, the paper's, for clouds that resolve their surface; conformal: spheres of genus 0 "
	 "without singularities, points are neither thinned nor inserted"},
	{"volume", GNP_PARAMETER_CHOICE, FIELD(volume), 0, 0, volumes, "preserve: keep the volume of a closed surface"},
	{"smoothing_radius", GNP_PARAMETER_AUTO, FIELD(smoothing_radius), 0, 1e100, NULL,
	 "H is averaged by a Gaussian of this radius [length]; 0: not; auto: 0.6 of the spacing"},
	{"spacing", GNP_PARAMETER_AUTO, FIELD(spacing), 0, 1e100, NULL,
	 "points closer than this are thinned after each step [length]; 0: never; auto: 0.45 of the spacing"},
	{"insertion", GNP_PARAMETER_AUTO, FIELD(insertion), 0, 1e100, NULL,
	 "points are inserted where none is this near on the surface [length]; 0: never; auto: 1.5 times the spacing"},
	{"tangential", GNP_PARAMETER_NUMBER, FIELD(tangential), 0, 1, NULL,
	 "how far points move along the surface towards the middle of their neighbours before each step, which evens them "
	 "out"},
	{"projection", GNP_PARAMETER_NUMBER, FIELD(projection), 0, 1, NULL,
	 "how far points move towards the surface fitted to them before each step, which damps what fits do not see; 0: "
	 "the paper's step"},
	{"singularity", GNP_PARAMETER_AUTO, FIELD(singularity), GNP_ABOVE_ZERO, 1e6, NULL,
	 "the flow stops when curvature times spacing exceeds this: a neck or a point collapses; auto: 0.5, but "
	 "semi_implicit at 10 % of the points more than at the start"},
	{"spacing_limit", GNP_PARAMETER_NUMBER, FIELD(spacing_limit), 1, 1e6, NULL,
	 "the flow stops when points are this many times their spacing at the start apart; more than 1"},
	{"snapshot_every", GNP_PARAMETER_INTEGER, FIELD(snapshot_every), 0, 1e6, NULL,
	 "steps between snapshots of the flow, its start and end among them; 0: none"},
	GNP_COMMON_PARAMETERS(struct options, core.estimate, weights),
	GNP_COMMON_OUTPUTS(struct options),
};
#undef FIELD

static void defaults(void *options)
{
	struct options *o = options;
	o->core = gnp_flow_defaults();
	o->core.estimate.estimator = GNP_ESTIMATOR_GNP;
	o->outputs = ALL_OUTPUTS;
	strcpy(o->weights, GNP_COMMON_AUTO);
}

static gnp_status resolve(void *options, const struct gnp_models *models, struct gnp_error *error)
{
	struct options *o = options;
	if (o->outputs < UINT64_C(1) << SNAPSHOT_START)
		o->core.snapshot_every = 0; /* nobody wants them */
	bool clean = o->core.scheme != GNP_FLOW_SEMI_IMPLICIT && o->core.estimate.estimator == GNP_ESTIMATOR_GNP;
	if (clean && strcmp(o->weights, GNP_COMMON_AUTO) == 0)
		strcpy(o->weights, clean_weights);
	return gnp_common_resolve(&o->core.estimate, o->weights, GNP_COMMON_AUTO, models, error);
}

static bool is_snapshot(int output)
{
	return output >= SNAPSHOT_START;
}

/* Snapshots that are asked for by name have to be made; where all outputs are wanted, those that are not are left
 * out. */
static gnp_status settle_snapshots(const struct gnp_request *request, struct options *o, struct gnp_error *error)
{
	bool by_name = request->output_count || o->outputs != ALL_OUTPUTS;
	for (int output = SNAPSHOT_START; output < OUTPUTS && o->core.snapshot_every == 0; output++) {
		if (by_name && (o->outputs >> output & 1))
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: needs snapshot_every, got 0, need at least 1",
			                     outputs[output].name);
		o->outputs &= ~(UINT64_C(1) << output);
	}
	return GNP_OK;
}

static gnp_status check(struct gnp_call *call, struct gnp_error *error)
{
	struct options *o = (void *)call->options;
	const struct gnp_cloud cloud = {.count = call->points}; /* nothing else of it is looked at */
	gnp_status status = settle_snapshots(call->request, o, error);
	if (status == GNP_OK)
		status = gnp_flow_check(&o->core, &cloud, error);
	if (status != GNP_OK)
		return status;
	return gnp_common_check_points(call, &o->core.estimate, gnp_flow_least_points(&o->core), error);
}

/* On top of the core's: the double copies of points and normals, the mask, and what is copied into the answer. */
static size_t memory(const struct gnp_call *call)
{
	const struct options *options = gnp_call_options(call);
	const struct gnp_flow_options *o = &options->core;
	size_t width = sizeof(int64_t) + 1, core = gnp_flow_memory(call->points, gnp_common_given(call), o);
	size_t records = gnp_common_memory((size_t)o->steps + 1, sizeof(struct gnp_flow_record), core);
	return gnp_common_memory(call->points, width, gnp_common_memory(1, gnp_common_cloud_memory(call), records));
}

static gnp_status add_output(enum output output, struct gnp_flow *flow, enum gnp_datatype type, struct gnp_tensors *to,
                             struct gnp_task *task, struct gnp_error *error)
{
	const struct gnp_tensor_info *info = &outputs[output];
	struct gnp_flow_snapshots *s = &flow->snapshots;
	size_t rows = is_snapshot(output) ? (size_t)s->start[s->count] : flow->count;
	switch (output) {
	case POINTS: return gnp_common_add_numbers(to, info, type, rows, &flow->points, task, error);
	case NORMALS: return gnp_common_add_numbers(to, info, type, rows, &flow->normals, task, error);
	case MEAN_CURVATURE: return gnp_common_add_numbers(to, info, type, rows, &flow->mean_curvature, task, error);
	case INDEX: return gnp_common_add_copy(to, info, rows, flow->index, error);
	case RECORD: return gnp_common_add_copy(to, info, flow->steps + 1, flow->records, error);
	case SNAPSHOT_START: return gnp_common_add_copy(to, info, s->count + 1, s->start, error);
	case SNAPSHOT_STEP: return gnp_common_add_copy(to, info, s->count, s->step, error);
	case SNAPSHOT_TIME: return gnp_common_add_copy(to, info, s->count, s->time, error);
	case SNAPSHOT_POINTS: return gnp_common_add_numbers(to, info, type, rows, &s->points, task, error);
	case SNAPSHOT_NORMALS: return gnp_common_add_numbers(to, info, type, rows, &s->normals, task, error);
	default: return gnp_common_add_numbers(to, info, type, rows, &s->mean_curvature, task, error);
	}
}

static gnp_status add_outputs(uint64_t wanted, struct gnp_flow *flow, enum gnp_datatype type, struct gnp_tensors *to,
                              struct gnp_task *task, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	for (int output = 0; output < OUTPUTS && status == GNP_OK; output++) {
		bool made = !is_snapshot(output) || flow->snapshots.count;
		if (made && (wanted >> output & 1))
			status = add_output((enum output)output, flow, type, to, task, error);
	}
	return status;
}

/* The state at the end and the lengths that were used, under the names of the parameters that set them. */
static gnp_status report_state(const struct gnp_flow *flow, struct gnp_values *report, struct gnp_error *error)
{
	const struct gnp_flow_record *end = &flow->records[flow->steps];
	const struct {
		const char *name;
		double value;
	} numbers[] = {{"time", end->time}, {"area", end->area}, {"volume", end->volume}, {"cloud_spacing", flow->spacing},
	               {"dt", flow->dt}, {"smoothing_radius", flow->smoothing_radius}, {"spacing", flow->thinning},
	               {"insertion", flow->insertion}};
	gnp_status status = GNP_OK;
	for (size_t i = 0; i < sizeof numbers / sizeof numbers[0] && status == GNP_OK; i++) {
		if (isfinite(numbers[i].value))
			status = gnp_values_add_number(report, numbers[i].name, numbers[i].value, error);
	}
	return status;
}

static gnp_status report_end(const struct gnp_flow *flow, struct gnp_values *report, struct gnp_error *error)
{
	gnp_status status = gnp_values_add_string(report, "stop", gnp_flow_stop_name(flow->stop), error);
	if (status == GNP_OK)
		status = gnp_values_add_string(report, "reason", flow->reason, error);
	if (status == GNP_OK)
		status = gnp_values_add_integer(report, "steps", (int64_t)flow->steps, error);
	if (status == GNP_OK)
		status = gnp_values_add_integer(report, "points", (int64_t)flow->count, error);
	return status == GNP_OK ? report_state(flow, report, error) : status;
}

static void warn_of_the_end(const struct gnp_flow *flow, int steps, struct gnp_warnings *warnings)
{
	if (flow->stop != GNP_FLOW_STEPS)
		gnp_warnings_add(warnings, GNP_WARNING_FLOW, "it ended after %zu of %d steps (%s): %s", flow->steps, steps,
		                 gnp_flow_stop_name(flow->stop), flow->reason);
}

static gnp_status add_report(const struct gnp_flow *flow, const struct gnp_flow_options *o, const struct gnp_task *task,
                             struct gnp_values *report, struct gnp_error *error)
{
	const struct gnp_common_facts facts = {.model = flow->model, .normals_estimated = flow->normals_estimated != 0,
	                                       .components = flow->components};
	warn_of_the_end(flow, o->steps, gnp_task_warnings(task));
	gnp_status status = report_end(flow, report, error);
	if (status == GNP_OK)
		status = gnp_common_report(&facts, &o->estimate, report, error);
	return status == GNP_OK ? gnp_common_report_end(&facts, task, report, error) : status;
}

static gnp_status run(const struct gnp_call *call, struct gnp_pool *pool, struct gnp_task *task,
                      struct gnp_response *response, struct gnp_error *error)
{
	const struct options *o = gnp_call_options(call);
	struct gnp_common_cloud input = {0};
	struct gnp_flow flow = {0};
	unsigned char *fixed = NULL;
	gnp_status status = gnp_common_cloud_read(call->request, &input, error);
	if (status == GNP_OK)
		status = gnp_common_mask_read(call->request, "fixed", &fixed, error);
	if (status != GNP_OK)
		goto done;
	struct gnp_cloud cloud = {input.count, input.points, input.normals};
	status = gnp_flow_run_kept(&cloud, fixed, &o->core, call->checkpoint, pool, task, &flow, error);
	gnp_task_stage(task, GNP_STAGE_ENCODE, 0);
	if (status == GNP_OK)
		status = add_outputs(o->outputs, &flow, input.type, &response->outputs, task, error);
	if (status == GNP_OK)
		status = add_report(&flow, &o->core, task, &response->parameters, error);
done:
	gnp_flow_clear(&flow);
	free(fixed);
	gnp_common_cloud_clear(&input);
	return status;
}

GNP_OPERATION(flow, "Mean-curvature flow of a cloud, x_t = H n: surfaces smooth, spheres shrink by R^2 = R0^2 - 2 t.",
              .resolve = resolve);
