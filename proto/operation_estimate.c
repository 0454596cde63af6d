/* The operation `estimate`: its descriptor, and the way from tensors to gnp_estimate_run and back. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "estimate.h"
#include "memory.h"
#include "operation_table.h"
#include "quantity.h"

/* The core's options, and what stands for a model until it is found. */
struct options {
	struct gnp_estimate_options core;
	char weights[GNP_MODEL_NAME_MAX + 1];
};
_Static_assert(sizeof(struct options) <= GNP_OPTIONS_SIZE_MAX, "options fit a call");

static const char automatic[] = "auto";

static const struct gnp_tensor_info inputs[] = {
	{"points", GNP_FP32, 2, {-1, 3}, false, "the cloud, in any length unit"},
	{"normals", GNP_FP32, 2, {-1, 3}, true, "outward normals of any non-zero length; estimated and oriented when absent"},
};

static const struct gnp_tensor_info outputs[] = {
#define ROW(id, name, rank, rows, columns, width, help) \
	[id] = {name, GNP_FP32, (rank) + 1, {-1, (width) ? (rows) : -2, columns, 2}, false, help},
	GNP_QUANTITY_TABLE(ROW)
#undef ROW
};

/* In the order of the enumerations in estimate.h and estimator.h. */
static const char *const estimators[] = {"gnp", "gmls", "adaptive", NULL};
static const char *const covers[] = {"cover", "all", NULL};
static const char *const bases[] = {"tensor", "total", NULL};
static const char *const weights[] = {"quartic", "flat", "linear", NULL};

#define FIELD(name) offsetof(struct options, core.name)
static const struct gnp_parameter parameters[] = {
	{"estimator", GNP_PARAMETER_CHOICE, FIELD(estimator), "gnp", 0, 0, estimators,
	 "gnp: a geometric neural operator; gmls: moving least squares; adaptive: robust, with standard errors, finds support and degree itself"},
	{"weights", GNP_PARAMETER_MODEL, offsetof(struct options, weights), automatic, 0, 0, NULL,
	 "the model (gnp); auto: the one that suits the cloud's noise and outliers"},
	{"cover", GNP_PARAMETER_CHOICE, FIELD(cover), "cover", 0, 0, covers,
	 "cover: a patch serves several neighbouring points; all: as good as one for every point"},
	{"k", GNP_PARAMETER_INTEGER, FIELD(k), "30", 12, 500, NULL,
	 "neighbours that set the patch radius, 1.1 times the k-th distance (gmls, adaptive; with gnp the model's)"},
	{"degree", GNP_PARAMETER_INTEGER, FIELD(degree), "3", 1, 7, NULL, "degree of the Legendre basis (gmls)"},
	{"basis", GNP_PARAMETER_CHOICE, FIELD(basis), "tensor", 0, 0, bases, "tensor or total degree (gmls)"},
	{"weight", GNP_PARAMETER_CHOICE, FIELD(weight), "quartic", 0, 0, weights,
	 "weight over the patch: quartic (1-r)^4, flat 1, linear 1.2-r (gmls)"},
	{"quantities", GNP_PARAMETER_SET, FIELD(quantities), "normals,mean_curvature,gaussian_curvature", 0, 0, NULL,
	 "comma-separated names of outputs, or all"},
};
#undef FIELD

static void defaults(void *options)
{
	struct options *o = options;
	o->core = gnp_estimate_defaults();
	o->core.estimator = GNP_ESTIMATOR_GNP;
	strcpy(o->weights, automatic);
}

static gnp_status resolve(void *options, const struct gnp_models *models, struct gnp_error *error)
{
	struct options *o = options;
	o->core.models = models;
	return strcmp(o->weights, automatic) == 0 ? GNP_OK : gnp_models_find(models, o->weights, &o->core.model, error);
}

static size_t saturating_add(size_t a, size_t b)
{
	return a > SIZE_MAX - b ? SIZE_MAX : a + b;
}

