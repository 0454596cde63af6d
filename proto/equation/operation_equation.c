#include "proto/equation/operation_equation.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/fit/taylor.h"

const char *const gnp_equation_systems[] = {"auto", "symmetric", "square", "least_squares", NULL};
const char *const gnp_equation_solvers[] = {"auto", "direct", "iterative", NULL};
const char *const gnp_equation_means[] = {"area", "plain", NULL};

void gnp_equation_defaults(struct gnp_equation_options *options)
{
	options->core = gnp_poisson_defaults();
	options->core.laplacian.domain.estimate = gnp_estimate_defaults();
	options->core.laplacian.domain.estimate.estimator = GNP_ESTIMATOR_GNP;
	options->core.laplacian.system = GNP_SYSTEM_AUTO;
	options->filter = false;
	strcpy(options->weights, GNP_COMMON_AUTO);
}

gnp_status gnp_equation_resolve(void *options, const struct gnp_models *models, struct gnp_error *error)
{
	struct gnp_equation_options *o = options;
	return gnp_common_resolve(&o->core.laplacian.domain.estimate, o->weights, GNP_COMMON_AUTO, models, error);
}

gnp_status gnp_equation_check(const struct gnp_call *call, struct gnp_error *error)
{
	enum { FEWEST = 12 }; /* as gnp_domain_make has it */
	const struct gnp_equation_options *options = gnp_call_options(call);
	const struct gnp_laplacian_options *l = &options->core.laplacian;
	unsigned degree = gnp_laplacian_degree(l);
	if (l->neighbors && (size_t)l->neighbors < gnp_taylor_size(degree))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "stencil: got %d, need 0 or at least %zu for function_degree %u", l->neighbors,
		                     gnp_taylor_size(degree), degree);
	return gnp_common_check_points(call, &l->domain.estimate, FEWEST, error);
}

size_t gnp_equation_sides(const struct gnp_call *call, const char *name)
{
	const struct gnp_tensor *tensor = gnp_tensors_find(&call->request->inputs, name);
	return !tensor ? 0 : tensor->rank > 1 ? tensor->shape[1] : 1;
}

/* Bytes a point to make an operator and its solver, a little above what test_memory_estimates.c measures: matrices have an entry for each point
 * of a stencil, and factors grow with the logarithm of the number of points. */
static double operator_width(size_t points, const struct gnp_poisson_options *options)
{
	enum { DIRECT_MOST = 250000 };
	bool direct = options->solver == GNP_SOLVER_DIRECT || (options->solver == GNP_SOLVER_AUTO && points <= DIRECT_MOST);
	enum { EDGES = 9 };
	bool square = options->laplacian.system != GNP_SYSTEM_LEAST_SQUARES;
	bool weak = options->laplacian.system == GNP_SYSTEM_SYMMETRIC;
	double stencil = weak ? EDGES : (double)gnp_laplacian_neighbors(&options->laplacian);
	double doublings = log2((double)points + 2);
	if (!direct)
		return square ? 400 + 50 * doublings + 12 * stencil : 400 + 50 * doublings + 75 * stencil;
	return square ? 750 + stencil * (19.5 * doublings - 105) : stencil * (31.5 * doublings - 27);
}

/* What is held beside the operator: the cloud, its domain with normals from before the fit, and for each side five numbers a point (source, values or a step's source, solution, and
 * what they are in the solver's order) and its reports; the solver itself takes a block of sides at a time. */
static size_t with_operator(const struct gnp_call *call, const struct gnp_equation_options *options, double width, size_t sides)
{
	enum { SIDE = 5 * sizeof(double), REPORTS = 192, BLOCK = 8, UNFITTED = 3 * sizeof(double) };
	size_t points = call->points, estimate = gnp_estimate_memory(points, gnp_common_given(call), &options->core.laplacian.domain.estimate);
	size_t fixed = gnp_common_memory(sides, REPORTS, gnp_common_memory(1, gnp_common_cloud_memory(call), estimate));
	size_t all = gnp_common_memory(points, (size_t)fmax(width, 0) + BLOCK * SIDE + UNFITTED, fixed);
	return gnp_common_memory(gnp_common_memory(points, sides, 0), SIDE, all);
}

