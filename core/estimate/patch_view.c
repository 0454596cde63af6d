#include "core/estimate/patch_view.h"

#include <math.h>
#include <stdlib.h>

#include "core/base/memory.h"
#include "core/base/vector.h"
#include "core/cloud/prepare.h"
#include "core/estimators/weighted_fit.h"
#include "core/fit/surface.h"
#include "core/fit/taylor.h"
#include "core/model/model.h"

struct work {
	const struct gnp_prepared *prepared;
	const struct gnp_weighted_cloud *weighted;
	uint32_t centre;
	struct gnp_patch_view *out;
};

/* ---- What the fit says ---- */

/* Of the members of one node. */
static void show_node(const struct work *work, const struct gnp_weighted_piece *piece, size_t node)
{
	const struct gnp_support *support = piece->support;
	const struct gnp_weighted_fit *fit = piece->weights;
	const double *points = work->prepared->points, *origin = points + 3 * (size_t)support->centre;
	for (size_t m = support->start[node]; m < support->start[node + 1]; m++) {
		const double *p = points + 3 * (size_t)support->member[m];
		const double d[3] = {(p[0] - origin[0]) / support->radius, (p[1] - origin[1]) / support->radius,
		                     (p[2] - origin[2]) / support->radius};
		double u = gnp_dot(d, support->frame[0]), v = gnp_dot(d, support->frame[1]);
		double surface = gnp_taylor_jet(GNP_TAYLOR_DEGREE, fit->coefficients, u, v).f;
		size_t row = work->prepared->order[support->member[m]];
		work->out->weight[row] = fmin(1, fit->weight[node] / support->weight[node]); /* the least of all is added */
		work->out->height[row] = (gnp_dot(d, support->frame[2]) - surface) * support->radius;
	}
}

static void show(const struct work *work, const struct gnp_weighted_piece *piece)
{
	struct gnp_patch_view *out = work->out;
	const struct gnp_surface *surface = &piece->fit.surface;
	struct gnp_jet jet = gnp_surface_jet(surface, 0, 0);
	double slope = surface->scale_w / surface->scale_xy;
	double length = sqrt(1 + slope * slope * (jet.u * jet.u + jet.v * jet.v));
	for (size_t node = 0; node < piece->support->nodes; node++)
		show_node(work, piece, node);
	for (int c = 0; c < 3; c++)
		out->normal[c] =
			(surface->frame[2][c] - slope * (jet.u * surface->frame[0][c] + jet.v * surface->frame[1][c])) / length;
	out->scale = surface->scale_xy;
	out->radius = piece->support->radius;
	out->points = piece->support->points;
	out->crease = piece->crease;
	out->outlier = piece->outlier;
}

static gnp_status fit(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	const struct work *work = context;
	struct gnp_weighted_piece piece;
	(void)begin;
	(void)end;
	gnp_status status = gnp_weighted_fit_at(work->weighted, &work->centre, 1, false, &piece, scratch, error);
	if (status == GNP_OK)
		show(work, &piece);
	return status;
}

/* ---- The way there ---- */

static gnp_status allocate(size_t count, struct gnp_patch_view *out, struct gnp_error *error)
{
	*out = (struct gnp_patch_view){.count = count, .weight = gnp_array_zero(count, sizeof *out->weight),
	                          .height = gnp_array_zero(count, sizeof *out->height)};
	if (!out->weight || !out->height)
		return gnp_no_memory("patch", count, "points", error);
	return GNP_OK;
}

static uint32_t place_of(const struct gnp_prepared *prepared, size_t row)
{
	uint32_t i = 0;
	while (prepared->order[i] != row)
		i++;
	return i;
}

static gnp_status fit_prepared(const struct gnp_prepared *prepared, const struct gnp_estimate_options *options,
                               size_t at, struct gnp_pool *pool, struct gnp_task *task, struct gnp_patch_view *out,
                               struct gnp_error *error)
{
	const struct gnp_estimator *estimator = gnp_estimate_estimator(options);
	const struct gnp_fit_options how = {.basis = gnp_estimate_basis(options), .model = options->model,
	                                    .models = options->models};
	const struct gnp_fit_cloud cloud = {prepared->count, prepared->points, prepared->normals,
	                                    prepared->components == 0,
	                                    prepared->neighbors};
	void *state = NULL;
	struct work work = {.prepared = prepared, .centre = place_of(prepared, at), .out = out};
	gnp_status status = GNP_OK;
	if (estimator->prepare)
		status = estimator->prepare(&cloud, &how, pool, task, &state, error);
	if (status == GNP_OK && estimator->weighted)
		work.weighted = estimator->weighted(state);
	if (status == GNP_OK && !work.weighted)
		status = gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                       "weights: got %s with the estimator %s, which gives points no weights (any does)",
		                       options->model ? options->model->name : "auto", estimator->name);
	gnp_task_stage(task, GNP_STAGE_ESTIMATE, 1);
	if (status == GNP_OK)
		status = gnp_pool_run(pool, task, 1, 1, fit, &work, error);
	gnp_task_stage(task, GNP_STAGE_DONE, 0);
	out->model = estimator->model && status == GNP_OK ? estimator->model(state) : NULL;
	if (state)
		estimator->release(state);
	return status;
}

gnp_status gnp_patch_view_make(const struct gnp_cloud *cloud, const struct gnp_estimate_options *options, size_t at,
                         struct gnp_pool *pool, struct gnp_task *task, struct gnp_patch_view *out,
                               struct gnp_error *error)
{
	struct gnp_prepared prepared;
	struct gnp_patch_view view = {0};
	gnp_status status = gnp_estimate_check(options, error);
	if (status == GNP_OK)
		status = gnp_cloud_check(cloud, (size_t)options->k, error);
	if (status == GNP_OK && at >= cloud->count)
		status = gnp_error_set(error, GNP_INVALID_ARGUMENT, "at: got %zu, need at most %zu", at, cloud->count - 1);
	if (status == GNP_OK)
		status = gnp_prepare(cloud, pool, task, &prepared, error);
	if (status != GNP_OK)
		return status;
	status = allocate(cloud->count, &view, error);
	if (status == GNP_OK)
		status = fit_prepared(&prepared, options, at, pool, task, &view, error);
	view.normals_estimated = !cloud->normals;
	view.components = prepared.components;
	gnp_prepared_clear(&prepared);
	if (status == GNP_OK)
		*out = view;
	else
		gnp_patch_view_clear(&view);
	return status;
}

/* Beside the cloud made ready: the answer, and the roughness and votes of a weighted model; FIXED does not grow with
 * the cloud. */
size_t gnp_patch_view_memory(size_t count, bool given)
{
	enum { ANSWER = 16, LOOKED = 6, FIXED = 23 << 18 };
	size_t fitting = gnp_prepared_memory(count) + count * (ANSWER + LOOKED);
	size_t preparing = gnp_prepare_memory(count, given);
	return FIXED + (fitting > preparing ? fitting : preparing);
}

void gnp_patch_view_clear(struct gnp_patch_view *view)
{
	free(view->weight);
	free(view->height);
	*view = (struct gnp_patch_view){0};
}
