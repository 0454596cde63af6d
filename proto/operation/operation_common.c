#include "proto/operation/operation_common.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "proto/tensor/warnings.h"

const char *const gnp_common_estimators[] = {"gnp", "gmls", "adaptive", NULL};
const char *const gnp_common_covers[] = {"cover", "all", NULL};
const char *const gnp_common_bases[] = {"tensor", "total", NULL};
const char *const gnp_common_weights[] = {"quartic", "flat", "linear", NULL};
const char *const gnp_common_outliers[] = {"auto", "kept", "left_out", NULL};

gnp_status gnp_common_resolve(struct gnp_estimate_options *options, const char *weights, const char *by_default,
                              const struct gnp_models *models, struct gnp_error *error)
{
	options->models = models;
	bool unused = options->estimator != GNP_ESTIMATOR_GNP && strcmp(weights, by_default) == 0;
	if (unused || strcmp(weights, GNP_COMMON_AUTO) == 0)
		return GNP_OK;
	return gnp_models_find(models, weights, &options->model, error);
}

gnp_status gnp_common_check_points(const struct gnp_call *call, const struct gnp_estimate_options *options,
                                   size_t least, struct gnp_error *error)
{
	size_t k = (size_t)options->k;
	if (options->estimator == GNP_ESTIMATOR_GNP && options->model && options->model->recipe.k > k)
		k = options->model->recipe.k;
	least = k > least ? k : least;
	if (call->points < least)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "points: got %zu, need at least %zu", call->points, least);
	return GNP_OK;
}

bool gnp_common_given(const struct gnp_call *call)
{
	return gnp_tensors_find(&call->request->inputs, "normals") != NULL;
}

size_t gnp_common_cloud_memory(const struct gnp_call *call)
{
	return gnp_common_memory(call->points, 3 * sizeof(double) * (gnp_common_given(call) ? 2 : 1), 0);
}

size_t gnp_common_memory(size_t count, size_t width, size_t more)
{
	size_t bytes;
	return !gnp_size_multiply(count, width, &bytes) || bytes > SIZE_MAX - more ? SIZE_MAX : bytes + more;
}

gnp_status gnp_common_cloud_read(const struct gnp_request *request, struct gnp_common_cloud *out,
                                 struct gnp_error *error)
{
	const struct gnp_tensor *points = gnp_tensors_find(&request->inputs, "points");
	const struct gnp_tensor *normals = gnp_tensors_find(&request->inputs, "normals");
	out->count = points->shape[0];
	out->type = points->datatype == GNP_FP64 ? GNP_FP64 : GNP_FP32;
	out->points = gnp_tensor_to_double(points);
	out->normals = normals ? gnp_tensor_to_double(normals) : NULL;
	if (!out->points || (normals && !out->normals))
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "points: no memory for %zu", out->count);
	return GNP_OK;
}

void gnp_common_cloud_clear(struct gnp_common_cloud *cloud)
{
	free(cloud->points);
	free(cloud->normals);
	*cloud = (struct gnp_common_cloud){0};
}

gnp_status gnp_common_mask_read(const struct gnp_request *request, const char *name, unsigned char **mask,
                                struct gnp_error *error)
{
	const struct gnp_tensor *tensor = gnp_tensors_find(&request->inputs, name);
	*mask = NULL;
	if (!tensor)
		return GNP_OK;
	*mask = gnp_array_new(tensor->shape[0], 1);
	if (!*mask)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "%s: no memory for %zu points", name, tensor->shape[0]);
	for (size_t i = 0; i < tensor->shape[0]; i++)
		(*mask)[i] = gnp_tensor_get(tensor, i) != 0;
	return GNP_OK;
}

/* Front to back in blocks: a second array would cost more than the rounding. Returns where the first is that is too
 * large, or count. */
