/* The operation `laplacian`: its descriptor, and the way from tensors to gnp_laplacian_run and back. */
#include <stdlib.h>

#include "proto/equation/operation_equation.h"

struct options {
	struct gnp_equation_options equation;
	uint64_t outputs;
};

static const struct gnp_tensor_info inputs[] = {GNP_COMMON_INPUTS};

enum output { ROW_OFFSETS, COLUMNS, VALUES, KEPT, VALUE, GRADIENT_X, GRADIENT_Y, GRADIENT_Z, DIVERGENCE_X, DIVERGENCE_Y,
             DIVERGENCE_Z, STIFFNESS, MASS, OUTPUTS };
static const uint64_t by_default = (UINT64_C(1) << VALUE) - 1;
static const uint64_t weak_alone = UINT64_C(1) << STIFFNESS | UINT64_C(1) << MASS; /* of system=symmetric */
#define DERIVATIVE(name, help) {name, GNP_FP64, 1, {-4}, false, help}
static const struct gnp_tensor_info outputs[OUTPUTS] = {
	[ROW_OFFSETS] = {"row_offsets", GNP_INT64, 1, {-3}, false,
	                 "row i of every matrix below, that of point i, has entries row_offsets[i] to "
	                                              "row_offsets[i + 1] - 1: none where the filter dropped the point"},
	[COLUMNS] = {"columns", GNP_INT64, 1, {-4}, false, "the column of each entry, ascending within a row"},
	[VALUES] = DERIVATIVE("values", "Delta of the functions whose values stand at the kept points [1/length^2]"),
	[KEPT] = {"kept", GNP_INT64, 1, {-2}, false, "the point of each column"},
	[VALUE] = DERIVATIVE("value", "the fitted function itself"),
	[GRADIENT_X] = DERIVATIVE("gradient_x", "x of its gradient along the surface [1/length]"),
	[GRADIENT_Y] = DERIVATIVE("gradient_y", "y of it"),
	[GRADIENT_Z] = DERIVATIVE("gradient_z", "z of it"),
	[DIVERGENCE_X] = DERIVATIVE("divergence_x",
	                            "what a field's x adds to the divergence of its tangential part [1/length]"),
	[DIVERGENCE_Y] = DERIVATIVE("divergence_y", "its y"),
	[DIVERGENCE_Z] = DERIVATIVE("divergence_z", "its z"),
	[STIFFNESS] = DERIVATIVE("stiffness",
	                         "S of the symmetric system, whose Laplacian is -M^-1 S: symmetric, positive semidefinite; "
	                         "in npz files what scipy.sparse.load_npz reads, in mtx files the matrix"),
	[MASS] = {"mass", GNP_FP64, 1, {-2}, false,
	          "M of the symmetric system: the area that each kept point stands for [length^2]"},
};
#undef DERIVATIVE

/* The core's derivative behind an output; GNP_DERIVATIVE_COUNT for those that are the sparsity. */
static enum gnp_derivative derivative_of(int output)
{
	if (output == VALUES)
		return GNP_DERIVATIVE_LAPLACIAN;
	if (output == VALUE)
		return GNP_DERIVATIVE_VALUE;
	if (output == STIFFNESS)
		return GNP_DERIVATIVE_STIFFNESS;
	if (output < GRADIENT_X || output == MASS)
		return GNP_DERIVATIVE_COUNT;
	return (enum gnp_derivative)(GNP_DERIVATIVE_GRADIENT_X + (output - GRADIENT_X));
}

static const struct gnp_parameter parameters[] = {
	GNP_EQUATION_SYSTEM(struct options),
	GNP_EQUATION_DISCRETISATION(struct options),
	GNP_COMMON_OUTPUTS(struct options),
};

static void defaults(void *options)
{
	struct options *o = options;
	gnp_equation_defaults(&o->equation);
	o->equation.core.laplacian.system = GNP_SYSTEM_SQUARE;
	o->outputs = by_default;
}

static unsigned derivatives(uint64_t wanted)
{
	unsigned mask = 0;
	for (int output = 0; output < OUTPUTS; output++)
		if (wanted >> output & 1 && derivative_of(output) != GNP_DERIVATIVE_COUNT)
			mask |= GNP_DERIVATIVE_BIT(derivative_of(output));
	return mask;
}

/* Outputs that nobody named are those that the system has. */
static gnp_status check(struct gnp_call *call, struct gnp_error *error)
{
	struct options *o = (void *)call->options;
	int system = o->equation.core.laplacian.system;
	bool symmetric = system == GNP_SYSTEM_SYMMETRIC;
	if (!gnp_call_names_outputs(call))
		o->outputs = symmetric ? by_default | weak_alone : o->outputs & ~weak_alone;
	gnp_status status = gnp_equation_check(call, error);
	if (status == GNP_OK)
		status = gnp_laplacian_check_which(system, derivatives(o->outputs), error);
	if (status == GNP_OK && !symmetric && o->outputs >> MASS & 1)
		status = gnp_error_set(error, GNP_INVALID_ARGUMENT, "outputs: got mass, which system=symmetric alone has");
	return status;
}

/* A row of the matrix for each point; a column for each that is left by filters, least squares and copies. */
static size_t rows(const struct gnp_call *call, int64_t extent)
{
	if (extent == -4)
		return GNP_ROWS_OTHER; /* a stencil a row */
	return extent == -3 ? call->points + 1 : GNP_ROWS_OPEN;
}

/* What is made: a matrix at least, for its sparsity. */
static unsigned made_of(const struct options *o)
{
	unsigned mask = derivatives(o->outputs);
	bool symmetric = o->equation.core.laplacian.system == GNP_SYSTEM_SYMMETRIC;
	return mask ? mask : GNP_DERIVATIVE_BIT(symmetric ? GNP_DERIVATIVE_STIFFNESS : GNP_DERIVATIVE_VALUE);
}

