#include "core/equations/poisson.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/cells/volume.h"
#include "core/equations/poisson_parts.h"
#include "core/operators/interpolation.h"
#include "core/operators/operator_check.h"

struct gnp_poisson_options gnp_poisson_defaults(void)
{
	return (struct gnp_poisson_options){.laplacian = gnp_laplacian_defaults(), .solver = GNP_SOLVER_AUTO, .mean = GNP_MEAN_AREA,
	                                    .tolerance = 1e-8, .iterations = 500};
}

struct gnp_poisson *gnp_poisson_retain(struct gnp_poisson *poisson)
{
	atomic_fetch_add(&poisson->references, 1);
	return poisson;
}

void gnp_poisson_release(struct gnp_poisson *poisson)
{
	if (!poisson || atomic_fetch_sub(&poisson->references, 1) > 1)
		return;
	gnp_solver_free(poisson->solver);
	gnp_equation_clear(&poisson->equation);
	gnp_collocation_clear(&poisson->value);
	gnp_csr_clear(&poisson->outside);
	gnp_domain_clear(&poisson->domain);
	gnp_stiffness_clear(&poisson->volumes);
	free(poisson->response);
	free(poisson->weight);
	free(poisson);
}

const struct gnp_domain *gnp_poisson_domain(const struct gnp_poisson *poisson)
{
	return &poisson->domain;
}

const struct gnp_stiffness *gnp_poisson_volumes(const struct gnp_poisson *poisson)
{
	return &poisson->volumes;
}

void gnp_poisson_put_given(const struct gnp_poisson *poisson, const double *values, size_t count, double *u)
{
	const struct gnp_equation *equation = &poisson->equation;
	const struct gnp_copies *copies = &poisson->domain.copies;
	for (size_t c = 0; equation->given && c < equation->unknowns; c++) {
		size_t i = poisson->domain.prepared.order[equation->kept[c]];
		for (size_t r = 0; equation->given[c] && r < count; r++)
			u[i * count + r] = values[i * count + r];
	}
	for (size_t r = 0; r < count; r++) {
		for (size_t k = 0; k < copies->count; k++)
			if (copies->copy[k].fixed)
				u[copies->copy[k].original * count + r] = values[copies->copy[k].index * count + r];
		gnp_copies_spread(copies, u, count, r);
	}
}

struct gnp_poisson_info gnp_poisson_info(const struct gnp_poisson *poisson)
{
	const struct gnp_equation *equation = &poisson->equation;
	const struct gnp_domain *domain = &poisson->domain;
	struct gnp_csr value = gnp_collocation_view(&poisson->value, GNP_DERIVATIVE_VALUE);
	return (struct gnp_poisson_info){
		.points = domain->cloud_count, .unknowns = equation->unknowns, .components = equation->components.count,
		.isolated = equation->components.following, .dropped = domain->dropped, .reduced = equation->reduced, .open = domain->open,
		.bytes = sizeof *poisson + gnp_domain_bytes(domain) + gnp_equation_bytes(equation) + gnp_solver_bytes(poisson->solver) +
		         gnp_csr_bytes(&value) + gnp_csr_bytes(&poisson->outside) + gnp_stiffness_bytes(&poisson->volumes) +
		         2 * equation->unknowns * sizeof(double),
		.solver = gnp_solver_kind(poisson->solver), .system = equation->system, .why = poisson->why,
		.normals_estimated = domain->normals_estimated, .patches = domain->patches,
		.degenerate = domain->degenerate, .outliers = domain->outliers, .model = domain->model};
}

static gnp_status check_options(const struct gnp_poisson_options *options, struct gnp_error *error)
{
	if (!isfinite(options->screening))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "screening: got %g, need a finite number",
		                     options->screening);
	if (options->solver < GNP_SOLVER_AUTO || options->solver > GNP_SOLVER_ITERATIVE)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "solver: got %d, need 0..%d", options->solver, GNP_SOLVER_ITERATIVE);
	if (options->mean < GNP_MEAN_AREA || options->mean > GNP_MEAN_PLAIN)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "mean: got %d, need 0..%d", options->mean, GNP_MEAN_PLAIN);
	if (!(options->tolerance >= 1e-14 && options->tolerance <= 0.1))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "tolerance: got %g, need 1e-14..0.1", options->tolerance);
	if (options->iterations < 1 || options->iterations > 10000)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "iterations: got %d, need 1..10000", options->iterations);
	return GNP_OK;
}