static size_t round_in_place(double *values, size_t count, size_t *vanished)
{
	enum { BLOCK = 512 };
	size_t small = 0, beyond = count;
	for (size_t first = 0; first < count && beyond == count; first += BLOCK) {
		float block[BLOCK];
		size_t some = count - first < BLOCK ? count - first : BLOCK, large = 0;
		for (size_t i = 0; i < some; i++) {
			double value = values[first + i];
			block[i] = (float)value;
			small += (block[i] == 0) & (value != 0);
			large += (fabsf(block[i]) > FLT_MAX) & (fabs(value) <= DBL_MAX);
		}
		for (size_t i = 0; large && i < some && beyond == count; i++)
			beyond = fabs(values[first + i]) > FLT_MAX ? first + i : beyond;
		if (!large)
			memcpy((char *)values + first * sizeof *block, block, some * sizeof *block);
	}
	*vanished = small;
	return beyond;
}

gnp_status gnp_common_round(const char *name, double **values, size_t count, size_t *vanished, struct gnp_error *error)
{
	size_t beyond = round_in_place(*values, count, vanished);
	if (beyond < count)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "%s: number %zu is %g, single precision ends at %g: send points as FP64, or in another "
		                     "unit of length", name, beyond, (*values)[beyond], FLT_MAX);
	void *smaller = count ? realloc(*values, count * sizeof(float)) : NULL;
	if (smaller)
		*values = smaller;
	return GNP_OK;
}

void gnp_common_warn_of_range(const char *name, size_t vanished, size_t count, struct gnp_task *task)
{
	if (2 * vanished > count)
		gnp_warnings_add(gnp_task_warnings(task), GNP_WARNING_RANGE,
		                 "%zu of %zu numbers of %s are too small for single precision and came out as 0, the "
		                 "limit is half of them: send points as FP64, or in another unit of length", vanished, count,
		                 name);
}

/* (rows, ...) in the table's rank; returns the numbers in all. */
static size_t fill_shape(const struct gnp_tensor_info *info, size_t rows, size_t shape[4])
{
	size_t count = shape[0] = rows;
	for (unsigned d = 1; d < info->rank; d++) {
		shape[d] = (size_t)info->shape[d];
		count *= shape[d];
	}
	return count;
}

gnp_status gnp_common_add_numbers(struct gnp_tensors *outputs, const struct gnp_tensor_info *info,
                                  enum gnp_datatype type,
                                  size_t rows, double **values, struct gnp_task *task, struct gnp_error *error)
{
	size_t shape[4], count = fill_shape(info, rows, shape), vanished = 0;
	enum gnp_datatype stored = info->datatype == GNP_FP32 ? type : info->datatype;
	gnp_status status = stored == GNP_FP32 ? gnp_common_round(info->name, values, count, &vanished, error) : GNP_OK;
	gnp_common_warn_of_range(info->name, vanished, count, task);
	if (status == GNP_OK)
		status = gnp_tensors_add_data(outputs, info->name, stored, info->rank, shape, *values, true, NULL, error);
	if (status == GNP_OK)
		*values = NULL;
	return status;
}

gnp_status gnp_common_add_copy(struct gnp_tensors *outputs, const struct gnp_tensor_info *info, size_t rows,
                               const void *values, struct gnp_error *error)
{
	size_t shape[4];
	struct gnp_tensor *tensor;
	fill_shape(info, rows, shape);
	gnp_status status = gnp_tensors_add(outputs, info->name, info->datatype, info->rank, shape, &tensor, error);
	if (status == GNP_OK && tensor->size)
		memcpy(tensor->data, values, tensor->size);
	return status;
}

static gnp_status report_model(const struct gnp_model *model, struct gnp_values *report, struct gnp_error *error)
{
	gnp_status status = gnp_values_add_string(report, "weights", model->name, error);
	return status == GNP_OK ? gnp_values_add_string(report, "weights_sha256", model->sha256, error) : status;
}

static gnp_status report_least_squares(const struct gnp_estimate_options *o, struct gnp_values *report,
                                       struct gnp_error *error)
{
	gnp_status status = gnp_values_add_integer(report, "degree", o->degree, error);
	if (status == GNP_OK)
		status = gnp_values_add_string(report, "basis", gnp_common_bases[o->basis], error);
	return status == GNP_OK ? gnp_values_add_string(report, "weight", gnp_common_weights[o->weight], error) : status;
}

