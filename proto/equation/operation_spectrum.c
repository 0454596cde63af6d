/* The operation `spectrum`: its descriptor, and the way from tensors to gnp_spectrum_run and back. */
#include <math.h>
#include <stdlib.h>

#include "core/equations/spectrum.h"
#include "proto/equation/operation_equation.h"

struct options {
	struct gnp_equation_options equation;
	double accuracy, shift;
	int count;
	uint64_t outputs;
};

static const struct gnp_tensor_info inputs[] = {
	GNP_COMMON_INPUTS,
	{"fixed", GNP_BOOL, 1, {-1}, true, "1 where u = 0 (Dirichlet points); absent: open edges are natural"},
};

enum output { EIGENVALUES, IMAGINARY, RESIDUAL, EIGENVECTORS, OUTPUTS };
static const struct gnp_tensor_info outputs[OUTPUTS] = {
	[EIGENVALUES] = {"eigenvalues", GNP_FP64, 1, {-2}, false,
	                 "of -Delta, ascending [1/length^2]: where nothing is fixed 0 once for each component first"},
	[IMAGINARY] = {"imaginary", GNP_FP64, 1, {-2}, true,
	               "what collocation leaves beside each: a measure of its error; 0 of the symmetric system"},
	[RESIDUAL] = {"residual", GNP_FP64, 1, {-2}, true, "relative residual of each pair"},
	[EIGENVECTORS] = {"eigenvectors", GNP_FP64, 2, {-1, -2}, false,
	                  "a column each, of unit length when points weigh by their area; of the symmetric system "
	                  "orthonormal"},
};

static const struct gnp_parameter parameters[] = {
	{"count", GNP_PARAMETER_INTEGER, offsetof(struct options, count), 1, 500, NULL,
	 "how many of the lowest, or of those nearest to shift"},
	{"shift", GNP_PARAMETER_NUMBER, offsetof(struct options, shift), 0, 1e100, NULL,
	 "the eigenvalues nearest to it, ascending [1/length^2]; 0: the lowest"},
	{"accuracy", GNP_PARAMETER_NUMBER, offsetof(struct options, accuracy), 1e-12, 0.1, NULL, "of the residuals"},
	GNP_EQUATION_SYSTEM(struct options),
	GNP_EQUATION_SOLVER(struct options),
	GNP_EQUATION_DISCRETISATION(struct options),
	GNP_COMMON_OUTPUTS(struct options),
};

static void defaults(void *options)
{
	struct options *o = options;
	gnp_equation_defaults(&o->equation);
	o->count = 10;
	o->accuracy = 1e-8;
	o->outputs = (UINT64_C(1) << OUTPUTS) - 1;
}

static gnp_status check(struct gnp_call *call, struct gnp_error *error)
{
	const struct options *o = gnp_call_options(call);
	gnp_status status = gnp_spectrum_check((size_t)o->count, call->points, o->equation.core.laplacian.system, error);
	return status == GNP_OK ? gnp_equation_check(call, error) : status;
}

static size_t rows(const struct gnp_call *call, int64_t extent)
{
	const struct options *o = gnp_call_options(call);
	return extent == -2 ? (size_t)o->count : GNP_ROWS_OPEN;
}

/* Of the symmetric system: normals, or the factor and the iteration, whose basis is no more when the answer is made. */
static size_t symmetric_memory(const struct gnp_call *call, const struct options *o)
{
	const struct gnp_laplacian_options *l = &o->equation.core.laplacian;
	double doubling = o->shift > 0 ? 100 : 70; /* a little above what test_memory_estimates.c measures */
	size_t normals = gnp_estimate_memory(call->points, gnp_common_given(call), &l->domain.estimate);
	size_t solve = gnp_common_memory(call->points, (size_t)(300 + doubling * log2((double)call->points + 2)),
	                                 gnp_spectrum_memory(call->points, (size_t)o->count, l->system));
	return gnp_common_memory(1, gnp_common_cloud_memory(call), normals > solve ? normals : solve);
}