/* On top of the domain's: entries with their columns and a number for each matrix, twice while rows are put in the cloud's order. */
static size_t memory(const struct gnp_call *call)
{
	const struct options *o = gnp_call_options(call);
	const struct gnp_laplacian_options *core = &o->equation.core.laplacian;
	size_t entry = sizeof(uint32_t) + sizeof(double) * (size_t)__builtin_popcount(made_of(o));
	enum { EDGES = 9, STARS = 130 };
	bool weak = core->system == GNP_SYSTEM_SYMMETRIC;
	size_t row = (weak ? EDGES : gnp_laplacian_neighbors(core)) * entry + sizeof(size_t);
	size_t estimate = gnp_estimate_memory(call->points, gnp_common_given(call), &core->domain.estimate);
	size_t matrices = gnp_common_memory(call->points, 2 * row + STARS, 0);
	if (weak) /* no neighbourhoods are left when it is made */
		return gnp_common_memory(1, gnp_common_cloud_memory(call), estimate > matrices ? estimate : matrices);
	return gnp_common_memory(call->points, 2 * row + sizeof(double), gnp_common_memory(1, gnp_common_cloud_memory(call), estimate));
}

static gnp_status add_indices(const struct gnp_tensor_info *info, size_t count, const uint32_t *narrow,
                              const size_t *wide, struct gnp_tensors *to, struct gnp_error *error)
{
	struct gnp_tensor *tensor;
	gnp_status status = gnp_tensors_add(to, info->name, GNP_INT64, 1, &count, &tensor, error);
	for (size_t i = 0; status == GNP_OK && i < count; i++)
		((int64_t *)tensor->data)[i] = narrow ? (int64_t)narrow[i] : (int64_t)wide[i];
	return status;
}

static gnp_status add_matrix(const struct gnp_tensor_info *info, size_t count, double **values, struct gnp_tensors *to,
                             struct gnp_error *error)
{
	gnp_status status = gnp_tensors_add_data(to, info->name, GNP_FP64, 1, &count, *values, true, NULL, error);
	if (status == GNP_OK)
		*values = NULL;
	return status;
}

static gnp_status add_output(int output, struct gnp_collocation *c, struct gnp_tensors *to, struct gnp_error *error)
{
	size_t entries = c->row_offsets[c->rows];
	switch (output) {
	case ROW_OFFSETS: return add_indices(&outputs[output], c->rows + 1, NULL, c->row_offsets, to, error);
	case COLUMNS: return add_indices(&outputs[output], entries, c->column, NULL, to, error);
	case KEPT: return add_indices(&outputs[output], c->columns, c->kept, NULL, to, error);
	case MASS: return add_matrix(&outputs[output], c->columns, &c->mass, to, error);
	default: return add_matrix(&outputs[output], entries, &c->value[derivative_of(output)], to, error);
	}
}

static gnp_status add_outputs(uint64_t wanted, struct gnp_collocation *c, struct gnp_tensors *to,
                              struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	for (int output = 0; output < OUTPUTS && status == GNP_OK; output++)
		if (wanted >> output & 1)
			status = add_output(output, c, to, error);
	return status;
}

static gnp_status add_report(const struct gnp_collocation *c, struct gnp_domain_facts surface, const struct options *o,
                             const struct gnp_task *task, struct gnp_values *report, struct gnp_error *error)
{
	const struct gnp_estimate_options *estimate = &o->equation.core.laplacian.domain.estimate;
	const struct gnp_common_facts facts = gnp_equation_facts(surface);
	gnp_status status = gnp_common_report(&facts, estimate, report, error);
	if (status == GNP_OK)
		status = gnp_values_add_integer(report, "rows", (int64_t)c->rows, error);
	if (status == GNP_OK)
		status = gnp_values_add_integer(report, "unknowns", (int64_t)c->columns, error);
	if (status == GNP_OK)
		status = gnp_values_add_integer(report, "reduced_stencils", (int64_t)c->reduced, error);
	return status == GNP_OK ? gnp_equation_report_end(surface, task, report, error) : status;
}

static gnp_status run(const struct gnp_call *call, struct gnp_pool *pool, struct gnp_task *task, struct gnp_response *response,
                      struct gnp_error *error)
{
	const struct options *given = gnp_call_options(call);
	struct options o = *given;
	struct gnp_common_cloud input = {0};
	struct gnp_filter_options filter;
	struct gnp_collocation made = {0};
	struct gnp_domain_facts surface;
	gnp_status status = gnp_common_cloud_read(call->request, &input, error);
	const struct gnp_cloud cloud = {input.count, input.points, input.normals};
	gnp_equation_set_filter(&o.equation, &filter);
	o.equation.core.laplacian.which = made_of(&o);
	if (status == GNP_OK)
		status = gnp_laplacian_run(&cloud, &o.equation.core.laplacian, pool, task, &made, &surface, error);
	gnp_task_stage(task, GNP_STAGE_ENCODE, 0);
	if (status == GNP_OK)
		status = add_report(&made, surface, &o, task, &response->parameters, error);
	if (status == GNP_OK)
		status = add_outputs(o.outputs, &made, &response->outputs, error);
	gnp_collocation_clear(&made);
	gnp_common_cloud_clear(&input);
	return status;
}

GNP_OPERATION(laplacian,
              "The Laplace-Beltrami operator of a cloud, its gradient and divergence as sparse matrices by rows.",
              .resolve = gnp_equation_resolve, .rows = rows);