size_t gnp_equation_memory(const struct gnp_call *call, const struct gnp_equation_options *options, size_t sides)
{
	return with_operator(call, options, operator_width(call->points, &options->core), sides);
}

size_t gnp_equation_distance_memory(const struct gnp_call *call, const struct gnp_equation_options *options)
{
	enum { TRIANGLES = 200 }; /* what there is of them beside what a domain takes while it is made; a front has less */
	const struct gnp_estimate_options *o = &options->core.laplacian.domain.estimate;
	size_t estimate = gnp_estimate_memory(call->points, gnp_common_given(call), o);
	return gnp_common_memory(call->points, TRIANGLES, gnp_common_memory(1, gnp_common_cloud_memory(call), estimate));
}

void gnp_equation_set_filter(struct gnp_equation_options *options, struct gnp_filter_options *filter)
{
	struct gnp_domain_options *domain = &options->core.laplacian.domain;
	*filter = gnp_filter_defaults();
	filter->estimate = domain->estimate;
	filter->project = true;
	domain->filter = options->filter ? filter : NULL;
	domain->project = options->filter;
}

/* Models by digest: all that are loaded where the cloud chooses. */
static int write_models(const struct gnp_call *call, const struct gnp_model *model, char *text, size_t size)
{
	int length = 0;
	if (model)
		return snprintf(text, size, "%s", model->sha256);
	for (size_t i = 0; i < gnp_models_count(call->models) && length < (int)size - GNP_SHA256_TEXT; i++)
		length += snprintf(text + length, size - (size_t)length, "%s", gnp_models_at(call->models, i)->sha256);
	return length;
}

static void write_key(const struct gnp_call *call, const struct gnp_equation_options *options, const char *word,
                      const struct gnp_common_cloud *cloud, char key[GNP_SHA256_TEXT])
{
	const struct gnp_poisson_options *o = &options->core;
	const struct gnp_laplacian_options *l = &o->laplacian;
	const struct gnp_estimate_options *e = &l->domain.estimate;
	char models[4096];
	/* Not as text: where memory is exhausted, the C library cannot print so many numbers at once, and says -1. */
	const int whole[] = {e->estimator, e->cover, e->k, e->degree, e->basis, e->weight, e->outliers, options->filter,
	                     l->system, l->degree, l->neighbors, o->solver, o->mean, o->iterations};
	const double reals[] = {l->drop, o->screening, o->tolerance};
	int named = e->estimator == GNP_ESTIMATOR_GNP ? write_models(call, e->model, models, sizeof models) : 0;
	const void *data[] = {word, &cloud->count, whole, reals, models, o->fixed, cloud->points, cloud->normals};
	const size_t size[] = {strlen(word), sizeof cloud->count, sizeof whole, sizeof reals, (size_t)named,
	                       o->fixed ? cloud->count : 0, 3 * cloud->count * sizeof(double),
	                       cloud->normals ? 3 * cloud->count * sizeof(double) : 0};
	gnp_sha256_text(data, size, sizeof size / sizeof *size, key);
}

/* ---- The operator ---- */

struct making {
	const struct gnp_equation_kind *kind;
	const struct gnp_equation_options *options;
	const struct gnp_common_cloud *cloud;
	struct gnp_pool *pool;
};

gnp_status gnp_equation_make_prepared(void *context, struct gnp_task *task, void **object, size_t *bytes,
                                      struct gnp_error *error)
{
	const struct making *making = context;
	const struct gnp_cloud cloud = {making->cloud->count, making->cloud->points, making->cloud->normals};
	struct gnp_equation_options options = *making->options;
	struct gnp_filter_options filter;
	gnp_equation_set_filter(&options, &filter);
	return making->kind->make(&cloud, &options.core, making->pool, task, object, bytes, error);
}

gnp_status gnp_equation_get(const struct gnp_call *call, const struct gnp_equation_kind *kind,
                            const struct gnp_equation_options *options,
                            const struct gnp_common_cloud *cloud, struct gnp_pool *pool, struct gnp_task *task,
                            struct gnp_prepared_entry **entry, bool *found, struct gnp_error *error)
{
	struct making making = {kind, options, cloud, pool};
	char key[GNP_SHA256_TEXT];
	write_key(call, options, kind->word, cloud, key);
	return gnp_prepared_get(call->cache, key, &kind->prepared, &making, task, entry, found, error);
}

