/* The operation `filter`: its descriptor, and the way from tensors to gnp_filter_run and back. */
#include <stdio.h>
#include <string.h>

#include "core/estimate/filter.h"
#include "proto/operation/operation_common.h"

/* The core's options, what stands for a model until it is found, and a bit for every wanted output. */
struct options {
	struct gnp_filter_options core;
	char weights[GNP_MODEL_NAME_MAX + 1];
	uint64_t outputs;
};

static const struct gnp_tensor_info inputs[] = {GNP_COMMON_INPUTS};

enum output { KEEP, DEVIATION, POINTS, INDEX, NORMALS, OUTPUTS };

static const struct gnp_tensor_info outputs[OUTPUTS] = {
	[KEEP] = {"keep", GNP_BOOL, 1, {-1}, true, "whether the point is kept"},
	[DEVIATION] = {"deviation", GNP_FP32, 1, {-1}, true,
	               "how far the point is from its neighbours' surface, in the patch's scaled height; of points dropped "
	               "by gross: the distance to the nearest one left, in local spacings"},
	[POINTS] = {"points", GNP_FP32, 2, {-2, 3}, false, "the kept points, moved onto the surface with project [length]"},
	[INDEX] = {"index", GNP_INT64, 1, {-2}, false, "which point of the cloud each kept one is, ascending from 0"},
	[NORMALS] = {"normals", GNP_FP32, 2, {-2, 3}, false,
	             "outward unit normals of the fitted surface at the kept points"},
};

#define FIELD(name) offsetof(struct options, core.name)
static const struct gnp_parameter parameters[] = {
	{"alpha", GNP_PARAMETER_NUMBER, FIELD(alpha), 0, 1e6, NULL,
	 "the largest deviation that is kept, whatever the noise (the paper's rule: 0.1); 0: no limit"},
	{"consensus", GNP_PARAMETER_BOOL, FIELD(consensus), 0, 0, NULL,
	 "drop what does not lie on the surface its neighbours agree on, by their own noise"},
	{"gross", GNP_PARAMETER_NUMBER, FIELD(gross), 0, 1e6, NULL,
	 "drop far points, small clusters and clutter first: points hang together that are at most this many local "
	 "spacings apart, at least 1; 0: off"},
	{"cluster", GNP_PARAMETER_INTEGER, FIELD(cluster), 1, 1e6, NULL,
	 "a cluster is dropped that has fewer points than this (gross)"},
	{"project", GNP_PARAMETER_BOOL, FIELD(project), 0, 0, NULL, "move the kept points onto the fitted surface"},
	{"iterations", GNP_PARAMETER_INTEGER, FIELD(iterations), 1, 100, NULL, "of projection, at most (project)"},
	{"tolerance", GNP_PARAMETER_NUMBER, FIELD(tolerance), 0, 1e6, NULL,
	 "projection ends when points move by less than this many spacings, root mean square (project)"},
	GNP_COMMON_PARAMETERS(struct options, core.estimate, weights),
	GNP_COMMON_OUTPUTS(struct options),
};
#undef FIELD

static void defaults(void *options)
{
	struct options *o = options;
	o->core = gnp_filter_defaults();
	o->core.estimate.estimator = GNP_ESTIMATOR_GNP;
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
	const struct options *o = gnp_call_options(call);
	return gnp_common_check_points(call, &o->core.estimate, 0, error);
}

/* On top of the core's: the double copies of points and normals, and what is copied into the answer. */
static size_t memory(const struct gnp_call *call)
{
	const struct options *options = gnp_call_options(call);
	const struct gnp_filter_options *o = &options->core;
	size_t width = sizeof(int64_t) + 1, more = gnp_common_cloud_memory(call);
	return gnp_common_memory(call->points, width, gnp_common_memory(1, more, gnp_filter_memory(call->points, gnp_common_given(call), o)));
}

static gnp_status add_index(const struct gnp_filter *filter, struct gnp_tensors *to, struct gnp_error *error)
{
	struct gnp_tensor *tensor;
	gnp_status status = gnp_tensors_add(to, outputs[INDEX].name, GNP_INT64, 1, &filter->kept, &tensor, error);
	for (size_t i = 0; i < filter->kept && status == GNP_OK; i++)
		((int64_t *)tensor->data)[i] = filter->index[i];
	return status;
}

static gnp_status add_output(enum output output, struct gnp_filter *filter, enum gnp_datatype type,
                             struct gnp_tensors *to, struct gnp_task *task, struct gnp_error *error)
{
	const struct gnp_tensor_info *info = &outputs[output];
	switch (output) {
	case KEEP: return gnp_common_add_copy(to, info, filter->count, filter->keep, error);
	case DEVIATION: return gnp_common_add_numbers(to, info, type, filter->count, &filter->deviation, task, error);
	case POINTS: return gnp_common_add_numbers(to, info, type, filter->kept, &filter->points, task, error);
	case INDEX: return add_index(filter, to, error);
	default: return gnp_common_add_numbers(to, info, type, filter->kept, &filter->normals, task, error);
	}
}

