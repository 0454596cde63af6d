/* gnp plot: draws a picture of a cloud, coloured by a field. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "clients/command.h"
#include "clients/fields.h"
#include "clients/file_io.h"
#include "clients/plot/colormap.h"
#include "clients/plot/render.h"
#include "clients/session.h"
#include "core/base/memory.h"
#include "core/base/vector.h"
#include "core/search/neighbors.h"

static const struct gnp_option options[] = {
	{"output", 'o', "FILE", "the PNG to write (default: standard output)"},
	{"input-format", 0, "NAME", "format of the input (default: by extension, else by its first bytes)"},
	{"field", 0, "NAME", "colour by this field, or none (default: mean_curvature where there is one)"},
	{"limits", 0, "LOW,HIGH", "ends of the colour bar (default: 2% and 98% of the values, symmetric for signed ones)"},
	{"view", 0, "AZ,EL", "where the viewer is, in degrees (-60,28)"},
	{"up", 0, "AXIS", "x, y or z (z)"},
	{"size", 0, "WxH", "pixels (1200x900)"},
};

/* Everything the scene borrows. */
struct plot {
	double *points, *normals, *values, *radii;
	struct gnp_scene scene;
};

static gnp_status parse_view(const struct gnp_arguments *arguments, struct gnp_scene *scene, double limits[2],
                             struct gnp_error *error)
{
	double view[2] = {-60, 28}, size[2] = {1200, 900};
	const char *up = gnp_arguments_get(arguments, "up", "z");
	gnp_status status = gnp_arguments_pair(arguments, "view", -1e6, 1e6, view, error);
	if (status == GNP_OK)
		status = gnp_arguments_pair(arguments, "size", 64, 8192, size, error);
	if (status == GNP_OK)
		status = gnp_arguments_pair(arguments, "limits", -1e300, 1e300, limits, error);
	if (status == GNP_OK && limits[0] > limits[1])
		status = gnp_error_set(error, GNP_INVALID_ARGUMENT, "--limits: got %g above %g, need the low one first", limits[0], limits[1]);
	if (status == GNP_OK && (strlen(up) != 1 || !strchr("xyz", up[0])))
		status = gnp_error_set(error, GNP_INVALID_ARGUMENT, "--up: got '%s', need x, y or z", up);
	scene->azimuth = view[0];
	scene->elevation = view[1];
	scene->width = (size_t)size[0];
	scene->height = (size_t)size[1];
	scene->up = up[0] - 'x';
	return status;
}

/* The field asked for; without a choice mean_curvature, if it is there. */
static gnp_status load_values(const struct gnp_arguments *arguments, const struct gnp_tensors *tensors, size_t count,
                              struct plot *plot, struct gnp_error *error)
{
	const char *name = gnp_arguments_get(arguments, "field", NULL);
	if (!name && gnp_field_find(tensors, "mean_curvature"))
		name = "mean_curvature";
	if (!name || strcmp(name, "none") == 0)
		return GNP_OK;
	plot->scene.title = name;
	return gnp_field_load(tensors, name, count, 1, &plot->values, error);
}

struct radius_search {
	const struct gnp_neighbors *neighbors;
	const double *points;
	size_t k;
	double *radii;
};

/* A disc reaches a little beyond the nearest ring of neighbours. */
static gnp_status search_radii(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	const struct radius_search *search = context;
	size_t k = search->k, queries = end - begin;
	uint32_t *index = gnp_scratch_take(scratch, queries * k, sizeof *index);
	double *distance = gnp_scratch_take(scratch, queries * k, sizeof *distance);
	if (!index || !distance)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "plot: no memory for %zu neighbours", queries * k);
	gnp_status status = gnp_neighbors_knn(search->neighbors, search->points + 3 * begin, queries, k, index, distance, scratch, error);
	for (size_t i = 0; status == GNP_OK && i < queries; i++)
		search->radii[begin + i] = 1.1 * distance[i * k + k - 1];
	return status;
}

/* Lone points would be drawn as large discs, so no disc is more than three times the median one. */
static gnp_status limit_radii(double *radii, size_t count, struct gnp_error *error)
{
	double *sorted = gnp_array_new(count, sizeof *sorted);
	if (!sorted)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "plot: no memory for %zu points", count);
	memcpy(sorted, radii, count * sizeof *sorted);
	qsort(sorted, count, sizeof *sorted, gnp_double_compare);
	double most = 3 * sorted[count / 2];
	free(sorted);
	for (size_t i = 0; i < count; i++)
		radii[i] = fmin(radii[i], most);
	return GNP_OK;
}

