/* gnp compare: prints how far a result is from the exact geometry. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "clients/command.h"
#include "clients/fields.h"
#include "clients/file_io.h"
#include "core/base/vector.h"

static const struct gnp_option options[] = {
	{"json", 0, NULL, "one JSON object instead of a table"},
};

struct clouds {
	const struct gnp_tensors *result, *truth;
	size_t count;
	unsigned char *skip; /* (count) 1 for what the truth marks as an outlier */
};

struct measure {
	const char *name, *meaning;
	double value;
};
enum { MEASURES_MAX = 16 };
struct report {
	size_t count;
	struct measure measures[MEASURES_MAX];
};

static void add(struct report *report, const char *name, const char *meaning, double value)
{
	report->measures[report->count++] = (struct measure){name, meaning, value};
}

/* Mean of 1 - n.n', mean and largest angle, and the share on the right side. */
static void compare_directions(const struct clouds *clouds, const double *n, const double *m, struct report *report)
{
	double sum = 0, angles = 0, largest = 0, right = 0, used = 0;
	for (size_t i = 0; i < clouds->count; i++) {
		if (clouds->skip[i])
			continue;
		const double *a = n + 3 * i, *b = m + 3 * i;
		double cosine = gnp_dot(a, b) / sqrt(gnp_dot(a, a) * gnp_dot(b, b));
		double angle = acos(fmax(-1, fmin(1, cosine))) * 180 / M_PI;
		sum += 1 - cosine;
		angles += angle;
		largest = fmax(largest, angle);
		right += cosine > 0;
		used++;
	}
	add(report, "normals", "mean of 1 - n.n'", sum / used);
	add(report, "normals_angle_mean", "degrees", angles / used);
	add(report, "normals_angle_max", "degrees", largest);
	add(report, "normals_outward", "share on the right side", right / used);
}

static gnp_status compare_normals(const struct clouds *clouds, struct report *report, struct gnp_error *error)
{
	double *n = NULL, *m = NULL;
	gnp_status status = gnp_field_load(clouds->result, "normals", clouds->count, 3, &n, error);
	if (status == GNP_OK)
		status = gnp_field_load(clouds->truth, "normals", clouds->count, 3, &m, error);
	if (status == GNP_OK)
		compare_directions(clouds, n, m, report);
	free(n);
	free(m);
	return status;
}

/* Relative L2 error of a field of width numbers a point: |a - b| / |b|. */
static gnp_status compare_values(const struct clouds *clouds, const char *name, size_t width, struct report *report,
                                 struct gnp_error *error)
{
	double *a = NULL, *b = NULL, difference = 0, norm = 0;
	gnp_status status = gnp_field_load(clouds->result, name, clouds->count, width, &a, error);
	if (status == GNP_OK)
		status = gnp_field_load(clouds->truth, name, clouds->count, width, &b, error);
	for (size_t i = 0; status == GNP_OK && i < clouds->count * width; i++) {
		if (clouds->skip[i / width])
			continue;
		difference += (a[i] - b[i]) * (a[i] - b[i]);
		norm += b[i] * b[i];
	}
	free(a);
	free(b);
	if (status == GNP_OK && norm > 0)
		add(report, name, "relative L2 error", sqrt(difference / norm));
	else if (status == GNP_OK)
		add(report, name, "L2 error over points (exact: zero everywhere)", sqrt(difference / (double)clouds->count));
	return status;
}

/* Distance of the result's points from the surface's, root mean square. */
static gnp_status compare_points(const struct clouds *clouds, struct report *report, struct gnp_error *error)
{
	double *a = NULL, *b = NULL, sum = 0, used = 0;
	gnp_status status = gnp_field_load(clouds->result, "points", clouds->count, 3, &a, error);
	if (status == GNP_OK)
		status = gnp_field_load(clouds->truth, "exact", clouds->count, 3, &b, error);
	for (size_t i = 0; status == GNP_OK && i < clouds->count; i++) {
		if (clouds->skip[i])
			continue;
		double d[3] = {a[3 * i] - b[3 * i], a[3 * i + 1] - b[3 * i + 1], a[3 * i + 2] - b[3 * i + 2]};
		sum += gnp_dot(d, d);
		used++;
	}
	free(a);
	free(b);
	if (status == GNP_OK)
		add(report, "points", "distance from the exact points, root mean square", sqrt(sum / used));
	return status;
}

static bool in_both(const struct clouds *clouds, const char *name)
{
	return gnp_field_find(clouds->result, name) && gnp_field_find(clouds->truth, name);
}

