/* The operation `heat`: its descriptor, and the way from tensors to gnp_heat_step and back. */
#include <math.h>
#include <stdlib.h>

#include "core/equations/heat.h"
#include "proto/operation/operation_equation.h"

struct options {
	struct gnp_equation_options equation;
	double dt;
	int steps;
};

static const struct gnp_tensor_info inputs[] = {
	GNP_COMMON_INPUTS,
	{"initial", GNP_FP64, 2, {-1, -2}, false, "u at the start, a column each"},
	{"source", GNP_FP64, 2, {-1, -2}, true, "heat added in unit time, a column each"},
};

static const struct gnp_tensor_info outputs[] = {
	{"solution", GNP_FP64, 2, {-1, -2}, false, "u after the steps, a column each"},
};

static const struct gnp_parameter parameters[] = {
	{"dt", GNP_PARAMETER_NUMBER, offsetof(struct options, dt), GNP_ABOVE_ZERO, 1e200, NULL,
	 "the step [length^2]; any is stable"},
	{"steps", GNP_PARAMETER_INTEGER, offsetof(struct options, steps), 1, 1e6, NULL,
	 "how many to take; all use one factor"},
	GNP_EQUATION_SYSTEM(struct options),
	GNP_EQUATION_SOLVER(struct options),
	GNP_EQUATION_DISCRETISATION(struct options),
};

static void defaults(void *options)
{
	struct options *o = options;
	gnp_equation_defaults(&o->equation);
	o->equation.core.laplacian.system = GNP_SYSTEM_SYMMETRIC;
	o->dt = 1e-3;
	o->steps = 1;
}

static gnp_status check(struct gnp_call *call, struct gnp_error *error)
{
	gnp_status status = gnp_equation_check(call, error);
	if (status == GNP_OK)
		status = gnp_equation_check_columns(call, "initial", NULL, error);
	return status == GNP_OK ? gnp_equation_check_columns(call, "source", "initial", error) : status;
}

static size_t memory(const struct gnp_call *call)
{
	return gnp_equation_memory(call, gnp_call_options(call),
	                           gnp_equation_sides(call, "initial"));
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

static gnp_status run(const struct gnp_call *call, struct gnp_pool *pool, struct gnp_task *task,
                      struct gnp_response *response, struct gnp_error *error)
{
	const struct options *given = gnp_call_options(call);
	struct options o = *given;
	struct gnp_common_cloud cloud = {0};
	struct gnp_prepared_entry *entry = NULL;
	double *u = NULL, *source = NULL;
	size_t sides = 0;
	bool found = false;
	gnp_status status = gnp_common_cloud_read(call->request, &cloud, error);
	if (status == GNP_OK)
		status = gnp_equation_columns(call, "initial", &u, &sides, error);
	if (status == GNP_OK)
		status = gnp_equation_columns(call, "source", &source, &sides, error);
	o.equation.core.screening = 1 / o.dt; /* as gnp_heat_prepare has it */
	if (status == GNP_OK)
		status = gnp_equation_get(call, &gnp_equation_poisson, &o.equation, &cloud, pool, task, &entry, &found, error);
	if (status == GNP_OK)
		status = gnp_heat_step(gnp_prepared_object(entry), o.dt, (size_t)o.steps, source, NULL, sides, pool, task, u,
		                       error);
	gnp_task_stage(task, GNP_STAGE_ENCODE, 0);
	if (status == GNP_OK)
		status = add_report(entry, found, &o, task, &response->parameters, error);
	if (status == GNP_OK)
		status = gnp_tensors_add_data(&response->outputs, outputs[0].name, GNP_FP64, 2, (size_t[]){cloud.count, sides},
		                              u, true, NULL, error);
	if (status != GNP_OK)
		free(u);
	free(source);
	gnp_prepared_release(entry);
	gnp_common_cloud_clear(&cloud);
	return status;
}

GNP_OPERATION(heat, "Heat on the surface of a cloud, u_t = Delta u + source, by implicit steps.",
              .resolve = gnp_equation_resolve);
