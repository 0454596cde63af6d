/* The operation `geodesic`: its descriptor, and the way from tensors to distances, vectors and logs (geodesic.h) and
 * back. */
#include <stdlib.h>

#include "core/base/memory.h"
#include "core/geodesic/geodesic.h"
#include "proto/equation/operation_equation.h"

struct options {
	struct gnp_equation_options equation; /* its domain alone counts */
	int source;
	bool log;
	uint64_t outputs;
};

static const struct gnp_tensor_info inputs[] = {
	GNP_COMMON_INPUTS,
	{"sources", GNP_BOOL, 1, {-1}, true,
	 "1 at the points that distances are taken from; the parameter source when absent"},
	{"vectors", GNP_FP64, 2, {-1, 3}, true,
	 "at the sources: their tangential parts are carried along the shortest ways in parallel; other rows are not read"},
	{"pairs", GNP_INT64, 2, {-2, 2}, true, "points, by index, whose distance from each other is wanted"},
};

enum output { DISTANCE, PAIR_DISTANCE, PARALLEL, LOG, BASIS, OUTPUTS };

static const struct gnp_tensor_info outputs[] = {
	[DISTANCE] = {"distance", GNP_FP64, 1, {-1}, false,
	              "along the surface to the nearest source [length]; infinite on parts of the cloud without one and at "
	              "dropped points"},
	[PAIR_DISTANCE] = {"pair_distance", GNP_FP64, 1, {-2}, true,
	                   "of each of the pairs [length], whatever the sources; infinite where no way leads"},
	[PARALLEL] = {"parallel", GNP_FP64, 2, {-1, 3}, true,
	              "the nearest source's vector, carried along the shortest way in parallel; zero where none leads"},
	[LOG] = {"log", GNP_FP64, 2, {-1, 2}, true,
	         "in which direction the shortest way from the source sets out, times its length [length], in the basis; "
	         "zero where none leads"},
	[BASIS] = {"basis", GNP_FP64, 2, {2, 3}, true,
	           "of log: two unit vectors tangent at the source, a right-handed frame with its normal"},
};

static const struct gnp_parameter parameters[] = {
	{"source", GNP_PARAMETER_INTEGER, offsetof(struct options, source), 0, 2147483647, NULL,
	 "the point that distances are taken from, without the input sources"},
	{"log", GNP_PARAMETER_BOOL, offsetof(struct options, log), 0, 0, NULL,
	 "the log map of a single source, too: where every point lies in its tangent plane"},
	GNP_EQUATION_FILTER(struct options),
	GNP_COMMON_PARAMETERS(struct options, equation.core.laplacian.domain.estimate, equation.weights),
	GNP_COMMON_OUTPUTS(struct options),
};

static void defaults(void *options)
{
	struct options *o = options;
	gnp_equation_defaults(&o->equation);
	o->source = 0;
	o->log = false;
	o->outputs = (UINT64_C(1) << OUTPUTS) - 1;
}

/* What an output is made of has to be there where it is asked for by name; else there is none of it. */
static gnp_status settle_outputs(const struct gnp_request *request, struct options *o, struct gnp_error *error)
{
	static const char *const needs[] = {
		[PAIR_DISTANCE] = "the input pairs", [PARALLEL] = "the input vectors", [LOG] = "log=true", [BASIS] = "log=true"};
	const bool there[] = {[DISTANCE] = true, [PAIR_DISTANCE] = gnp_tensors_find(&request->inputs, "pairs"),
	                      [PARALLEL] = gnp_tensors_find(&request->inputs, "vectors"), [LOG] = o->log, [BASIS] = o->log};
	bool by_name = request->output_count || o->outputs != (UINT64_C(1) << OUTPUTS) - 1;
	for (int i = 0; i < OUTPUTS; i++) {
		if (there[i] || !(o->outputs >> i & 1))
			continue;
		if (by_name)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: needs %s", outputs[i].name, needs[i]);
		o->outputs &= ~(UINT64_C(1) << i);
	}
	return GNP_OK;
}