/* The iteration, beside an operator that is made; eigenvectors once more in the answer. */
static size_t memory(const struct gnp_call *call)
{
	const struct options *o = gnp_call_options(call);
	if (o->equation.core.laplacian.system == GNP_SYSTEM_SYMMETRIC)
		return symmetric_memory(call, o);
	size_t answer = gnp_common_memory(call->points, (size_t)o->count * sizeof(double), gnp_equation_memory(call, &o->equation, 1));
	return gnp_common_memory(1, gnp_spectrum_memory(call->points, (size_t)o->count, o->equation.core.laplacian.system),
	                         answer);
}

static gnp_status add_vectors(const struct gnp_spectrum *spectrum, struct gnp_tensors *to, struct gnp_error *error)
{
	struct gnp_tensor *tensor;
	size_t shape[] = {spectrum->points, spectrum->count};
	gnp_status status = gnp_tensors_add(to, outputs[EIGENVECTORS].name, GNP_FP64, 2, shape, &tensor, error);
	for (size_t i = 0; status == GNP_OK && i < spectrum->points; i++)
		for (size_t e = 0; e < spectrum->count; e++)
			((double *)tensor->data)[i * spectrum->count + e] = spectrum->vector[e * spectrum->points + i];
	return status;
}

static gnp_status add_outputs(uint64_t wanted, const struct gnp_spectrum *spectrum, struct gnp_tensors *to,
                              struct gnp_error *error)
{
	const double *columns[] = {spectrum->value, spectrum->imaginary, spectrum->residual};
	gnp_status status = GNP_OK;
	for (int output = EIGENVALUES; output < EIGENVECTORS && status == GNP_OK; output++)
		if (wanted >> output & 1)
			status = gnp_common_add_copy(to, &outputs[output], spectrum->count, columns[output], error);
	return status == GNP_OK && (wanted >> EIGENVECTORS & 1) ? add_vectors(spectrum, to, error) : status;
}

static gnp_status add_report(const struct gnp_spectrum *spectrum, const struct options *o, const struct gnp_task *task,
                             struct gnp_values *report, struct gnp_error *error)
{
	const struct gnp_estimate_options *estimate = &o->equation.core.laplacian.domain.estimate;
	const struct gnp_common_facts facts = gnp_equation_facts(spectrum->surface);
	gnp_status status = gnp_common_report(&facts, estimate, report, error);
	if (status == GNP_OK)
		status = gnp_values_add_integer(report, "solves", (int64_t)spectrum->solves, error);
	if (status == GNP_OK)
		status = gnp_values_add_string(report, "system", gnp_equation_systems[spectrum->system], error);
	if (status == GNP_OK && spectrum->why)
		status = gnp_values_add_string(report, "system_because", spectrum->why, error);
	return status == GNP_OK ? gnp_equation_report_end(spectrum->surface, task, report, error) : status;
}

static gnp_status run(const struct gnp_call *call, struct gnp_pool *pool, struct gnp_task *task,
                      struct gnp_response *response, struct gnp_error *error)
{
	const struct options *given = gnp_call_options(call);
	struct options o = *given;
	struct gnp_common_cloud input = {0};
	struct gnp_filter_options filter;
	struct gnp_spectrum spectrum = {0};
	unsigned char *fixed = NULL;
	gnp_status status = gnp_common_cloud_read(call->request, &input, error);
	if (status == GNP_OK)
		status = gnp_common_mask_read(call->request, "fixed", &fixed, error);
	const struct gnp_cloud cloud = {input.count, input.points, input.normals};
	const struct gnp_spectrum_wanted wanted = {(size_t)o.count, o.shift, o.accuracy};
	gnp_equation_set_filter(&o.equation, &filter);
	o.equation.core.fixed = fixed;
	if (status == GNP_OK)
		status = gnp_spectrum_run(&cloud, &o.equation.core, &wanted, pool, task, &spectrum, error);
	gnp_task_stage(task, GNP_STAGE_ENCODE, 0);
	if (status == GNP_OK)
		status = add_report(&spectrum, &o, task, &response->parameters, error);
	if (status == GNP_OK)
		status = add_outputs(o.outputs, &spectrum, &response->outputs, error);
	gnp_spectrum_clear(&spectrum);
	gnp_common_cloud_clear(&input);
	free(fixed);
	return status;
}

GNP_OPERATION(spectrum,
              "Eigenvalues and eigenvectors of -Delta on the surface of a cloud: the lowest, or those about a value.",
              .resolve = gnp_equation_resolve, .rows = rows);
