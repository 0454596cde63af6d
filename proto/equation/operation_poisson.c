/* The operation `poisson`: its descriptor, and the way from tensors to gnp_poisson_solve and back. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "core/base/memory.h"
#include "core/operators/energy.h"
#include "proto/equation/operation_conditions.h"

struct options {
	struct gnp_equation_options equation;
	uint64_t outputs;
};

static const struct gnp_tensor_info inputs[] = {
	GNP_COMMON_INPUTS,
	{"source", GNP_FP64, 2, {-1, -2}, true, "right-hand sides f, a column each; 0 when absent"},
	GNP_CONDITIONS_INPUTS,
};

enum output { SOLUTION, RESIDUAL, MISFIT, MEAN, OUTPUTS };
static const struct gnp_tensor_info outputs[OUTPUTS] = {
	[SOLUTION] = {"solution", GNP_FP64, 2, {-1, -2}, false, "u at every point, a column a right-hand side"},
	[RESIDUAL] = {"residual", GNP_FP64, 1, {-2}, true,
	              "relative residual of the system, or of the normal equations of least squares"},
	[MISFIT] = {"misfit", GNP_FP64, 1, {-2}, true,
	            "||alpha u - Delta u - f|| / ||f|| over all points that are not fixed"},
	[MEAN] = {"mean", GNP_FP64, 1, {-2}, true,
	          "the constant taken off f so that a solution exists, the largest over components"},
};

#define FIELD(name) offsetof(struct options, equation.core.name)
static const struct gnp_parameter parameters[] = {
	{"screening", GNP_PARAMETER_NUMBER, FIELD(screening), 0, 1e100, NULL,
	 "alpha in alpha u - Delta u = f; 0: Delta u = -f, u of zero mean"},
	{"mean", GNP_PARAMETER_CHOICE, FIELD(mean), 0, 0, gnp_equation_means,
	 "which mean is zero: over the surface, or over the list of points"},
	GNP_EQUATION_SYSTEM(struct options),
	GNP_EQUATION_SOLVER(struct options),
	GNP_EQUATION_DISCRETISATION(struct options),
	GNP_COMMON_OUTPUTS(struct options),
};
#undef FIELD

static void defaults(void *options)
{
	struct options *o = options;
	gnp_equation_defaults(&o->equation);
	o->outputs = (UINT64_C(1) << OUTPUTS) - 1;
}

static gnp_status check(struct gnp_call *call, struct gnp_error *error)
{
	static const char *const some[] = {"source", "source_points", "values", "flux"};
	gnp_status status = gnp_equation_check(call, error);
	if (status == GNP_OK)
		status = gnp_conditions_check(call, "source", error);
	for (size_t i = 0; i < sizeof some / sizeof *some; i++)
		if (status != GNP_OK || gnp_tensors_find(&call->request->inputs, some[i]))
			return status;
	return gnp_error_set(error, GNP_INVALID_ARGUMENT,
	                     "input \"source\": missing, and no source_points, values or flux instead");
}

static size_t memory(const struct gnp_call *call)
{
	return gnp_equation_memory(call, gnp_call_options(call), gnp_conditions_sides(call, "source"));
}

/* Everything a request holds while it runs. */
struct work {
	struct gnp_common_cloud cloud;
	struct gnp_conditions conditions;
	double *solution;
	struct gnp_poisson_report *reports;
	size_t sides;
	struct gnp_prepared_entry *entry;
	bool found;
};

static void work_clear(struct work *work)
{
	gnp_prepared_release(work->entry);
	gnp_common_cloud_clear(&work->cloud);
	gnp_conditions_clear(&work->conditions);
	free(work->solution);
	free(work->reports);
}

static gnp_status read_inputs(const struct gnp_call *call, struct work *work, struct gnp_error *error)
{
	gnp_status status = gnp_common_cloud_read(call->request, &work->cloud, error);
	if (status == GNP_OK)
		status = gnp_conditions_read(call, work->cloud.count, work->sides, &work->conditions, error);
	if (status != GNP_OK)
		return status;
	size_t count;
	bool fits = gnp_size_multiply(work->cloud.count, work->sides, &count);
	work->solution = fits ? gnp_array_new(count, sizeof *work->solution) : NULL;
	work->reports = gnp_array_zero(work->sides, sizeof *work->reports);
	if (work->solution && work->reports)
		return GNP_OK;
	return gnp_error_set(error, GNP_OUT_OF_MEMORY, "solution: no memory for %zu columns", work->sides);
}

static gnp_status add_solution(struct work *work, struct gnp_tensors *to, struct gnp_error *error)
{
	size_t shape[] = {work->cloud.count, work->sides};
	gnp_status status = gnp_tensors_add_data(to, outputs[SOLUTION].name, GNP_FP64, 2, shape, work->solution, true, NULL,
	                                         error);
	if (status == GNP_OK)
		work->solution = NULL;
	return status;
}

static double number_of(const struct gnp_poisson_report *report, int output)
{
	return output == RESIDUAL ? report->residual : output == MISFIT ? report->misfit : report->mean;
}