static gnp_status check(struct gnp_call *call, struct gnp_error *error)
{
	const struct options *o = gnp_call_options(call);
	gnp_status status = settle_outputs(call->request, (void *)call->options, error);
	if (status == GNP_OK)
		status = gnp_equation_check(call, error);
	if (status == GNP_OK && !gnp_tensors_find(&call->request->inputs, "sources") && (size_t)o->source >= call->points)
		status = gnp_error_set(error, GNP_INVALID_ARGUMENT, "source: got %d, need at most %zu", o->source,
		                       call->points - 1);
	return status;
}

static size_t pairs_of(const struct gnp_call *call)
{
	const struct gnp_tensor *pairs = gnp_tensors_find(&call->request->inputs, "pairs");
	return pairs ? pairs->shape[0] : 0;
}

static size_t memory(const struct gnp_call *call)
{
	enum { PAIR = 48, FRONTS = 100, VECTORS = 48, LOGS = 16 }; /* beside what it takes to make the triangles */
	const struct options *o = gnp_call_options(call);
	size_t pairs = pairs_of(call), most = pairs ? FRONTS : 0;
	if (gnp_tensors_find(&call->request->inputs, "vectors"))
		most += VECTORS;
	if (o->log)
		most += LOGS;
	size_t distance = gnp_equation_distance_memory(call, &o->equation);
	return gnp_common_memory(pairs, PAIR, gnp_common_memory(call->points, most, distance));
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
	if (status == GNP_OK && o->log && *count != 1)
		status = gnp_error_set(error, GNP_INVALID_ARGUMENT, "log: got %zu sources, need 1", *count);
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

/* *pairs (*count), freed by the caller; NULL: none are asked for. */
static gnp_status read_pairs(const struct gnp_call *call, size_t points, uint32_t (**pairs)[2], size_t *count,
                             struct gnp_error *error)
{
	const struct gnp_tensor *tensor = gnp_tensors_find(&call->request->inputs, "pairs");
	*count = pairs_of(call);
	*pairs = tensor ? gnp_array_new(*count + 1, sizeof **pairs) : NULL;
	if (tensor && !*pairs)
		return gnp_no_memory("pairs", *count, "pairs", error);
	for (size_t i = 0; i < 2 * *count; i++) {
		double point = gnp_tensor_get(tensor, i);
		if (!(point >= 0 && point < (double)points && point == (double)(uint32_t)point))
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "pairs[%zu]: got %g, need an index below %zu", i / 2,
			                     point, points);
		(*pairs)[i / 2][i % 2] = (uint32_t)point;
	}
	return GNP_OK;
}

/* ---- Answers ---- */

/* What a call asks for, and where it goes. */
struct asked {
	const struct gnp_geodesic *geodesic;
	const uint32_t *sources;
	size_t points, source_count;
	struct gnp_tensors *outputs;
	struct gnp_pool *pool;
	struct gnp_task *task;
};

static gnp_status add(const struct asked *asked, enum output which, size_t rows, struct gnp_tensor **out,
                      struct gnp_error *error)
{
	const struct gnp_tensor_info *info = &outputs[which];
	return gnp_tensors_add(asked->outputs, info->name, info->datatype, info->rank,
	                       (size_t[]){rows, info->rank > 1 ? (size_t)info->shape[1] : 1}, out, error);
}

static gnp_status answer_distance(const struct asked *asked, struct gnp_error *error)
{
	struct gnp_tensor *distance;
	gnp_status status = add(asked, DISTANCE, asked->points, &distance, error);
	if (status != GNP_OK)
		return status;
	return gnp_geodesic_distance(asked->geodesic, asked->sources, asked->source_count, asked->pool, asked->task,
	                             distance->data, error);
}