static gnp_status find_radii(struct gnp_session *session, const double *points, size_t count, double *radii,
                             struct gnp_error *error)
{
	enum { NEIGHBORS = 7, CHUNK = 1024 };
	struct gnp_neighbors *neighbors;
	gnp_status status = gnp_neighbors_build(points, count, &neighbors, error);
	if (status != GNP_OK)
		return status;
	struct radius_search search = {neighbors, points, count < NEIGHBORS ? count : NEIGHBORS, radii};
	gnp_task_stage(&session->task, GNP_STAGE_NEIGHBORS, count);
	status = gnp_pool_run(session->pool, &session->task, count, CHUNK, search_radii, &search, error);
	gnp_neighbors_free(neighbors);
	return status == GNP_OK ? limit_radii(radii, count, error) : status;
}

static gnp_status load(const struct gnp_arguments *arguments, const struct gnp_tensors *tensors, struct plot *plot,
                       struct gnp_error *error)
{
	size_t count;
	gnp_status status = gnp_field_points(tensors, &count, &plot->points, error);
	if (status != GNP_OK)
		return status;
	if (gnp_field_find(tensors, "normals"))
		status = gnp_field_load(tensors, "normals", count, 3, &plot->normals, error);
	if (status == GNP_OK)
		status = load_values(arguments, tensors, count, plot, error);
	plot->radii = gnp_array_new(count, sizeof *plot->radii);
	if (status == GNP_OK && !plot->radii)
		status = gnp_error_set(error, GNP_OUT_OF_MEMORY, "plot: no memory for %zu points", count);
	plot->scene.count = count;
	plot->scene.points = plot->points;
	plot->scene.normals = plot->normals;
	plot->scene.values = plot->values;
	plot->scene.radii = plot->radii;
	return status;
}

static gnp_status set_range(struct plot *plot, const double limits[2], struct gnp_error *error)
{
	if (!plot->values)
		return GNP_OK;
	if (limits[0] < limits[1]) {
		plot->scene.range = (struct gnp_value_range){limits[0], limits[1]};
		return GNP_OK;
	}
	return gnp_colormap_limits(plot->values, plot->scene.count, &plot->scene.range, error);
}

static gnp_status draw(struct plot *plot, const double limits[2], struct gnp_buffer *png, struct gnp_error *error)
{
	struct gnp_session session;
	struct gnp_picture picture = {0};
	gnp_status status = gnp_session_open(&session, 0, error);
	if (status != GNP_OK)
		return status;
	status = find_radii(&session, plot->points, plot->scene.count, plot->radii, error);
	if (status == GNP_OK)
		status = set_range(plot, limits, error);
	if (status == GNP_OK)
		status = gnp_task_check(&session.task, error);
	if (status == GNP_OK)
		status = gnp_render(&plot->scene, &picture, error);
	if (status == GNP_OK)
		status = gnp_picture_encode(&picture, png, error);
	gnp_picture_clear(&picture);
	gnp_session_close(&session);
	return status;
}

static enum gnp_exit run(const struct gnp_command *command, const struct gnp_arguments *arguments, struct gnp_error *error)
{
	(void)command;
	struct plot plot = {0};
	struct gnp_buffer content = {0}, png = {0};
	struct gnp_tensors tensors = {0};
	double limits[2] = {0, 0};
	if (parse_view(arguments, &plot.scene, limits, error) != GNP_OK)
		return GNP_EXIT_USAGE;
	const char *input_format = gnp_arguments_get(arguments, "input-format", NULL);
	gnp_status status = gnp_file_load(arguments->operands[0], input_format, &content, &tensors, error);
	if (status == GNP_OK)
		status = load(arguments, &tensors, &plot, error);
	if (status == GNP_OK)
		status = draw(&plot, limits, &png, error);
	if (status == GNP_OK)
		status = gnp_file_write(gnp_arguments_get(arguments, "output", "-"), png.data, png.size, error);
	free(plot.points);
	free(plot.normals);
	free(plot.values);
	free(plot.radii);
	gnp_tensors_clear(&tensors);
	gnp_buffer_clear(&content);
	gnp_buffer_clear(&png);
	return gnp_exit_of(status, false);
}

const struct gnp_command gnp_command_plot = {
	.name = "plot",
	.operands = "IN [OPTIONS] -o OUT.png",
	.help = "a PNG picture of a cloud, coloured by a field",
	.options = options,
	.option_count = sizeof options / sizeof options[0],
	.operands_least = 1,
	.operands_most = 1,
	.run = run,
};