/* A place is fixed where one of its points is. */
static void note_fixed_copies(struct gnp_copies *copies, const unsigned char *fixed, unsigned char *ordered)
{
	for (size_t k = 0; k < copies->count; k++) {
		struct gnp_copy *copy = &copies->copy[k];
		copy->fixed = fixed[copy->index] != 0;
		copy->original_fixed = fixed[copy->original] != 0;
		if (copy->fixed && copy->row != GNP_COPY_OUTSIDE)
			ordered[copy->row] = 1;
	}
}

/* The fixed points in curve order; *given stays NULL when there are none. */
static gnp_status order_fixed(struct gnp_domain *domain, const unsigned char *fixed, unsigned char **given,
                              struct gnp_error *error)
{
	size_t count = domain->prepared.count, found = 0;
	if (!fixed)
		return GNP_OK;
	unsigned char *ordered = gnp_array_new(count, 1);
	if (!ordered)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "fixed: no memory for %zu points", count);
	for (size_t i = 0; i < count; i++)
		ordered[i] = fixed[domain->prepared.order[i]] != 0;
	note_fixed_copies(&domain->copies, fixed, ordered);
	for (size_t i = 0; i < count; i++)
		found += ordered[i];
	if (found == 0) {
		free(ordered);
		return GNP_OK;
	}
	*given = ordered;
	return GNP_OK;
}

static gnp_status assemble_values(struct gnp_poisson *poisson, const struct gnp_laplacian_options *options,
                                  const unsigned char *given, struct gnp_pool *pool, struct gnp_task *task,
                                  struct gnp_error *error)
{
	struct gnp_laplacian_options wanted = *options;
	if (options->system != GNP_SYSTEM_LEAST_SQUARES)
		return GNP_OK;
	wanted.which = GNP_DERIVATIVE_BIT(GNP_DERIVATIVE_VALUE);
	return gnp_laplacian_assemble(&poisson->domain, &wanted, given, pool, task, &poisson->value, error);
}

static gnp_status weigh(struct gnp_poisson *poisson, int mean, struct gnp_error *error)
{
	const struct gnp_equation *equation = &poisson->equation;
	poisson->weight = gnp_array_new(equation->unknowns, sizeof *poisson->weight);
	if (!poisson->weight)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "mean: no memory for %zu unknowns", equation->unknowns);
	for (size_t c = 0; c < equation->unknowns; c++)
		poisson->weight[c] = mean == GNP_MEAN_AREA ? poisson->domain.area[equation->kept[c]] : 1;
	return GNP_OK;
}

/* The solution for 1 in every part that stands alone: by it the constant that makes f consistent follows from the
 * pinned solution. */
static gnp_status respond(struct gnp_poisson *poisson, struct gnp_pool *pool, struct gnp_task *task,
                          struct gnp_error *error)
{
	const struct gnp_equation *equation = &poisson->equation;
	size_t n = equation->unknowns;
	struct gnp_krylov_report report;
	if (equation->components.count == 0 || equation->system == GNP_SYSTEM_LEAST_SQUARES)
		return GNP_OK;
	double *ones = gnp_array_new(n, sizeof *ones);
	poisson->response = gnp_array_new(n, sizeof *poisson->response);
	gnp_status status = GNP_OK;
	if (!ones || !poisson->response)
		status = gnp_error_set(error, GNP_OUT_OF_MEMORY, "solve: no memory for %zu unknowns", n);
	for (size_t c = 0; ones && c < n; c++)
		ones[c] = gnp_equation_part(equation, c) < equation->components.count;
	gnp_task_stage(task, GNP_STAGE_SOLVE, 0);
	if (status == GNP_OK)
		status = gnp_solver_apply(poisson->solver, ones, 1, &poisson->krylov, pool, task, poisson->response, &report, error);
	free(ones);
	return status;
}

/* Solves for random right-hand sides, nothing given but zeros. Iterations, which take longer than preparing does, have
 * one and stop early; where they do not converge, whoever asks for a solution is told. */