static gnp_status make_poisson(const struct gnp_cloud *cloud, const struct gnp_poisson_options *options,
                               struct gnp_pool *pool,
                               struct gnp_task *task, void **object, size_t *bytes, struct gnp_error *error)
{
	struct gnp_poisson *poisson;
	gnp_status status = gnp_poisson_prepare(cloud, options, pool, task, &poisson, error);
	if (status != GNP_OK)
		return status;
	*object = poisson;
	*bytes = gnp_poisson_info(poisson).bytes;
	return GNP_OK;
}

static void free_poisson(void *object)
{
	gnp_poisson_release(object);
}

const struct gnp_equation_kind gnp_equation_poisson = {"poisson", make_poisson,
                                                       {gnp_equation_make_prepared, free_poisson}};

gnp_status gnp_equation_check_columns(const struct gnp_call *call, const char *name, const char *other,
                                      struct gnp_error *error)
{
	size_t sides = gnp_equation_sides(call, name), wanted = other ? gnp_equation_sides(call, other) : sides;
	if (!gnp_tensors_find(&call->request->inputs, name))
		return GNP_OK;
	if (sides == 0)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: got no column, need at least 1", name);
	if (sides != wanted)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: got %zu columns, need %zu as %s has", name, sides,
		                     wanted, other);
	return GNP_OK;
}

gnp_status gnp_equation_columns(const struct gnp_call *call, const char *name, double **values, size_t *sides,
                                struct gnp_error *error)
{
	const struct gnp_tensor *tensor = gnp_tensors_find(&call->request->inputs, name);
	*values = NULL;
	if (!tensor)
		return GNP_OK;
	*sides = gnp_equation_sides(call, name);
	*values = gnp_tensor_to_double(tensor);
	if (*values)
		return GNP_OK;
	return gnp_error_set(error, GNP_OUT_OF_MEMORY, "%s: no memory for %zu values", name, *sides * tensor->shape[0]);
}

/* ---- Reports ---- */

struct gnp_common_facts gnp_equation_facts(struct gnp_domain_facts surface)
{
	return (struct gnp_common_facts){surface.model, surface.normals_estimated != 0, surface.components, surface.patches,
	                                 surface.degenerate, surface.outliers};
}

gnp_status gnp_equation_report_end(struct gnp_domain_facts surface, const struct gnp_task *task,
                                   struct gnp_values *report, struct gnp_error *error)
{
	struct gnp_common_facts facts = gnp_equation_facts(surface);
	facts.components = 0;
	return gnp_common_report_end(&facts, task, report, error);
}

static gnp_status report_numbers(const struct gnp_poisson_info *info, struct gnp_values *report,
                                 struct gnp_error *error)
{
	const struct {
		const char *name;
		size_t value;
	} rows[] = {{"unknowns", info->unknowns}, {"components", info->components}, {"isolated", info->isolated},
	            {"dropped", info->dropped},
	            {"reduced_stencils", info->reduced}, {"open", info->open}, {"operator_bytes", info->bytes}};
	gnp_status status = GNP_OK;
	for (size_t i = 0; i < sizeof rows / sizeof *rows && status == GNP_OK; i++)
		status = gnp_values_add_integer(report, rows[i].name, (int64_t)rows[i].value, error);
	return status;
}

gnp_status gnp_equation_report(const struct gnp_poisson_info *info, bool found,
                               const struct gnp_equation_options *options,
                               struct gnp_values *report, struct gnp_error *error)
{
	const struct gnp_common_facts facts = {.model = info->model, .normals_estimated = info->normals_estimated != 0,
	                                       .patches = info->patches, .outliers = info->outliers};
	gnp_status status = gnp_common_report(&facts, &options->core.laplacian.domain.estimate, report, error);
	if (status == GNP_OK)
		status = gnp_values_add_bool(report, "operator_kept", found, error);
	if (status == GNP_OK)
		status = gnp_values_add_string(report, "solver", gnp_equation_solvers[info->solver], error);
	if (status == GNP_OK)
		status = gnp_values_add_string(report, "system", gnp_equation_systems[info->system], error);
	if (status == GNP_OK && info->why)
		status = gnp_values_add_string(report, "system_because", info->why, error);
	return status == GNP_OK ? report_numbers(info, report, error) : status;
}