/* What the estimator had a use for. */
static gnp_status report_choices(const struct gnp_model *model, const struct gnp_estimate_options *o,
                                 struct gnp_values *report, struct gnp_error *error)
{
	gnp_status status = gnp_values_add_string(report, "estimator", gnp_common_estimators[o->estimator], error);
	if (status == GNP_OK && model)
		status = report_model(model, report, error);
	int64_t k = model ? (int64_t)model->recipe.k : o->k;
	if (status == GNP_OK && k > 0)
		status = gnp_values_add_integer(report, "k", k, error);
	if (status == GNP_OK)
		status = gnp_values_add_string(report, "cover", gnp_common_covers[o->cover], error);
	return status == GNP_OK && o->estimator == GNP_ESTIMATOR_GMLS ? report_least_squares(o, report, error) : status;
}

/* The parameter, too, that has a model that is named do what auto did. */
static gnp_status report_outliers(const struct gnp_common_facts *facts, struct gnp_values *report,
                                  struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	if (facts->model && facts->model->architecture.head == GNP_HEAD_WEIGHTED)
		return gnp_values_add_integer(report, "outliers_found", (int64_t)facts->outliers, error);
	if (facts->model)
		status = gnp_values_add_string(report, "outliers", gnp_common_outliers[GNP_OUTLIERS_LEFT_OUT], error);
	if (status != GNP_OK)
		return status;
	return gnp_values_add_integer(report, "outliers_left_out", (int64_t)facts->outliers, error);
}

gnp_status gnp_common_report(const struct gnp_common_facts *facts, const struct gnp_estimate_options *options,
                             struct gnp_values *report, struct gnp_error *error)
{
	gnp_status status = report_choices(facts->model, options, report, error);
	if (status == GNP_OK)
		status = gnp_values_add_bool(report, "normals_estimated", facts->normals_estimated, error);
	if (status == GNP_OK && facts->normals_estimated && facts->components)
		status = gnp_values_add_integer(report, "components", (int64_t)facts->components, error);
	if (status == GNP_OK && facts->patches)
		status = gnp_values_add_integer(report, "patches", (int64_t)facts->patches, error);
	return status == GNP_OK && facts->outliers ? report_outliers(facts, report, error) : status;
}

static gnp_status report_seconds(const struct gnp_task *task, struct gnp_values *report, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	for (int i = GNP_STAGE_ORDER; task && i < GNP_STAGE_ENCODE && status == GNP_OK; i++) {
		char name[64];
		snprintf(name, sizeof name, "seconds_%s", gnp_stage_name((enum gnp_stage)i));
		if (task->seconds[i] > 0)
			status = gnp_values_add_number(report, name, round(task->seconds[i] * 1e6) / 1e6, error);
	}
	return status;
}

static void warn_of_facts(const struct gnp_common_facts *facts, struct gnp_warnings *warnings)
{
	if (facts->degenerate)
		gnp_warnings_add(warnings, GNP_WARNING_DEGENERATE,
		                 "%zu points have a neighbourhood too poor for the basis: a lower degree was used there",
		                 facts->degenerate);
	if (facts->normals_estimated && facts->components > 1)
		gnp_warnings_add(warnings, GNP_WARNING_COMPONENTS,
		                 "normals were estimated and each of %zu separate components is oriented by itself",
		                 facts->components);
}

gnp_status gnp_common_report_end(const struct gnp_common_facts *facts, const struct gnp_task *task,
                                 struct gnp_values *report, struct gnp_error *error)
{
	struct gnp_warnings warnings = {0};
	gnp_warnings_merge(&warnings, gnp_task_warnings(task));
	warn_of_facts(facts, &warnings);
	gnp_status status = report_seconds(task, report, error);
	return status == GNP_OK ? gnp_warnings_report(&warnings, report, error) : status;
}