static gnp_status check_operator(struct gnp_poisson *poisson, struct gnp_pool *pool, struct gnp_task *task,
                                 struct gnp_warnings *warnings, struct gnp_error *error)
{
	enum { SIDES = 4, ITERATIONS = 50 };
	bool direct = gnp_solver_kind(poisson->solver) == GNP_SOLVER_DIRECT;
	size_t sides = direct ? SIDES : 1, entries = poisson->domain.cloud_count * sides;
	const struct gnp_krylov_options wanted = poisson->krylov;
	struct gnp_poisson_report reports[SIDES] = {{.energy = 1}};
	double energy[SIDES], *source = gnp_array_new(entries, 3 * sizeof *source);
	if (!source)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "operator: no memory for %zu numbers", 3 * entries);
	gnp_operator_check_draw(entries, source);
	memset(source + entries, 0, entries * sizeof *source);
	poisson->krylov = (struct gnp_krylov_options){.tolerance = fmax(wanted.tolerance, 1e-3), .iterations = ITERATIONS};
	struct gnp_error own = {0};
	gnp_status status = gnp_poisson_solve(poisson, source, source + entries, sides, pool, task, source + 2 * entries, reports, &own);
	poisson->krylov = wanted;
	free(source);
	for (size_t r = 0; r < sides; r++)
		energy[r] = reports[r].energy;
	if (status == GNP_OK)
		gnp_operator_check_energy(energy, sides, &poisson->domain, warnings);
	return status == GNP_OK || (status == GNP_NO_CONVERGENCE && !direct) ? GNP_OK : gnp_error_set(error, status, "%s", own.text);
}

/* Beyond this the Laplacian is lost in alpha's rounding, and squares of products overflow. */
static gnp_status check_screening(const struct gnp_domain *domain, double alpha, struct gnp_error *error)
{
	static const double most = 1e12;
	double area = 0;
	for (size_t i = 0; i < domain->prepared.count; i++)
		area += domain->area[i] / (double)domain->prepared.count;
	if (fabs(alpha) * area <= most)
		return GNP_OK;
	return gnp_error_set(error, GNP_INVALID_ARGUMENT,
	                     "screening: got %g (of heat: one over dt), need at most %g, %g over the area of %g that a point "
	                                                  "stands for", alpha, most / area, most, area);
}

/* ---- Which operator ---- */

/* The operator of a system, its solver, and what is found against them. */
static gnp_status make_operator(struct gnp_poisson *poisson, const struct gnp_poisson_options *options, int system,
                                const unsigned char *given, struct gnp_pool *pool, struct gnp_task *task,
                                struct gnp_warnings *warnings, struct gnp_error *error)
{
	struct gnp_laplacian_options laplacian = options->laplacian;
	laplacian.system = system;
	laplacian.stiffness = &poisson->volumes;
	gnp_status status = gnp_equation_make(&poisson->domain, &laplacian, options->screening, given, pool, task,
	                                      &poisson->equation, error);
	if (status == GNP_OK)
		status = assemble_values(poisson, &laplacian, given, pool, task, error);
	if (status == GNP_OK)
		status = weigh(poisson, options->mean, error);
	if (status == GNP_OK)
		status = gnp_solver_create(&poisson->equation, &poisson->domain, options->solver, options->memory_limit, pool,
		                           task, &poisson->solver, error);
	if (status == GNP_OK)
		status = respond(poisson, pool, task, error);
	bool checks_itself = system == GNP_SYSTEM_SYMMETRIC; /* it is what others are checked by */
	return status == GNP_OK && !checks_itself ? check_operator(poisson, pool, task, warnings, error) : status;
}

static void drop_operator(struct gnp_poisson *poisson)
{
	gnp_solver_free(poisson->solver);
	gnp_equation_clear(&poisson->equation);
	gnp_collocation_clear(&poisson->value);
	free(poisson->response);
	free(poisson->weight);
	poisson->solver = NULL;
	poisson->response = poisson->weight = NULL;
}

/* Collocation has no condition at open edges, and may have solutions that no surface has: where either shows, the
 * symmetric operator answers. */
