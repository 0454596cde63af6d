/* The operation `patch`: its descriptor, and the way from tensors to gnp_patch_view_make and back. */
#include <string.h>

#include "core/estimate/patch_view.h"
#include "proto/operation/operation_common.h"

/* The core's options, what stands for a model until it is found, and a bit for every wanted output. */
struct options {
	struct gnp_estimate_options core;
	char weights[GNP_MODEL_NAME_MAX + 1];
	int at;
	uint64_t outputs;
};

static const struct gnp_tensor_info inputs[] = {GNP_COMMON_INPUTS};

enum output { WEIGHT, HEIGHT, OUTPUTS };

static const struct gnp_tensor_info outputs[OUTPUTS] = {
	[WEIGHT] = {"weight", GNP_FP32, 1, {-1}, true,
	            "how much the point counts in the surface at the point `at`, from 0 to 1; 0 beyond its support"},
	[HEIGHT] = {"height", GNP_FP32, 1, {-1}, true,
	            "of the point above that surface [length]; 0 beyond its support"},
};

static const struct gnp_parameter parameters[] = {
	{"at", GNP_PARAMETER_INTEGER, offsetof(struct options, at), 0, 2147483647, NULL,
	 "the point whose surface is shown, counted from 0"},
	GNP_COMMON_PARAMETERS(struct options, core, weights),
	GNP_COMMON_OUTPUTS(struct options),
};

static void defaults(void *options)
{
	struct options *o = options;
	o->core = gnp_estimate_defaults();
	o->core.estimator = GNP_ESTIMATOR_GNP;
	o->at = 0;
	o->outputs = (UINT64_C(1) << OUTPUTS) - 1;
	strcpy(o->weights, GNP_COMMON_AUTO);
}

static gnp_status resolve(void *options, const struct gnp_models *models, struct gnp_error *error)
{
	struct options *o = options;
	return gnp_common_resolve(&o->core, o->weights, GNP_COMMON_AUTO, models, error);
}

static gnp_status check(struct gnp_call *call, struct gnp_error *error)
{
	const struct options *o = gnp_call_options(call);
	gnp_status status = gnp_estimate_check(&o->core, error);
	if (status == GNP_OK)
		status = gnp_common_check_points(call, &o->core, 0, error);
	if (status == GNP_OK && (size_t)o->at >= call->points)
		status = gnp_error_set(error, GNP_INVALID_ARGUMENT, "at: got %d, need at most %zu", o->at, call->points - 1);
	return status;
}

/* On top of the core's: the double copies of points and normals. */
static size_t memory(const struct gnp_call *call)
{
	size_t core = gnp_patch_view_memory(call->points, gnp_common_given(call));
	return gnp_common_memory(1, gnp_common_cloud_memory(call), core);
}

static gnp_status add_outputs(const struct options *o, struct gnp_patch_view *view, enum gnp_datatype type,
                              struct gnp_tensors *to, struct gnp_task *task, struct gnp_error *error)
{
	double **values[OUTPUTS] = {&view->weight, &view->height};
	gnp_status status = GNP_OK;
	for (int output = 0; output < OUTPUTS && status == GNP_OK; output++) {
		if (o->outputs >> output & 1)
			status = gnp_common_add_numbers(to, &outputs[output], type, view->count, values[output], task, error);
	}
	return status;
}

static gnp_status add_report(const struct gnp_patch_view *view, const struct options *o, const struct gnp_task *task,
                             struct gnp_values *report, struct gnp_error *error)
{
	const struct gnp_common_facts facts = {.model = view->model, .normals_estimated = view->normals_estimated,
	                                       .components = view->components};
	const struct {
		const char *name;
		double value;
	} numbers[] = {{"normal_x", view->normal[0]},
	               {"normal_y", view->normal[1]},
	               {"normal_z", view->normal[2]},
	               {"scale", view->scale},
	               {"radius", view->radius}};
	gnp_status status = gnp_common_report(&facts, &o->core, report, error);
	for (size_t i = 0; i < sizeof numbers / sizeof numbers[0] && status == GNP_OK; i++)
		status = gnp_values_add_number(report, numbers[i].name, numbers[i].value, error);
	if (status == GNP_OK)
		status = gnp_values_add_integer(report, "support_points", (int64_t)view->points, error);
	if (status == GNP_OK)
		status = gnp_values_add_bool(report, "crease", view->crease, error);
	if (status == GNP_OK)
		status = gnp_values_add_bool(report, "outlier", view->outlier, error);
	return status == GNP_OK ? gnp_common_report_end(&facts, task, report, error) : status;
}

static gnp_status run(const struct gnp_call *call, struct gnp_pool *pool, struct gnp_task *task,
                      struct gnp_response *response, struct gnp_error *error)
{
	const struct options *o = gnp_call_options(call);
	struct gnp_common_cloud input = {0};
	struct gnp_patch_view view = {0};
	gnp_status status = gnp_common_cloud_read(call->request, &input, error);
	if (status == GNP_OK) {
		struct gnp_cloud cloud = {input.count, input.points, input.normals};
		status = gnp_patch_view_make(&cloud, &o->core, (size_t)o->at, pool, task, &view, error);
	}
	gnp_task_stage(task, GNP_STAGE_ENCODE, 0);
	if (status == GNP_OK)
		status = add_outputs(o, &view, input.type, &response->outputs, task, error);
	if (status == GNP_OK)
		status = add_report(&view, o, task, &response->parameters, error);
	gnp_patch_view_clear(&view);
	gnp_common_cloud_clear(&input);
	return status;
}

GNP_OPERATION(patch, "What the network saw and decided at one point: how every other counts in its surface.",
              .resolve = resolve);
