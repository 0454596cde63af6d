/* The operation `estimate`: its descriptor, and the way from tensors to gnp_estimate_run and back. */
#include <string.h>

#include "core/estimate/estimate.h"
#include "core/fit/quantity.h"
#include "proto/operation/operation_common.h"

/* The core's options, and what stands for a model until it is found. */
struct options {
	struct gnp_estimate_options core;
	char weights[GNP_MODEL_NAME_MAX + 1];
};

static const struct gnp_tensor_info inputs[] = {GNP_COMMON_INPUTS};

static const struct gnp_tensor_info outputs[] = {
#define ROW(id, name, rank, rows, columns, width, help) \
	[id] = {name, GNP_FP32, (rank) + 1, {-1, (width) ? (rows) : -2, columns, 2}, false, help},
	GNP_QUANTITY_TABLE(ROW)
#undef ROW
};

/* As people name them, mean curvature before Gaussian curvature. */
static const char *const named_first[] = {"normals", "mean_curvature", NULL};

static const struct gnp_parameter parameters[] = {
	GNP_COMMON_PARAMETERS(struct options, core, weights),
	{"quantities", GNP_PARAMETER_SET, offsetof(struct options, core.quantities), 0, 0, named_first,
	 "comma-separated names of outputs, or all"},
};

static void defaults(void *options)
{
	struct options *o = options;
	o->core = gnp_estimate_defaults();
	o->core.estimator = GNP_ESTIMATOR_GNP;
	strcpy(o->weights, GNP_COMMON_AUTO);
}

static gnp_status resolve(void *options, const struct gnp_models *models, struct gnp_error *error)
{
	struct options *o = options;
	return gnp_common_resolve(&o->core, o->weights, GNP_COMMON_AUTO, models, error);
}

static gnp_status check(struct gnp_call *call, struct gnp_error *error)
{
	const struct options *options = gnp_call_options(call);
	const struct gnp_estimate_options *o = &options->core;
	gnp_status status = gnp_estimate_check(o, error);
	return status == GNP_OK ? gnp_common_check_points(call, o, 0, error) : status;
}

/* On top of the core's: the double copies of points and normals. Answers are the core's, rounded where they lie. */
static size_t memory(const struct gnp_call *call)
{
	const struct options *options = gnp_call_options(call);
	const struct gnp_estimate_options *o = &options->core;
	return gnp_common_memory(1, gnp_common_cloud_memory(call), gnp_estimate_memory(call->points, gnp_common_given(call), o));
}

static size_t quantity_width(const struct gnp_estimate *estimate, int q)
{
	size_t width = gnp_quantity_info(q)->width;
	return width ? width : estimate->basis_size;
}

struct rounding {
	struct gnp_estimate *estimate;
	size_t vanished[GNP_QUANTITY_COUNT]; /* numbers of each too small for single precision */
};

static gnp_status round_quantities(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                   struct gnp_error *error)
{
	struct rounding *rounding = context;
	struct gnp_estimate *estimate = rounding->estimate;
	gnp_status status = GNP_OK;
	(void)scratch;
	for (size_t q = begin; q < end && status == GNP_OK; q++) {
		if (estimate->values[q])
			status = gnp_common_round(gnp_quantity_info(q)->name, &estimate->values[q],
			                          estimate->count * quantity_width(estimate, (int)q),
			                          &rounding->vanished[q], error);
	}
	return status;
}

static gnp_status round_all(struct gnp_estimate *estimate, struct gnp_pool *pool, struct gnp_task *task,
                            struct gnp_error *error)
{
	struct rounding rounding = {.estimate = estimate};
	gnp_status status = gnp_pool_run(pool, task, GNP_QUANTITY_COUNT, GNP_QUANTITY_COUNT / 4, round_quantities,
	                                 &rounding, error);
	for (int q = 0; q < GNP_QUANTITY_COUNT; q++)
		gnp_common_warn_of_range(gnp_quantity_info(q)->name, rounding.vanished[q],
		                         estimate->count * quantity_width(estimate, q), task);
	return status;
}

/* Hands the values over; they are no longer the estimate's. */
static gnp_status add_output(struct gnp_estimate *estimate, enum gnp_quantity q, enum gnp_datatype datatype,
                             struct gnp_response *response, struct gnp_error *error)
{
	const struct gnp_quantity_info *info = gnp_quantity_info(q);
	size_t shape[4] = {estimate->count};
	for (unsigned d = 0; d < info->rank; d++)
		shape[d + 1] = info->shape[d] ? info->shape[d] : quantity_width(estimate, q);
	gnp_status status = gnp_tensors_add_data(&response->outputs, info->name, datatype, info->rank + 1, shape,
	                                         estimate->values[q], true, NULL, error);
	if (status == GNP_OK)
		estimate->values[q] = NULL;
	return status;
}

static gnp_status add_outputs(struct gnp_estimate *estimate, enum gnp_datatype datatype, struct gnp_pool *pool,
                              struct gnp_task *task, struct gnp_response *response, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	if (datatype == GNP_FP32)
		status = round_all(estimate, pool, task, error);
	for (int q = 0; q < GNP_QUANTITY_COUNT && status == GNP_OK; q++) {
		if (estimate->values[q])
			status = add_output(estimate, q, datatype, response, error);
	}
	return status;
}

static gnp_status add_report(const struct gnp_estimate *estimate, const struct gnp_estimate_options *o,
                             const struct gnp_task *task, struct gnp_values *report, struct gnp_error *error)
{
	const struct gnp_common_facts facts = {estimate->model, estimate->normals_estimated != 0, estimate->components,
	                                       estimate->patches, estimate->degenerate, estimate->outliers};
	gnp_status status = gnp_common_report(&facts, o, report, error);
	return status == GNP_OK ? gnp_common_report_end(&facts, task, report, error) : status;
}

static gnp_status run(const struct gnp_call *call, struct gnp_pool *pool, struct gnp_task *task,
                      struct gnp_response *response, struct gnp_error *error)
{
	const struct options *options = gnp_call_options(call);
	const struct gnp_estimate_options *o = &options->core;
	struct gnp_common_cloud input = {0};
	struct gnp_estimate estimate = {0};
	gnp_status status = gnp_common_cloud_read(call->request, &input, error);
	if (status != GNP_OK)
		goto done;
	struct gnp_cloud cloud = {input.count, input.points, input.normals};
	status = gnp_estimate_run(&cloud, o, pool, task, &estimate, error);
	gnp_task_stage(task, GNP_STAGE_ENCODE, 0);
	if (status == GNP_OK)
		status = add_outputs(&estimate, input.type, pool, task, response, error);
	if (status == GNP_OK)
		status = add_report(&estimate, o, task, &response->parameters, error);
done:
	gnp_estimate_clear(&estimate);
	gnp_common_cloud_clear(&input);
	return status;
}

GNP_OPERATION(estimate, "Normals, curvatures and other local geometry at every point of a cloud.",
              .resolve = resolve);
