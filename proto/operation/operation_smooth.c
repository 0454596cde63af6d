/* The operation `smooth`: its descriptor, and the way from tensors to gnp_smooth_run and back. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/flow/smooth.h"
#include "proto/operation/operation_common.h"

/* The core's options, what stands for a model until it is found, and a bit for every wanted output. */
struct options {
	struct gnp_smooth_options core;
	char weights[GNP_MODEL_NAME_MAX + 1];
	int volume; /* 1: kept */
	uint64_t outputs;
};

static const struct gnp_tensor_info inputs[] = {
	GNP_COMMON_INPUTS,
	{"fixed", GNP_BOOL, 1, {-1}, true, "1 where a point stays where it is"},
};

enum output { POINTS, NORMALS, MOVED, OUTPUTS };

static const struct gnp_tensor_info outputs[OUTPUTS] = {
	[POINTS] = {"points", GNP_FP32, 2, {-2, 3}, false, "the cloud without its noise, point by point [length]"},
	[NORMALS] = {"normals", GNP_FP32, 2, {-2, 3}, false, "outward unit normals of its surface"},
	[MOVED] = {"moved", GNP_FP32, 1, {-2}, false, "how far each point went along its normal [length]"},
};

/* In the order of the enumerations in smooth.h, and of `preserve`. */
static const char *const features[] = {"round", "keep", NULL};
static const char *const volumes[] = {"none", "preserve", NULL};

#define FIELD(name) offsetof(struct options, core.name)
static const struct gnp_parameter parameters[] = {
	{"noise", GNP_PARAMETER_AUTO, FIELD(noise), GNP_ABOVE_ZERO, 1e100, NULL,
	 "the standard deviation of what is to go [length]; no point moves more than four times as far; auto: what the "
	 "fitted surfaces say it is"},
	{"features", GNP_PARAMETER_CHOICE, FIELD(features), 0, 0, features,
	 "keep: nothing is evened out across edges; round: it is"},
	{"volume", GNP_PARAMETER_CHOICE, offsetof(struct options, volume), 0, 0, volumes,
	 "preserve: what all points about a place have moved the same way is taken back"},
	{"rounds", GNP_PARAMETER_INTEGER, FIELD(rounds), 1, 20, NULL,
	 "how many times surfaces are fitted and points evened out"},
	GNP_COMMON_PARAMETERS(struct options, core.estimate, weights),
	GNP_COMMON_OUTPUTS(struct options),
};
#undef FIELD

static void defaults(void *options)
{
	struct options *o = options;
	o->core = gnp_smooth_defaults();
	o->core.estimate.estimator = GNP_ESTIMATOR_GNP;
	o->volume = o->core.preserve;
	o->outputs = (UINT64_C(1) << OUTPUTS) - 1;
	strcpy(o->weights, GNP_COMMON_AUTO);
}

static gnp_status resolve(void *options, const struct gnp_models *models, struct gnp_error *error)
{
	struct options *o = options;
	return gnp_common_resolve(&o->core.estimate, o->weights, GNP_COMMON_AUTO, models, error);
}

static gnp_status check(struct gnp_call *call, struct gnp_error *error)
{
	struct options *o = (void *)call->options;
	o->core.preserve = o->volume == 1;
	gnp_status status = gnp_smooth_check(&o->core, error);
	return status == GNP_OK ? gnp_common_check_points(call, &o->core.estimate, 0, error) : status;
}

static size_t rows(const struct gnp_call *call, int64_t extent)
{
	return extent == -2 ? call->points : GNP_ROWS_OPEN;
}

/* On top of the core's: the double copies of points and normals, and the mask. */
static size_t memory(const struct gnp_call *call)
{
	const struct options *o = gnp_call_options(call);
	size_t core = gnp_smooth_memory(call->points, gnp_common_given(call), &o->core);
	return gnp_common_memory(call->points, 1, gnp_common_memory(1, gnp_common_cloud_memory(call), core));
}

static gnp_status add_outputs(uint64_t wanted, struct gnp_smooth *smooth, enum gnp_datatype type,
                              struct gnp_tensors *to, struct gnp_task *task, struct gnp_error *error)
{
	double **const values[OUTPUTS] = {&smooth->points, &smooth->normals, &smooth->moved};
	gnp_status status = GNP_OK;
	for (int output = 0; output < OUTPUTS && status == GNP_OK; output++)
		if (wanted >> output & 1)
			status = gnp_common_add_numbers(to, &outputs[output], type, smooth->count, values[output], task, error);
	return status;
}

static gnp_status add_report(const struct gnp_smooth *smooth, const struct options *o, const struct gnp_task *task,
                             struct gnp_values *report, struct gnp_error *error)
{
	const struct gnp_common_facts facts = {.model = smooth->model, .normals_estimated = smooth->normals_estimated != 0,
	                                       .components = smooth->components};
	gnp_status status = gnp_values_add_number(report, "noise", smooth->noise, error);
	if (status == GNP_OK)
		status = gnp_values_add_number(report, "radius", smooth->radius, error);
	if (status == GNP_OK)
		status = gnp_values_add_number(report, "cloud_spacing", smooth->spacing, error);
	if (status == GNP_OK)
		status = gnp_common_report(&facts, &o->core.estimate, report, error);
	return status == GNP_OK ? gnp_common_report_end(&facts, task, report, error) : status;
}

static gnp_status run(const struct gnp_call *call, struct gnp_pool *pool, struct gnp_task *task,
                      struct gnp_response *response, struct gnp_error *error)
{
	const struct options *o = gnp_call_options(call);
	struct gnp_common_cloud input = {0};
	struct gnp_smooth smooth = {0};
	unsigned char *fixed = NULL;
	gnp_status status = gnp_common_cloud_read(call->request, &input, error);
	if (status == GNP_OK)
		status = gnp_common_mask_read(call->request, "fixed", &fixed, error);
	if (status != GNP_OK)
		goto done;
	struct gnp_cloud cloud = {input.count, input.points, input.normals};
	status = gnp_smooth_run(&cloud, fixed, &o->core, pool, task, &smooth, error);
	gnp_task_stage(task, GNP_STAGE_ENCODE, 0);
	if (status == GNP_OK)
		status = add_outputs(o->outputs, &smooth, input.type, &response->outputs, task, error);
	if (status == GNP_OK)
		status = add_report(&smooth, o, task, &response->parameters, error);
done:
	gnp_smooth_clear(&smooth);
	free(fixed);
	gnp_common_cloud_clear(&input);
	return status;
}

GNP_OPERATION(smooth, "Takes the noise off a cloud and leaves its surface, volume and open edges where they were.",
              .resolve = resolve, .rows = rows);
