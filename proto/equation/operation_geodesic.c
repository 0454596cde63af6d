/* The operation `geodesic`: its descriptor, and the way from tensors to gnp_geodesic_distance and back. */
#include <stdlib.h>

#include "core/base/memory.h"
#include "core/equations/geodesic.h"
#include "proto/equation/operation_equation.h"

struct options {
	struct gnp_equation_options equation; /* its domain alone counts */
	int source;
};

static const struct gnp_tensor_info inputs[] = {
	GNP_COMMON_INPUTS,
	{"sources", GNP_BOOL, 1, {-1}, true,
	 "1 at the points that distances are taken from; the parameter source when absent"},
};

static const struct gnp_tensor_info outputs[] = {
	{"distance", GNP_FP64, 1, {-1}, false,
	 "along the surface to the nearest source [length]; infinite on parts of the cloud without one and at dropped "
	 "points"},
};

static const struct gnp_parameter parameters[] = {
	{"source", GNP_PARAMETER_INTEGER, offsetof(struct options, source), 0, 2147483647, NULL,
	 "the point that distances are taken from, without the input sources"},
	GNP_EQUATION_FILTER(struct options),
	GNP_COMMON_PARAMETERS(struct options, equation.core.laplacian.domain.estimate, equation.weights),
};

static void defaults(void *options)
{
	struct options *o = options;
	gnp_equation_defaults(&o->equation);
	o->source = 0;
}

static gnp_status check(struct gnp_call *call, struct gnp_error *error)
{
	const struct options *o = gnp_call_options(call);
	gnp_status status = gnp_equation_check(call, error);
	if (status == GNP_OK && !gnp_tensors_find(&call->request->inputs, "sources") && (size_t)o->source >= call->points)
		status = gnp_error_set(error, GNP_INVALID_ARGUMENT, "source: got %d, need at most %zu", o->source,
		                       call->points - 1);
	return status;
}

static size_t memory(const struct gnp_call *call)
{
	return gnp_equation_distance_memory(call, gnp_call_options(call));
}

/* ---- The operator ---- */

static gnp_status make(const struct gnp_cloud *cloud, const struct gnp_poisson_options *options, struct gnp_pool *pool,
                       struct gnp_task *task, void **object, size_t *bytes, struct gnp_error *error)
{
	struct gnp_geodesic *geodesic;
	gnp_status status = gnp_geodesic_create(cloud, &options->laplacian.domain, pool, task, &geodesic, error);
	if (status != GNP_OK)
		return status;
	*object = geodesic;
	*bytes = gnp_geodesic_bytes(geodesic);
	return GNP_OK;
}

static void destroy(void *object)
{
	gnp_geodesic_free(object);
}

static const struct gnp_equation_kind kind = {"geodesic", make, {gnp_equation_make_prepared, destroy}};

/* ---- Sources ---- */

/* *sources (count), freed by the caller. */
static gnp_status read_sources(const struct gnp_call *call, const struct options *o, size_t points, uint32_t **sources,
                               size_t *count, struct gnp_error *error)
{
	unsigned char *mask;
	gnp_status status = gnp_common_mask_read(call->request, "sources", &mask, error);
	*count = mask ? 0 : 1;
	for (size_t i = 0; mask && i < points; i++)
		*count += mask[i];
	if (status == GNP_OK && *count == 0)
		status = gnp_error_set(error, GNP_INVALID_ARGUMENT, "sources: got none, need at least one point");
	*sources = status == GNP_OK ? gnp_array_new(*count, sizeof **sources) : NULL;
	if (status == GNP_OK && !*sources)
		status = gnp_error_set(error, GNP_OUT_OF_MEMORY, "sources: no memory for %zu points", *count);
	size_t made = 0;
	for (size_t i = 0; status == GNP_OK && mask && i < points; i++)
		if (mask[i])
			(*sources)[made++] = (uint32_t)i;
	if (status == GNP_OK && !mask)
		(*sources)[0] = (uint32_t)o->source;
	free(mask);
	return status;
}

static gnp_status add_report(const struct gnp_geodesic *geodesic, bool found, size_t sources, const struct options *o,
                             const struct gnp_task *task, struct gnp_values *report, struct gnp_error *error)
{
	const struct gnp_estimate_options *estimate = &o->equation.core.laplacian.domain.estimate;
	const struct gnp_common_facts facts = gnp_equation_facts(gnp_domain_facts(gnp_geodesic_domain(geodesic)));
	gnp_status status = gnp_common_report(&facts, estimate, report, error);
	if (status == GNP_OK)
		status = gnp_values_add_bool(report, "operator_kept", found, error);
	if (status == GNP_OK)
		status = gnp_values_add_integer(report, "sources", (int64_t)sources, error);
	if (status != GNP_OK)
		return status;
	return gnp_equation_report_end(gnp_domain_facts(gnp_geodesic_domain(geodesic)), task, report, error);
}

static gnp_status run(const struct gnp_call *call, struct gnp_pool *pool, struct gnp_task *task,
                      struct gnp_response *response, struct gnp_error *error)
{
	const struct options *o = gnp_call_options(call);
	struct gnp_common_cloud cloud = {0};
	struct gnp_prepared_entry *entry = NULL;
	struct gnp_tensor *distance;
	uint32_t *sources = NULL;
	size_t count = 0;
	bool found = false;
	gnp_status status = gnp_common_cloud_read(call->request, &cloud, error);
	if (status == GNP_OK)
		status = read_sources(call, o, cloud.count, &sources, &count, error);
	if (status == GNP_OK)
		status = gnp_equation_get(call, &kind, &o->equation, &cloud, pool, task, &entry, &found, error);
	if (status == GNP_OK)
		status = gnp_tensors_add(&response->outputs, outputs[0].name, GNP_FP64, 1, &cloud.count, &distance, error);
	if (status == GNP_OK)
		status = gnp_geodesic_distance(gnp_prepared_object(entry), sources, count, pool, task, distance->data, error);
	gnp_task_stage(task, GNP_STAGE_ENCODE, 0);
	if (status == GNP_OK)
		status = add_report(gnp_prepared_object(entry), found, count, o, task, &response->parameters, error);
	free(sources);
	gnp_prepared_release(entry);
	gnp_common_cloud_clear(&cloud);
	return status;
}

GNP_OPERATION(geodesic, "Distances along the surface of a cloud from a set of its points, by the heat method.",
              .resolve = gnp_equation_resolve);