static gnp_status add_outputs(const struct options *o, struct gnp_filter *filter, enum gnp_datatype type,
                              struct gnp_tensors *to, struct gnp_task *task, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	for (int output = 0; output < OUTPUTS && status == GNP_OK; output++) {
		if (o->outputs >> output & 1)
			status = add_output((enum output)output, filter, type, to, task, error);
	}
	return status;
}

static gnp_status report_counts(const struct gnp_filter *filter, struct gnp_values *report, struct gnp_error *error)
{
	const struct {
		const char *name;
		size_t count;
	} counts[] = {{"kept", filter->kept},
	              {"dropped_gross", filter->dropped_gross},
	              {"dropped_deviation", filter->dropped_deviation},
	              {"dropped_consensus", filter->dropped_consensus}};
	gnp_status status = GNP_OK;
	for (size_t i = 0; i < sizeof counts / sizeof counts[0] && status == GNP_OK; i++)
		status = gnp_values_add_integer(report, counts[i].name, (int64_t)counts[i].count, error);
	return status;
}

static gnp_status report_projection(const struct gnp_filter *filter, struct gnp_values *report, struct gnp_error *error)
{
	gnp_status status = gnp_values_add_integer(report, "iterations", filter->iterations, error);
	if (status == GNP_OK)
		status = gnp_values_add_number(report, "moved", filter->moved, error);
	return status == GNP_OK ? gnp_values_add_string(report, "stop", gnp_filter_stop_text(filter->stop), error) : status;
}

/* Points whose deviation lies within these, in per cent of all. Deviations of what the pre-filter dropped are
 * lengths and far above. */
static double percent_within(const struct gnp_filter *filter, double low, double high)
{
	size_t count = 0;
	for (size_t i = 0; i < filter->count; i++)
		count += filter->deviation[i] > low && filter->deviation[i] <= high;
	return 100 * (double)count / (double)filter->count;
}

/* Contamination is points that are off, with few between them and the others. Where many points lie on
 * both sides of alpha, it cuts through noise or detail. */
static void warn_of_noise(const struct gnp_filter *filter, double alpha, struct gnp_warnings *warnings)
{
	static const double most = 50, cut_most = 5;
	double dropped = 100 * (double)(filter->count - filter->kept) / (double)filter->count;
	double under = percent_within(filter, alpha / 2, alpha), over = percent_within(filter, alpha, 2 * alpha);
	if (alpha > 0 && under > cut_most && over > cut_most)
		gnp_warnings_add(warnings, GNP_WARNING_DROPPED,
		                 "%.0f %% of the points were dropped by a limit that cuts through them: %.1f %% lie within "
		                 "half of alpha under it and %.1f %% within twice over it, with outliers one is below %g %%: "
		                 "it is noise or detail, take a larger alpha (%g) or none (0)",
		                 dropped, under, over, cut_most,
		                 10 * alpha);
	else if (dropped > most)
		gnp_warnings_add(warnings, GNP_WARNING_DROPPED,
		                 "%.0f %% of the points were dropped, more than %g %%: no surface holds what is left", dropped,
		                 most);
}

static gnp_status add_report(const struct gnp_filter *filter, const struct gnp_filter_options *o,
                             const struct gnp_task *task, struct gnp_values *report, struct gnp_error *error)
{
	const struct gnp_common_facts facts = {filter->model, filter->normals_estimated != 0, filter->components,
	                                       filter->patches, filter->degenerate, filter->outliers};
	gnp_status status = gnp_common_report(&facts, &o->estimate, report, error);
	if (status == GNP_OK)
		status = report_counts(filter, report, error);
	if (status == GNP_OK && o->project)
		status = report_projection(filter, report, error);
	if (status == GNP_OK)
		status = gnp_common_report_end(&facts, task, report, error);
	return status;
}

static gnp_status run(const struct gnp_call *call, struct gnp_pool *pool, struct gnp_task *task,
                      struct gnp_response *response, struct gnp_error *error)
{
	const struct options *o = gnp_call_options(call);
	struct gnp_common_cloud input = {0};
	struct gnp_filter filter = {0};
	gnp_status status = gnp_common_cloud_read(call->request, &input, error);
	if (status != GNP_OK)
		goto done;
	struct gnp_cloud cloud = {input.count, input.points, input.normals};
	status = gnp_filter_run(&cloud, &o->core, pool, task, &filter, error);
	gnp_task_stage(task, GNP_STAGE_ENCODE, 0);
	if (status == GNP_OK) {
		warn_of_noise(&filter, o->core.alpha, gnp_task_warnings(task));
		status = add_outputs(o, &filter, input.type, &response->outputs, task, error);
	}
	if (status == GNP_OK)
		status = add_report(&filter, &o->core, task, &response->parameters, error);
done:
	gnp_filter_clear(&filter);
	gnp_common_cloud_clear(&input);
	return status;
}

GNP_OPERATION(filter,
              "Which points of a cloud do not lie on the surface the others agree on, and the cloud without them.",
              .resolve = resolve);
