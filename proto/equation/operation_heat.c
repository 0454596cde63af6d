/* The operation `heat`: its descriptor, and the way from tensors to gnp_heat_run and back. */
#include <math.h>
#include <stdlib.h>

#include "core/base/memory.h"
#include "core/equations/heat.h"
#include "proto/equation/operation_conditions.h"

struct options {
	struct gnp_equation_options equation;
	double dt;
	int steps, scheme, snapshot_every;
	uint64_t outputs;
};

static const struct gnp_tensor_info inputs[] = {
	GNP_COMMON_INPUTS,
	{"initial", GNP_FP64, 2, {-1, -2}, true, "u at the start, a column each; 0 when absent"},
	{"source", GNP_FP64, 2, {-1, -2}, true, "heat added in unit time, a column each; 0 when absent"},
	GNP_CONDITIONS_INPUTS,
};

enum output { SOLUTION, SNAPSHOTS, SNAPSHOT_TIME, OUTPUTS };
static const struct gnp_tensor_info outputs[OUTPUTS] = {
	[SOLUTION] = {"solution", GNP_FP64, 2, {-1, -2}, true, "u after the steps, a column each"},
	[SNAPSHOTS] = {"snapshots", GNP_FP64, 3, {-4, -1, -2}, true, "u at the start, every so many steps, and at the end"},
	[SNAPSHOT_TIME] = {"snapshot_time", GNP_FP64, 1, {-4}, true, "when that was [length^2]"},
};

/* In the order of enum gnp_heat_scheme. */
static const char *const schemes[] = {"backward_euler", "tr_bdf2", NULL};

static const struct gnp_parameter parameters[] = {
	{"dt", GNP_PARAMETER_NUMBER, offsetof(struct options, dt), GNP_ABOVE_ZERO, 1e200, NULL,
	 "the step [length^2]; any is stable"},
	{"steps", GNP_PARAMETER_INTEGER, offsetof(struct options, steps), 1, 1e6, NULL,
	 "how many to take; all use one factor"},
	{"scheme", GNP_PARAMETER_CHOICE, offsetof(struct options, scheme), 0, 0, schemes,
	 "backward_euler: first order, never leaves the range that u and the source span; tr_bdf2: second order, L-stable, "
	 "two solutions a step; may overshoot where steps are long"},
	{"snapshot_every", GNP_PARAMETER_INTEGER, offsetof(struct options, snapshot_every), 0, 1e6, NULL,
	 "steps between snapshots, the start and the end among them; 0: none"},
	GNP_EQUATION_SYSTEM(struct options),
	GNP_EQUATION_SOLVER(struct options),
	GNP_EQUATION_DISCRETISATION(struct options),
	GNP_COMMON_OUTPUTS(struct options),
};

static void defaults(void *options)
{
	struct options *o = options;
	gnp_equation_defaults(&o->equation);
	o->equation.core.laplacian.system = GNP_SYSTEM_SYMMETRIC;
	o->dt = 1e-3;
	o->steps = 1;
	o->scheme = GNP_HEAT_BACKWARD_EULER;
	o->snapshot_every = 0;
	o->outputs = (UINT64_C(1) << OUTPUTS) - 1;
}

/* Snapshots that are asked for by name have to be made. */
static gnp_status settle_snapshots(const struct gnp_request *request, struct options *o, struct gnp_error *error)
{
	uint64_t all = (UINT64_C(1) << OUTPUTS) - 1, of_snapshots = all & ~(UINT64_C(1) << SOLUTION);
	bool by_name = request->output_count || o->outputs != all;
	if (o->snapshot_every == 0 && by_name && (o->outputs & of_snapshots))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: needs snapshot_every, got 0, need at least 1",
		                     outputs[o->outputs >> SNAPSHOTS & 1 ? SNAPSHOTS : SNAPSHOT_TIME].name);
	if (o->snapshot_every == 0)
		o->outputs &= ~of_snapshots;
	if (!(o->outputs & of_snapshots))
		o->snapshot_every = 0; /* nobody wants them */
	return GNP_OK;
}

static gnp_status check(struct gnp_call *call, struct gnp_error *error)
{
	static const char *const some[] = {"initial", "source", "source_points", "values", "flux"};
	gnp_status status = settle_snapshots(call->request, (void *)call->options, error);
	if (status == GNP_OK)
		status = gnp_equation_check(call, error);
	if (status == GNP_OK)
		status = gnp_conditions_check(call, "initial", error);
	for (size_t i = 0; i < sizeof some / sizeof *some; i++)
		if (status != GNP_OK || gnp_tensors_find(&call->request->inputs, some[i]))
			return status;
	return gnp_error_set(error, GNP_INVALID_ARGUMENT,
	                     "input \"initial\": missing, and no source, source_points, values or flux to begin with");
}

/* Numbers of the snapshots; SIZE_MAX: too many to count. */
static size_t snapshot_numbers(const struct options *o, size_t points, size_t sides)
{
	size_t kept = gnp_heat_snapshots((size_t)o->steps, (size_t)o->snapshot_every), numbers;
	bool fits = gnp_size_multiply(points, sides, &numbers) && gnp_size_multiply(numbers, kept, &numbers);
	return fits ? numbers : SIZE_MAX;
}

static size_t memory(const struct gnp_call *call)
{
	const struct options *o = gnp_call_options(call);
	size_t sides = gnp_conditions_sides(call, "initial");
	return gnp_common_memory(snapshot_numbers(o, call->points, sides), sizeof(double),
	                         gnp_equation_memory(call, &o->equation, sides));
}

