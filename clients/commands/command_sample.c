/* gnp sample: makes an analytic cloud with its exact geometry. */
#include <stdlib.h>
#include <string.h>

#include "clients/command.h"
#include "clients/file_io.h"
#include "clients/session.h"
#include "core/shapes/shapes.h"

static const struct gnp_option options[] = {
	{"output", 'o', "FILE", "where to write (default: standard output)"},
	{"format", 0, "NAME", "format of the output (default: by extension; ply on standard output)"},
	{"points", 'n', "N", "how many points (10000)"},
	{"seed", 0, "S", "of the sampling and the noise (1)"},
	{"shape-seed", 0, "S", "member of a random family (1)"},
	{"degree", 0, "L", "degree of the radial family, 0: chosen by its seed (0)"},
	{"noise", 0, "SIGMA", "standard deviation of Gaussian noise on every coordinate (0)"},
	{"outliers", 0, "FRACTION,SIGMA", "points that get this noise instead (none)"},
	{"no-normals", 0, NULL, "leave the normals out"},
	{"type", 0, "TYPE", "fp32 or fp64 (fp64)"},
};

struct plan {
	const char *output;
	const struct gnp_format *format;
	enum gnp_datatype datatype;
	uint64_t shape_seed, degree;
	struct gnp_sample_options sample;
	bool normals;
};

static gnp_status parse_numbers(const struct gnp_arguments *arguments, struct plan *plan, struct gnp_error *error)
{
	const double most = 1e100;
	double outliers[2] = {0, 0};
	uint64_t points = 10000;
	gnp_status status = gnp_arguments_integer(arguments, "points", 1, 100000000, &points, error);
	if (status == GNP_OK)
		status = gnp_arguments_integer(arguments, "seed", 0, UINT64_MAX, &plan->sample.seed, error);
	if (status == GNP_OK)
		status = gnp_arguments_integer(arguments, "shape-seed", 0, UINT64_MAX, &plan->shape_seed, error);
	if (status == GNP_OK)
		status = gnp_arguments_integer(arguments, "degree", 0, 22, &plan->degree, error);
	if (status == GNP_OK)
		status = gnp_arguments_number(arguments, "noise", 0, most, &plan->sample.noise, error);
	if (status == GNP_OK)
		status = gnp_arguments_pair(arguments, "outliers", 0, most, outliers, error);
	if (status == GNP_OK && outliers[0] > 1)
		status = gnp_error_set(error, GNP_INVALID_ARGUMENT, "--outliers: got a fraction of %g, need 0..1", outliers[0]);
	plan->sample.count = points;
	plan->sample.outlier_fraction = outliers[0];
	plan->sample.outlier_noise = outliers[1];
	return status;
}

static gnp_status parse_plan(const struct gnp_arguments *arguments, struct plan *plan, struct gnp_error *error)
{
	const char *type = gnp_arguments_get(arguments, "type", "fp64"), *output = gnp_arguments_get(arguments, "output", "-");
	*plan = (struct plan){.output = output, .shape_seed = 1, .sample = {.seed = 1}};
	plan->normals = !gnp_arguments_has(arguments, "no-normals");
	plan->datatype = strcmp(type, "fp32") == 0 ? GNP_FP32 : GNP_FP64;
	if (plan->datatype == GNP_FP64 && strcmp(type, "fp64") != 0)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "--type: got '%s', need fp32 or fp64", type);
	gnp_status status = parse_numbers(arguments, plan, error);
	if (status != GNP_OK)
		return status;
	return gnp_file_format_out(gnp_arguments_get(arguments, "format", NULL), output, &plan->format, error);
}

/* A view of doubles (count, width...), or their single-precision copy. */
static gnp_status add_field(struct gnp_tensors *tensors, const char *name, enum gnp_datatype datatype, unsigned rank,
                            const size_t *shape, double *values, struct gnp_error *error)
{
	struct gnp_tensor *tensor;
	size_t elements = 0;
	if (datatype == GNP_FP64)
		return gnp_tensors_add_data(tensors, name, GNP_FP64, rank, shape, values, false, NULL, error);
	gnp_status status = gnp_tensors_add(tensors, name, GNP_FP32, rank, shape, &tensor, error);
	if (status != GNP_OK)
		return status;
	gnp_tensor_elements(rank, shape, &elements);
	for (size_t i = 0; i < elements; i++)
		((float *)tensor->data)[i] = (float)values[i];
	return GNP_OK;
}