static gnp_status choose_operator(struct gnp_poisson *poisson, const struct gnp_poisson_options *options,
                                  const unsigned char *given, struct gnp_pool *pool, struct gnp_task *task,
                                  struct gnp_error *error)
{
	struct gnp_warnings found = {0}, *warnings = gnp_task_warnings(task), before = warnings ? *warnings : found;
	struct gnp_error own = {0};
	poisson->why = "stars are open, at a rim or where normals disagree";
	if (gnp_domain_is_closed(&poisson->domain)) {
		gnp_status status = make_operator(poisson, options, GNP_SYSTEM_SQUARE, given, pool, task, &found, &own);
		bool failed = status == GNP_SINGULAR || status == GNP_NO_CONVERGENCE;
		if (status != GNP_OK && !failed)
			return gnp_error_set(error, status, "%s", own.text);
		poisson->why = "the surface is closed, and two discretisations agree";
		if (!failed && gnp_warnings_count(&found) == 0)
			return GNP_OK;
		drop_operator(poisson);
		poisson->why = "collocation was not confirmed by it";
		if (warnings)
			*warnings = before;
	}
	return make_operator(poisson, options, GNP_SYSTEM_SYMMETRIC, given, pool, task, warnings, error);
}

static gnp_status make(struct gnp_poisson *poisson, const struct gnp_poisson_options *options, struct gnp_pool *pool,
                       struct gnp_task *task, struct gnp_error *error)
{
	unsigned char *given = NULL;
	int system = options->laplacian.system;
	gnp_status status = check_screening(&poisson->domain, options->screening, error);
	if (status == GNP_OK)
		status = order_fixed(&poisson->domain, options->fixed, &given, error);
	if (status == GNP_OK && poisson->domain.dropped)
		status = gnp_interpolation_make(&poisson->domain.prepared, poisson->domain.dropped_points, poisson->domain.dropped,
		                                gnp_laplacian_degree(&options->laplacian), pool, task, &poisson->outside, error);
	if (status == GNP_OK)
		status = gnp_volume_stiffness(&poisson->domain.prepared, pool, task, &poisson->volumes, error);
	if (status == GNP_OK)
		gnp_operator_check_crossings(&poisson->domain.prepared, &poisson->volumes, gnp_task_warnings(task));
	if (status == GNP_OK)
		status = system == GNP_SYSTEM_AUTO ? choose_operator(poisson, options, given, pool, task, error)
		                                   : make_operator(poisson, options, system, given, pool, task,
		                                                   gnp_task_warnings(task), error);
	free(given);
	gnp_task_stage(task, GNP_STAGE_DONE, 0);
	return status;
}

gnp_status gnp_poisson_prepare_take(struct gnp_domain *domain, const struct gnp_poisson_options *options,
                                    struct gnp_pool *pool, struct gnp_task *task, struct gnp_poisson **out,
                                    struct gnp_error *error)
{
	struct gnp_poisson *poisson = gnp_array_zero(1, sizeof *poisson);
	gnp_status status = check_options(options, error);
	if (status == GNP_OK && !poisson)
		status = gnp_error_set(error, GNP_OUT_OF_MEMORY, "poisson: no memory");
	if (status != GNP_OK) {
		free(poisson);
		gnp_domain_clear(domain);
		return status;
	}
	poisson->references = 1;
	poisson->domain = *domain;
	*domain = (struct gnp_domain){.cloud_count = 0};
	poisson->krylov = (struct gnp_krylov_options){.tolerance = options->tolerance, .iterations = (size_t)options->iterations};
	status = make(poisson, options, pool, task, error);
	if (status == GNP_OK)
		*out = poisson;
	else
		gnp_poisson_release(poisson);
	return status;
}

gnp_status gnp_poisson_prepare(const struct gnp_cloud *cloud, const struct gnp_poisson_options *options,
                               struct gnp_pool *pool, struct gnp_task *task, struct gnp_poisson **out,
                               struct gnp_error *error)
{
	struct gnp_domain domain;
	gnp_status status = check_options(options, error);
	if (status == GNP_OK)
		status = gnp_domain_make(cloud, &options->laplacian.domain, pool, task, &domain, error);
	return status == GNP_OK ? gnp_poisson_prepare_take(&domain, options, pool, task, out, error) : status;
}