static gnp_status add_report(const struct gnp_prepared_entry *entry, bool found, const struct options *o,
                             const struct gnp_task *task, struct gnp_values *report, struct gnp_error *error)
{
	const struct gnp_poisson_info info = gnp_poisson_info(gnp_prepared_object(entry));
	gnp_status status = gnp_equation_report(&info, found, &o->equation, report, error);
	if (status == GNP_OK)
		status = gnp_values_add_number(report, "time", o->dt * o->steps, error);
	if (status != GNP_OK)
		return status;
	return gnp_equation_report_end(gnp_domain_facts(gnp_poisson_domain(gnp_prepared_object(entry))), task, report,
	                               error);
}

/* Everything a request holds while it runs. */
struct work {
	struct gnp_common_cloud cloud;
	struct gnp_conditions conditions;
	double *u, *snapshots, *times;
	size_t sides, kept;
	struct gnp_prepared_entry *entry;
	bool found;
};

static void work_clear(struct work *work)
{
	free(work->u);
	free(work->snapshots);
	free(work->times);
	gnp_conditions_clear(&work->conditions);
	gnp_prepared_release(work->entry);
	gnp_common_cloud_clear(&work->cloud);
}

static gnp_status read_inputs(const struct gnp_call *call, const struct options *o, struct work *work,
                              struct gnp_error *error)
{
	size_t entries, found, numbers = snapshot_numbers(o, work->cloud.count, work->sides);
	gnp_status status = gnp_equation_columns(call, "initial", &work->u, &found, error);
	if (status == GNP_OK)
		status = gnp_conditions_read(call, work->cloud.count, work->sides, &work->conditions, error);
	if (status != GNP_OK)
		return status;
	if (!work->u && gnp_size_multiply(work->cloud.count, work->sides, &entries))
		work->u = gnp_array_zero(entries, sizeof *work->u);
	work->kept = gnp_heat_snapshots((size_t)o->steps, (size_t)o->snapshot_every);
	if (work->kept && numbers != SIZE_MAX) {
		work->snapshots = gnp_array_new(numbers, sizeof *work->snapshots);
		work->times = gnp_array_new(work->kept, sizeof *work->times);
	}
	if (work->u && (!work->kept || (work->snapshots && work->times)))
		return GNP_OK;
	return gnp_error_set(error, GNP_OUT_OF_MEMORY, "heat: no memory for %zu columns and %zu snapshots of %zu points",
	                     work->sides, work->kept, work->cloud.count);
}

static gnp_status solve(const struct options *o, struct work *work, struct gnp_pool *pool, struct gnp_task *task,
                        struct gnp_error *error)
{
	const struct gnp_heat_options heat = {o->dt, (size_t)o->steps, o->scheme, (size_t)o->snapshot_every};
	const struct gnp_poisson *poisson = gnp_prepared_object(work->entry);
	struct gnp_conditions *conditions = &work->conditions;
	gnp_status status = gnp_conditions_load(conditions, poisson, pool, task, error);
	const struct gnp_heat_field field = {work->sides, work->u, conditions->source, conditions->values, work->snapshots,
	                                     work->times};
	return status == GNP_OK ? gnp_heat_run(poisson, &heat, &field, pool, task, error) : status;
}

/* Hands the array over. */
static gnp_status add_array(enum output output, unsigned rank, const size_t *shape, double **data,
                            struct gnp_tensors *to, struct gnp_error *error)
{
	gnp_status status = gnp_tensors_add_data(to, outputs[output].name, GNP_FP64, rank, shape, *data, true, NULL, error);
	if (status == GNP_OK)
		*data = NULL;
	return status;
}

static gnp_status add_outputs(uint64_t wanted, struct work *work, struct gnp_tensors *to, struct gnp_error *error)
{
	const size_t shape[] = {work->kept, work->cloud.count, work->sides};
	gnp_status status = GNP_OK;
	if (wanted >> SOLUTION & 1)
		status = add_array(SOLUTION, 2, shape + 1, &work->u, to, error);
	if (status == GNP_OK && wanted >> SNAPSHOTS & 1)
		status = add_array(SNAPSHOTS, 3, shape, &work->snapshots, to, error);
	if (status == GNP_OK && wanted >> SNAPSHOT_TIME & 1)
		status = add_array(SNAPSHOT_TIME, 1, shape, &work->times, to, error);
	return status;
}

static gnp_status run(const struct gnp_call *call, struct gnp_pool *pool, struct gnp_task *task,
                      struct gnp_response *response, struct gnp_error *error)
{
	const struct options *given = gnp_call_options(call);
	struct options o = *given;
	struct work work = {.sides = gnp_conditions_sides(call, "initial")};
	gnp_status status = gnp_common_cloud_read(call->request, &work.cloud, error);
	if (status == GNP_OK)
		status = read_inputs(call, &o, &work, error);
	o.equation.core.screening = gnp_heat_screening(o.dt, o.scheme);
	o.equation.core.fixed = work.conditions.fixed;
	if (status == GNP_OK)
		status = gnp_equation_get(call, &gnp_equation_poisson, &o.equation, &work.cloud, pool, task, &work.entry,
		                          &work.found, error);
	if (status == GNP_OK)
		status = solve(&o, &work, pool, task, error);
	gnp_task_stage(task, GNP_STAGE_ENCODE, 0);
	if (status == GNP_OK)
		status = add_report(work.entry, work.found, &o, task, &response->parameters, error);
	if (status == GNP_OK)
		status = add_outputs(o.outputs, &work, &response->outputs, error);
	work_clear(&work);
	return status;
}

GNP_OPERATION(heat, "Heat on the surface of a cloud, u_t = Delta u + source, by implicit steps.",
              .resolve = gnp_equation_resolve);