/* Mean curvature comes first of the scalars: it is what viewers colour by. */
static gnp_status add_fields(const struct gnp_sample *sample, const struct plan *plan, struct gnp_tensors *tensors,
                             struct gnp_error *error)
{
	const struct {
		const char *name;
		double *values;
		unsigned rank;
		size_t shape[2];
	} fields[] = {
		{"points", sample->points, 2, {3}},
		{"normals", plan->normals ? sample->normals : NULL, 2, {3}},
		{"mean_curvature", sample->mean_curvature, 1, {0}},
		{"gaussian_curvature", sample->gaussian_curvature, 1, {0}},
		{"principal_curvatures", sample->principal_curvatures, 2, {2}},
		{"second_form", sample->second_form, 3, {3, 3}},
		{"exact", sample->exact, 2, {3}},
	};
	gnp_status status = GNP_OK;
	for (size_t i = 0; i < sizeof fields / sizeof fields[0] && status == GNP_OK; i++) {
		size_t shape[3] = {sample->count, fields[i].shape[0], fields[i].shape[1]};
		if (fields[i].values)
			status = add_field(tensors, fields[i].name, plan->datatype, fields[i].rank, shape, fields[i].values, error);
	}
	if (status == GNP_OK)
		status = gnp_tensors_add_data(tensors, "outlier", GNP_UINT8, 1, &sample->count, sample->outlier, false, NULL, error);
	return status;
}

static gnp_status save(const struct gnp_sample *sample, const char *shape, const struct plan *plan, struct gnp_error *error)
{
	struct gnp_tensors tensors = {0};
	struct gnp_values comments = {0};
	gnp_status status = add_fields(sample, plan, &tensors, error);
	if (status == GNP_OK)
		status = gnp_values_add_string(&comments, "shape", shape, error);
	if (status == GNP_OK)
		status = gnp_values_add_integer(&comments, "seed", (int64_t)plan->sample.seed, error);
	if (status == GNP_OK)
		status = gnp_values_add_integer(&comments, "shape_seed", (int64_t)plan->shape_seed, error);
	if (status == GNP_OK)
		status = gnp_values_add_number(&comments, "noise", plan->sample.noise, error);
	if (status == GNP_OK)
		status = gnp_file_save(plan->output, plan->format, &tensors, &comments, error);
	gnp_values_clear(&comments);
	gnp_tensors_clear(&tensors);
	return status;
}

static gnp_status sample_shape(const char *name, const struct plan *plan, struct gnp_sample *sample, struct gnp_error *error)
{
	struct gnp_session session;
	struct gnp_shape *shape;
	gnp_status status = gnp_session_open(&session, 0, error);
	if (status != GNP_OK)
		return status;
	atomic_store(&session.progress.phase, "sample");
	status = gnp_shape_create(name, plan->shape_seed, (unsigned)plan->degree, &shape, error);
	if (status == GNP_OK) {
		status = gnp_sample_create(shape, &plan->sample, session.pool, &session.task, sample, error);
		gnp_shape_free(shape);
	}
	gnp_session_close(&session);
	return status;
}

static enum gnp_exit run(const struct gnp_command *command, const struct gnp_arguments *arguments, struct gnp_error *error)
{
	(void)command;
	const char *name = arguments->operands[0];
	struct plan plan;
	struct gnp_sample sample;
	if (parse_plan(arguments, &plan, error) != GNP_OK)
		return GNP_EXIT_USAGE;
	gnp_status status = sample_shape(name, &plan, &sample, error);
	if (status == GNP_NOT_FOUND)
		return GNP_EXIT_USAGE;
	if (status != GNP_OK)
		return gnp_exit_of(status, false);
	status = save(&sample, name, &plan, error);
	gnp_sample_clear(&sample);
	return gnp_exit_of(status, false);
}

const struct gnp_command gnp_command_sample = {
	.name = "sample",
	.operands = "SHAPE [--points N] [OPTIONS] -o FILE",
	.help = "write an analytic cloud with its exact geometry",
	.details = "SHAPE: sphere, ellipsoid, torus, bumpy_torus, toroidal, radial, genus2, genus3, plane, cylinder, saddle.\n"
	           "Fields: points, normals, mean_curvature, gaussian_curvature, principal_curvatures, second_form (II as a 3x3\n"
	           "tensor), exact (the point on the surface before noise), outlier. Outward normals; H = -1/R on a sphere.",
	.options = options,
	.option_count = sizeof options / sizeof options[0],
	.operands_least = 1,
	.operands_most = 1,
	.run = run,
};