static gnp_status answer_pairs(const struct asked *asked, const uint32_t (*pairs)[2], size_t count,
                               struct gnp_error *error)
{
	struct gnp_tensor *distance;
	gnp_status status = add(asked, PAIR_DISTANCE, count, &distance, error);
	if (status != GNP_OK)
		return status;
	return gnp_geodesic_pairs(asked->geodesic, pairs, count, asked->pool, asked->task, distance->data, error);
}

static gnp_status answer_parallel(const struct asked *asked, const struct gnp_tensor *given, struct gnp_error *error)
{
	struct gnp_tensor *parallel;
	gnp_status status = add(asked, PARALLEL, asked->points, &parallel, error);
	if (status != GNP_OK)
		return status;
	double *vectors = gnp_tensor_to_double(given);
	status = vectors ? gnp_geodesic_parallel(asked->geodesic, asked->sources, asked->source_count, vectors, asked->task,
	                                         parallel->data, error)
	                 : gnp_no_memory("vectors", asked->points, "points", error);
	free(vectors);
	return status;
}

static bool is_wanted(const struct options *o, enum output which)
{
	return o->outputs >> which & 1;
}

static gnp_status answer_log(const struct asked *asked, const struct options *o, struct gnp_error *error)
{
	double basis[2][3], *log = gnp_array_new(asked->points, 2 * sizeof *log);
	gnp_status status = log ? gnp_geodesic_log(asked->geodesic, asked->sources[0], asked->pool, asked->task, log, basis,
	                                           error)
	                        : gnp_no_memory("log", asked->points, "points", error);
	if (status == GNP_OK && is_wanted(o, LOG))
		status = gnp_common_add_numbers(asked->outputs, &outputs[LOG], GNP_FP64, asked->points, &log, asked->task, error);
	if (status == GNP_OK && is_wanted(o, BASIS))
		status = gnp_common_add_copy(asked->outputs, &outputs[BASIS], 2, basis, error);
	free(log);
	return status;
}

static gnp_status answer(const struct asked *asked, const struct gnp_call *call, const uint32_t (*pairs)[2],
                         size_t pair_count, struct gnp_error *error)
{
	const struct options *o = gnp_call_options(call);
	const struct gnp_tensor *vectors = gnp_tensors_find(&call->request->inputs, "vectors");
	gnp_status status = is_wanted(o, DISTANCE) ? answer_distance(asked, error) : GNP_OK;
	if (status == GNP_OK && is_wanted(o, PAIR_DISTANCE))
		status = answer_pairs(asked, pairs, pair_count, error);
	if (status == GNP_OK && is_wanted(o, PARALLEL))
		status = answer_parallel(asked, vectors, error);
	bool log = is_wanted(o, LOG) || is_wanted(o, BASIS);
	return status == GNP_OK && log ? answer_log(asked, o, error) : status;
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
	uint32_t *sources = NULL, (*pairs)[2] = NULL;
	size_t count = 0, pair_count = 0;
	bool found = false;
	gnp_status status = gnp_common_cloud_read(call->request, &cloud, error);
	if (status == GNP_OK)
		status = read_sources(call, o, cloud.count, &sources, &count, error);
	if (status == GNP_OK)
		status = read_pairs(call, cloud.count, &pairs, &pair_count, error);
	if (status == GNP_OK)
		status = gnp_equation_get(call, &kind, &o->equation, &cloud, pool, task, &entry, &found, error);
	if (status == GNP_OK) {
		const struct asked asked = {gnp_prepared_object(entry), sources, cloud.count, count, &response->outputs, pool,
		                            task};
		status = answer(&asked, call, pairs, pair_count, error);
	}
	gnp_task_stage(task, GNP_STAGE_ENCODE, 0);
	if (status == GNP_OK)
		status = add_report(gnp_prepared_object(entry), found, count, o, task, &response->parameters, error);
	free(sources);
	free(pairs);
	gnp_prepared_release(entry);
	gnp_common_cloud_clear(&cloud);
	return status;
}

GNP_OPERATION(geodesic,
              "Distances along the surface of a cloud from a set of its points, parallel transport and the log map.",
              .resolve = gnp_equation_resolve);