/* On top of the core's: the double copies of points and normals, and the encoded answer. */
static size_t memory(size_t points, const void *options)
{
	const struct gnp_estimate_options *o = &((const struct options *)options)->core;
	size_t width = 6 * sizeof(double), bytes;
	struct gnp_basis basis = gnp_estimator_at(o->estimator)->basis((struct gnp_basis){o->basis, (unsigned)o->degree});
	for (int q = 0; q < GNP_QUANTITY_COUNT; q++) {
		size_t items = gnp_quantity_info(q)->width;
		if (o->quantities & GNP_QUANTITY_BIT(q))
			width += sizeof(float) * (items ? items : gnp_basis_size(basis));
	}
	if (!gnp_size_multiply(points, width, &bytes))
		return SIZE_MAX;
	return saturating_add(bytes, gnp_estimate_memory(points, o));
}

/* Rounds to single precision within the same memory, front to back: a second array would cost more than the rounding. */
static void round_in_place(double *values, size_t count)
{
	enum { BLOCK = 512 };
	for (size_t first = 0; first < count; first += BLOCK) {
		float block[BLOCK];
		size_t some = count - first < BLOCK ? count - first : BLOCK;
		for (size_t i = 0; i < some; i++)
			block[i] = (float)values[first + i];
		memcpy((char *)values + first * sizeof *block, block, some * sizeof *block);
	}
}

static size_t quantity_width(const struct gnp_estimate *estimate, int q)
{
	size_t width = gnp_quantity_info(q)->width;
	return width ? width : estimate->basis_size;
}

/* What no longer needs its second half gives it back. */
static gnp_status round_quantities(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                   struct gnp_error *error)
{
	struct gnp_estimate *estimate = context;
	(void)scratch, (void)error;
	for (size_t q = begin; q < end; q++) {
		size_t count = estimate->count * quantity_width(estimate, (int)q);
		if (!estimate->values[q])
			continue;
		round_in_place(estimate->values[q], count);
		void *smaller = realloc(estimate->values[q], count * sizeof(float));
		if (smaller)
			estimate->values[q] = smaller;
	}
	return GNP_OK;
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
                              struct gnp_response *response, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	if (datatype == GNP_FP32)
		status = gnp_pool_run(pool, NULL, GNP_QUANTITY_COUNT, 1, round_quantities, estimate, error);
	for (int q = 0; q < GNP_QUANTITY_COUNT && status == GNP_OK; q++) {
		if (estimate->values[q])
			status = add_output(estimate, q, datatype, response, error);
	}
	return status;
}

static gnp_status add_warnings(const struct gnp_estimate *estimate, struct gnp_values *report, struct gnp_error *error)
{
	struct gnp_buffer text = {0};
	gnp_status status = GNP_OK;
	if (estimate->degenerate)
		status = gnp_buffer_printf(&text, error, "%zu points have a neighbourhood too poor for the basis: a lower degree was used there",
		                           estimate->degenerate);
	if (status == GNP_OK && estimate->normals_estimated && estimate->components > 1)
		status = gnp_buffer_printf(&text, error, "%snormals were estimated and each of %zu separate components is oriented by itself",
		                           text.size ? "; " : "", estimate->components);
	if (status == GNP_OK && text.size)
		status = gnp_values_add_string(report, "warnings", (const char *)text.data, error);
	gnp_buffer_clear(&text);
	return status;
}

static gnp_status add_seconds(const struct gnp_task *task, struct gnp_values *report, struct gnp_error *error)
{
	static const enum gnp_stage stages[] = {GNP_STAGE_ORDER, GNP_STAGE_NEIGHBORS, GNP_STAGE_ORIENT, GNP_STAGE_PREPARE,
	                                         GNP_STAGE_ESTIMATE};
	gnp_status status = GNP_OK;
	for (size_t i = 0; task && i < sizeof stages / sizeof stages[0] && status == GNP_OK; i++) {
		char name[64];
		snprintf(name, sizeof name, "seconds_%s", gnp_stage_name(stages[i]));
		if (task->seconds[stages[i]] > 0)
			status = gnp_values_add_number(report, name, round(task->seconds[stages[i]] * 1e6) / 1e6, error);
	}
	return status;
}

static gnp_status add_model(const struct gnp_model *model, struct gnp_values *report, struct gnp_error *error)
{
	gnp_status status = gnp_values_add_string(report, "weights", model->name, error);
	return status == GNP_OK ? gnp_values_add_string(report, "weights_sha256", model->sha256, error) : status;
}