static gnp_status compare_all(const struct clouds *clouds, struct report *report, struct gnp_error *error)
{
	static const struct {
		const char *name;
		size_t width;
	} values[] = {{"mean_curvature", 1}, {"gaussian_curvature", 1}, {"principal_curvatures", 2}};
	gnp_status status = GNP_OK;
	if (in_both(clouds, "normals"))
		status = compare_normals(clouds, report, error);
	for (size_t i = 0; i < sizeof values / sizeof values[0] && status == GNP_OK; i++)
		if (in_both(clouds, values[i].name))
			status = compare_values(clouds, values[i].name, values[i].width, report, error);
	if (status == GNP_OK && gnp_field_find(clouds->truth, "exact"))
		status = compare_points(clouds, report, error);
	if (status == GNP_OK && !report->count)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "nothing to compare: no field is in both files");
	return status;
}

static size_t count_points(const struct gnp_tensors *tensors)
{
	const struct gnp_tensor *points = gnp_tensors_find(tensors, "points");
	return points && points->rank == 2 && points->shape[1] == 3 ? points->shape[0] : 0;
}

static gnp_status set_skip(struct clouds *clouds, struct gnp_error *error)
{
	double *flags = NULL;
	size_t used = clouds->count;
	clouds->skip = calloc(clouds->count, 1);
	if (!clouds->skip)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "compare: no memory for %zu points", clouds->count);
	if (!gnp_field_find(clouds->truth, "outlier"))
		return GNP_OK;
	gnp_status status = gnp_field_load(clouds->truth, "outlier", clouds->count, 1, &flags, error);
	for (size_t i = 0; status == GNP_OK && i < clouds->count; i++) {
		clouds->skip[i] = flags[i] != 0;
		used -= clouds->skip[i];
	}
	free(flags);
	if (status == GNP_OK && !used)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "outlier: set for all %zu points", clouds->count);
	return status;
}

static void print_report(const struct report *report, size_t count)
{
	printf("%-22s %12s  %s (%zu points)\n", "quantity", "error", "measure", count);
	for (size_t i = 0; i < report->count; i++)
		printf("%-22s %12.3e  %s\n", report->measures[i].name, report->measures[i].value, report->measures[i].meaning);
}

/* Names are ours and need no escapes; a number that is not finite has no JSON form. */
static void print_json(const struct report *report, size_t count)
{
	printf("{\"count\": %zu", count);
	for (size_t i = 0; i < report->count; i++) {
		printf(", \"%s\": ", report->measures[i].name);
		printf(isfinite(report->measures[i].value) ? "%.9g" : "null", report->measures[i].value);
	}
	puts("}");
}

static gnp_status compare(const struct gnp_arguments *arguments, const struct gnp_tensors *result,
                          const struct gnp_tensors *truth, struct gnp_error *error)
{
	struct clouds clouds = {.result = result, .truth = truth, .count = count_points(result)};
	struct report report = {0};
	if (!clouds.count || clouds.count != count_points(truth))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "points: got %zu in %s and %zu in %s, need the same number",
		                     clouds.count, arguments->operands[0], count_points(truth), arguments->operands[1]);
	gnp_status status = set_skip(&clouds, error);
	if (status == GNP_OK)
		status = compare_all(&clouds, &report, error);
	free(clouds.skip);
	if (status == GNP_OK)
		(gnp_arguments_has(arguments, "json") ? print_json : print_report)(&report, clouds.count);
	return status;
}

static enum gnp_exit run(const struct gnp_command *command, const struct gnp_arguments *arguments, struct gnp_error *error)
{
	(void)command;
	struct gnp_buffer contents[2] = {{0}};
	struct gnp_tensors files[2] = {{0}};
	gnp_status status = GNP_OK;
	for (int i = 0; i < 2 && status == GNP_OK; i++)
		status = gnp_file_load(arguments->operands[i], NULL, &contents[i], &files[i], error);
	if (status == GNP_OK)
		status = compare(arguments, &files[0], &files[1], error);
	for (int i = 0; i < 2; i++) {
		gnp_tensors_clear(&files[i]);
		gnp_buffer_clear(&contents[i]);
	}
	return gnp_exit_of(status, false);
}

const struct gnp_command gnp_command_compare = {
	.name = "compare",
	.operands = "RESULT TRUTH [--json]",
	.help = "errors of a result against exact geometry",
	.details = "TRUTH is what 'gnp sample' wrote, RESULT what an operation made of its points, row by row. Rows the truth\n"
	           "marks as outliers are left out.",
	.options = options,
	.option_count = sizeof options / sizeof options[0],
	.operands_least = 2,
	.operands_most = 2,
	.run = run,
};