static gnp_status add_outputs(uint64_t wanted, struct work *work, struct gnp_tensors *to, struct gnp_error *error)
{
	gnp_status status = wanted & 1 ? add_solution(work, to, error) : GNP_OK;
	for (int output = RESIDUAL; output < OUTPUTS && status == GNP_OK; output++) {
		struct gnp_tensor *tensor;
		if (!(wanted >> output & 1))
			continue;
		status = gnp_tensors_add(to, outputs[output].name, GNP_FP64, 1, &work->sides, &tensor, error);
		for (size_t s = 0; s < work->sides && status == GNP_OK; s++)
			((double *)tensor->data)[s] = number_of(&work->reports[s], output);
	}
	return status;
}

/* The worst of all right-hand sides. */
struct worst {
	size_t removed, iterations, unbelievable;
	double residual, energy; /* energy: NaN where it is not known */
};

static struct worst worst_of(const struct work *work)
{
	struct worst worst = {.energy = NAN};
	for (size_t s = 0; s < work->sides; s++) {
		const struct gnp_poisson_report *report = &work->reports[s];
		worst.removed += report->mean_removed != 0;
		worst.iterations = report->iterations > worst.iterations ? report->iterations : worst.iterations;
		worst.residual = fmax(worst.residual, report->residual);
		bool believable = report->energy >= GNP_ENERGY_LEAST && report->energy <= GNP_ENERGY_MOST;
		worst.unbelievable += !isnan(report->energy) && !believable;
		if (isnan(worst.energy) || fabs(report->energy - 1) > fabs(worst.energy - 1))
			worst.energy = report->energy;
	}
	return worst;
}

static void warn(const struct worst *worst, size_t sides, bool direct, bool closed, struct gnp_warnings *warnings)
{
	static const double residual_most = 1e-6; /* direct solutions of good systems have 1e-9 and less */
	if (direct && worst->residual > residual_most)
		gnp_warnings_add(warnings, GNP_WARNING_RESIDUAL,
		                 "the system was solved to a relative residual of %.3g, need at most %g: it is near singular, "
		                 "the points are too few or too uneven for its stencils", worst->residual, residual_most);
	if (worst->removed)
		gnp_warnings_add(warnings, GNP_WARNING_MEAN,
		                 "%zu of %zu right-hand sides had no zero mean: it was removed (output mean)", worst->removed,
		                 sides);
	if (worst->unbelievable)
		gnp_warnings_add(warnings, GNP_WARNING_ENERGY,
		                 "%zu of %zu solutions are not to be believed: their energy is up to %.3g times what the "
		                 "right-hand side explains, need %g to %g: %s", worst->unbelievable, sides, worst->energy,
		                 GNP_ENERGY_LEAST, GNP_ENERGY_MOST,
		                 closed ? "the cloud does not resolve the surface or the source"
		                        : "the surface has a boundary where values have to be given (fixed)");
}

static gnp_status add_report(const struct work *work, const struct options *o, const struct gnp_task *task,
                             struct gnp_values *report, struct gnp_error *error)
{
	const struct gnp_poisson_info info = gnp_poisson_info(gnp_prepared_object(work->entry));
	const struct worst worst = worst_of(work);
	warn(&worst, work->sides, info.solver == GNP_SOLVER_DIRECT,
	     gnp_domain_is_closed(gnp_poisson_domain(gnp_prepared_object(work->entry))), gnp_task_warnings(task));
	gnp_status status = gnp_equation_report(&info, work->found, &o->equation, report, error);
	if (status == GNP_OK)
		status = gnp_values_add_integer(report, "right_hand_sides", (int64_t)work->sides, error);
	if (status == GNP_OK)
		status = gnp_values_add_integer(report, "iterations", (int64_t)worst.iterations, error);
	if (status == GNP_OK)
		status = gnp_values_add_number(report, "residual", worst.residual, error);
	if (status == GNP_OK && isfinite(worst.energy))
		status = gnp_values_add_number(report, "energy", worst.energy, error);
	if (status != GNP_OK)
		return status;
	return gnp_equation_report_end(gnp_domain_facts(gnp_poisson_domain(gnp_prepared_object(work->entry))), task, report,
	                               error);
}

static gnp_status run(const struct gnp_call *call, struct gnp_pool *pool, struct gnp_task *task,
                      struct gnp_response *response, struct gnp_error *error)
{
	const struct options *given = gnp_call_options(call);
	struct options o = *given;
	struct work work = {.sides = gnp_conditions_sides(call, "source")};
	gnp_status status = read_inputs(call, &work, error);
	o.equation.core.fixed = work.conditions.fixed;
	if (status == GNP_OK)
		status = gnp_equation_get(call, &gnp_equation_poisson, &o.equation, &work.cloud, pool, task, &work.entry,
		                          &work.found, error);
	if (status == GNP_OK)
		status = gnp_conditions_load(&work.conditions, gnp_prepared_object(work.entry), pool, task, error);
	if (status == GNP_OK)
		status = gnp_poisson_solve(gnp_prepared_object(work.entry), work.conditions.source, work.conditions.values,
		                           work.sides, pool, task, work.solution, work.reports, error);
	gnp_task_stage(task, GNP_STAGE_ENCODE, 0);
	if (status == GNP_OK)
		status = add_report(&work, &o, task, &response->parameters, error);
	if (status == GNP_OK)
		status = add_outputs(o.outputs, &work, &response->outputs, error);
	work_clear(&work);
	return status;
}

GNP_OPERATION(poisson, "Solves alpha u - Delta u = f on the surface of a cloud, for any number of right-hand sides.",
              .resolve = gnp_equation_resolve);