static gnp_status add_least_squares(const struct gnp_estimate_options *o, struct gnp_values *report, struct gnp_error *error)
{
	gnp_status status = gnp_values_add_integer(report, "degree", o->degree, error);
	if (status == GNP_OK)
		status = gnp_values_add_string(report, "basis", bases[o->basis], error);
	return status == GNP_OK ? gnp_values_add_string(report, "weight", weights[o->weight], error) : status;
}

/* What the estimator had a use for. */
static gnp_status add_choices(const struct gnp_model *model, const struct gnp_estimate_options *o, struct gnp_values *report,
                              struct gnp_error *error)
{
	gnp_status status = gnp_values_add_string(report, "estimator", estimators[o->estimator], error);
	if (status == GNP_OK && model)
		status = add_model(model, report, error);
	if (status == GNP_OK)
		status = gnp_values_add_integer(report, "k", model ? (int64_t)model->recipe.k : o->k, error);
	if (status == GNP_OK)
		status = gnp_values_add_string(report, "cover", covers[o->cover], error);
	return status == GNP_OK && o->estimator == GNP_ESTIMATOR_GMLS ? add_least_squares(o, report, error) : status;
}

static gnp_status add_report(const struct gnp_estimate *estimate, const struct gnp_estimate_options *o,
                             const struct gnp_task *task, struct gnp_values *report, struct gnp_error *error)
{
	gnp_status status = add_choices(estimate->model, o, report, error);
	if (status == GNP_OK)
		status = gnp_values_add_bool(report, "normals_estimated", estimate->normals_estimated != 0, error);
	if (status == GNP_OK && estimate->normals_estimated)
		status = gnp_values_add_integer(report, "components", (int64_t)estimate->components, error);
	if (status == GNP_OK)
		status = gnp_values_add_integer(report, "patches", (int64_t)estimate->patches, error);
	if (status == GNP_OK)
		status = add_seconds(task, report, error);
	return status == GNP_OK ? add_warnings(estimate, report, error) : status;
}

static gnp_status run(const struct gnp_request *request, const void *options, struct gnp_pool *pool,
                      struct gnp_task *task, struct gnp_response *response, struct gnp_error *error)
{
	const struct gnp_tensor *points = gnp_tensors_find(&request->inputs, "points");
	const struct gnp_tensor *normals = gnp_tensors_find(&request->inputs, "normals");
	const struct gnp_estimate_options *o = &((const struct options *)options)->core;
	enum gnp_datatype datatype = points->datatype == GNP_FP64 ? GNP_FP64 : GNP_FP32;
	struct gnp_estimate estimate = {0};
	double *p = gnp_tensor_to_double(points), *n = normals ? gnp_tensor_to_double(normals) : NULL;
	gnp_status status;
	if (!p || (normals && !n)) {
		status = gnp_error_set(error, GNP_OUT_OF_MEMORY, "estimate: no memory for %zu points", points->shape[0]);
		goto done;
	}
	struct gnp_cloud cloud = {points->shape[0], p, n};
	status = gnp_estimate_run(&cloud, o, pool, task, &estimate, error);
	gnp_task_stage(task, GNP_STAGE_ENCODE, 0);
	if (status == GNP_OK)
		status = add_outputs(&estimate, datatype, pool, response, error);
	if (status == GNP_OK)
		status = add_report(&estimate, o, task, &response->parameters, error);
done:
	gnp_estimate_clear(&estimate);
	free(n);
	free(p);
	return status;
}

const struct gnp_operation gnp_operation_estimate = {
	.name = "estimate",
	.help = "Normals, curvatures and other local geometry at every point of a cloud.",
	.inputs = inputs,
	.input_count = sizeof inputs / sizeof inputs[0],
	.outputs = outputs,
	.output_count = sizeof outputs / sizeof outputs[0],
	.parameters = parameters,
	.parameter_count = sizeof parameters / sizeof parameters[0],
	.defaults = defaults,
	.resolve = resolve,
	.memory = memory,
	.run = run,
};
