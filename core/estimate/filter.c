#include "core/estimate/filter.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/check.h"
#include "core/base/memory.h"
#include "core/base/vector.h"
#include "core/cells/area.h"
#include "core/cloud/isolated.h"
#include "core/estimators/outliers.h"
#include "core/model/model.h"

struct gnp_filter_options gnp_filter_defaults(void)
{
	return (struct gnp_filter_options){.estimate = gnp_estimate_defaults(), .alpha = 0, .consensus = true, .gross = 3, .cluster = 50,
	                                   .project = false, .iterations = 1, .tolerance = 1e-3};
}

const char *gnp_filter_stop_text(enum gnp_filter_stop stop)
{
	static const char *const texts[] = {"not_projected", "iterations", "tolerance", "no_progress"};
	return (unsigned)stop < sizeof texts / sizeof *texts ? texts[stop] : "unknown";
}

void gnp_filter_clear(struct gnp_filter *filter)
{
	free(filter->keep);
	free(filter->deviation);
	free(filter->index);
	free(filter->points);
	free(filter->normals);
	*filter = (struct gnp_filter){0};
}

/* ---- Options ---- */

static gnp_status check_options(const struct gnp_filter_options *options, struct gnp_error *error)
{
	gnp_status status = gnp_check_number("alpha", options->alpha, 0, 1e100, error);
	if (status != GNP_OK)
		return status;
	if (options->gross != 0 && !(options->gross >= 1 && options->gross <= 1e6))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "gross: got %g, need 1..1e6 local spacings, or 0 for none", options->gross);
	status = gnp_check_number("cluster", options->cluster, 1, 1e6, error);
	if (status == GNP_OK)
		status = gnp_check_number("iterations", options->iterations, 1, 100, error);
	return status == GNP_OK ? gnp_check_number("tolerance", options->tolerance, 0, 1e6, error) : status;
}

static size_t least_points(const struct gnp_filter_options *options)
{
	const struct gnp_model *model = options->estimate.model;
	return model && model->recipe.k ? model->recipe.k : (size_t)options->estimate.k;
}

/* ---- The filter under way ---- */

struct run {
	const struct gnp_filter_options *options;
	struct gnp_pool *pool;
	struct gnp_task *task;
	struct gnp_filter result;
};

/* Leaves of the result's points those whose row `mask` keeps, in their order. */
static void compact(struct run *run, const unsigned char *mask)
{
	struct gnp_filter *r = &run->result;
	size_t made = 0;
	for (size_t i = 0; i < r->kept; i++) {
		if (!mask[i])
			continue;
		memmove(r->points + 3 * made, r->points + 3 * i, 3 * sizeof *r->points);
		memmove(r->normals + 3 * made, r->normals + 3 * i, 3 * sizeof *r->normals);
		r->index[made++] = r->index[i];
	}
	r->kept = made;
}

static gnp_status check_left(const struct run *run, const char *rule, struct gnp_error *error)
{
	size_t need = least_points(run->options);
	if (run->result.kept >= need)
		return GNP_OK;
	return gnp_error_set(error, GNP_DEGENERATE,
	                     "filter: %s leaves %zu of %zu points, need at least %zu, a neighbourhood", rule,
	                     run->result.kept, run->result.count, need);
}

/* ---- Gross outliers ---- */

static gnp_status drop_strays(struct run *run, const struct gnp_prepared *prepared, struct gnp_error *error)
{
	struct gnp_filter *r = &run->result;
	size_t count = r->count;
	unsigned char *isolated = gnp_array_new(count, 1), *keep = gnp_array_new(count, 1);
	double *away = gnp_array_new(count, sizeof *away);
	gnp_status status = isolated && keep && away ? GNP_OK : gnp_no_memory("filter", count, "points", error);
	gnp_task_stage(run->task, GNP_STAGE_FILTER, 2 * count);
	if (status == GNP_OK)
		status = gnp_isolated_find(prepared, run->options->gross, (size_t)run->options->cluster, run->pool, run->task, isolated, away,
		                         &r->dropped_gross, error);
	for (size_t i = 0; i < count && status == GNP_OK; i++) {
		size_t row = prepared->order[i];
		keep[row] = r->keep[row] = !isolated[i];
		r->deviation[row] = away[i];
	}
	if (status == GNP_OK)
		compact(run, keep);
	free(isolated);
	free(keep);
	free(away);
	return status == GNP_OK ? check_left(run, "the pre-filter for gross outliers", error) : status;
}

/* ---- Deviations ---- */

/* The points that are left, made ready, and what is known of them. Cleared by view_clear. */
struct view {
	struct gnp_prepared prepared;
	struct gnp_estimate found;  /* rows as the points are left */
	unsigned char *outlier;     /* (kept) by consensus, in the same order; NULL: not asked */
};

static void view_clear(struct view *view)
{
	gnp_prepared_clear(&view->prepared);
	gnp_estimate_clear(&view->found);
	free(view->outlier);
}

/* The normals are those of the points that are left if these are `known`, and those of fits if it looks `again`: then
 * nothing is judged. */
static gnp_status look(struct run *run, bool known, bool again, struct view *view, struct gnp_error *error)
{
	const struct gnp_cloud cloud = {run->result.kept, run->result.points, known ? run->result.normals : NULL};
	struct gnp_estimate_options options = run->options->estimate;
	options.quantities = GNP_QUANTITY_BIT(GNP_POINTS) | GNP_QUANTITY_BIT(GNP_NORMALS) | GNP_QUANTITY_BIT(GNP_DEVIATION);
	options.if_offered = run->options->consensus ? GNP_QUANTITY_BIT(GNP_OUTLIER) : 0;
	options.unjudged = again;
	if (run->options->consensus && !again)
		options.cover = GNP_COVER_ALL; /* the more pieces vote, the surer they are */
	gnp_status status = gnp_cloud_check(&cloud, least_points(run->options), error);
	if (status == GNP_OK)
		status = (again ? gnp_prepare_fitted : gnp_prepare)(&cloud, run->pool, run->task, &view->prepared, error);
	if (status == GNP_OK)
		status = gnp_estimate_prepared(&view->prepared, &options, run->pool, run->task, &view->found, error);
	if (!known)
		run->result.components = view->prepared.components;
	return status;
}

/* Points of whose neighbours few face as they do belong to no surface there is: whatever is fitted to them is theirs
 * alone. */
static gnp_status turned_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                               struct gnp_error *error)
{
	enum { NEAR = 17 };
	const struct view *view = context;
	const struct gnp_prepared *prepared = &view->prepared;
	uint32_t index[NEAR];
	double distance[NEAR];
	size_t near = NEAR < prepared->count ? NEAR : prepared->count;
	for (size_t i = begin; i < end; i++) {
		size_t same = 0;
		gnp_status status = gnp_neighbors_knn(prepared->neighbors, prepared->points + 3 * i, 1, near, index, distance, scratch, error);
		if (status != GNP_OK)
			return status;
		for (size_t j = 0; j < near; j++)
			same += index[j] != i && gnp_same_sheet(prepared->normals + 3 * i, prepared->normals + 3 * (size_t)index[j]);
		view->outlier[prepared->order[i]] |= 4 * same < near;
	}
	return GNP_OK;
}

/* By the estimator, or where it does not judge by itself. */
static gnp_status judge(struct run *run, struct view *view, struct gnp_error *error)
{
	const struct gnp_prepared *prepared = &view->prepared;
	size_t count = prepared->count;
	const double *judged = view->found.values[GNP_OUTLIER];
	unsigned char *sorted = gnp_array_new(count, 1);
	view->outlier = gnp_array_new(count, 1);
	gnp_status status = sorted && view->outlier ? GNP_OK : gnp_no_memory("filter", count, "points", error);
	if (status == GNP_OK && !judged) {
		gnp_task_stage(run->task, GNP_STAGE_FILTER, 2 * count);
		status = gnp_outliers_find(prepared->points, prepared->normals, count, prepared->neighbors, run->pool, run->task, sorted, error);
	}
	for (size_t i = 0; i < count && status == GNP_OK; i++)
		view->outlier[prepared->order[i]] = judged ? judged[prepared->order[i]] > 0 : sorted[i];
	free(sorted);
	return status == GNP_OK && !judged ? gnp_pool_run(run->pool, run->task, count, 512, turned_chunk, view, error) : status;
}

/* The root of the mean area a point stands for. */
static gnp_status measure_spacing(struct run *run, const struct gnp_prepared *prepared, double *spacing,
                                  struct gnp_error *error)
{
	double *area = gnp_array_new(prepared->count, sizeof *area), total = 0;
	gnp_status status = area ? gnp_area_measure(prepared, run->pool, run->task, area, NULL, error)
	                         : gnp_no_memory("filter", prepared->count, "points", error);
	for (size_t i = 0; i < prepared->count && status == GNP_OK; i++)
		total += area[i];
	*spacing = sqrt(total / (double)prepared->count);
	free(area);
	return status;
}

/* Whose deviation is not a number has no surface about it: it goes too, by the largest deviation there is. */
static double finite_deviation(double deviation)
{
	return isfinite(deviation) ? deviation : 1e100;
}

/* The rule itself: mask (kept) out. */
static void apply_rule(struct run *run, const struct view *view, unsigned char *mask)
{
	struct gnp_filter *r = &run->result;
	for (size_t i = 0; i < r->kept; i++) {
		double deviation = finite_deviation(view->found.values[GNP_DEVIATION][i]);
		bool near = run->options->alpha == 0 || deviation <= run->options->alpha, judged = view->outlier && view->outlier[i];
		r->deviation[r->index[i]] = deviation;
		r->keep[r->index[i]] = mask[i] = near && !judged;
		r->dropped_deviation += !near;
		r->dropped_consensus += near && judged;
	}
}

static void take_normals(struct run *run, const struct gnp_estimate *found)
{
	memcpy(run->result.normals, found->values[GNP_NORMALS], 3 * run->result.kept * sizeof(double));
}

/* Moves the points that `mask` keeps (NULL: all) onto their surfaces; the root mean square of the moves. */
static double project(struct run *run, const struct gnp_estimate *found, const unsigned char *mask)
{
	double sum = 0;
	size_t moved = 0;
	for (size_t i = 0; i < run->result.kept; i++) {
		double *p = run->result.points + 3 * i;
		const double *q = found->values[GNP_POINTS] + 3 * i, d[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]};
		if (mask && !mask[i])
			continue;
		sum += gnp_dot(d, d);
		moved++;
		memcpy(p, q, 3 * sizeof *p);
	}
	return moved ? sqrt(sum / (double)moved) : 0;
}

/* mask (kept): room for the rule's answer. */
static gnp_status apply(struct run *run, struct view *view, unsigned char *mask, double *spacing,
                        struct gnp_error *error)
{
	struct gnp_filter *r = &run->result;
	gnp_status status = look(run, !r->normals_estimated, false, view, error);
	if (status == GNP_OK && run->options->consensus)
		status = judge(run, view, error);
	if (status == GNP_OK && run->options->project)
		status = measure_spacing(run, &view->prepared, spacing, error);
	if (status != GNP_OK)
		return status;
	apply_rule(run, view, mask);
	take_normals(run, &view->found);
	r->model = view->found.model;
	r->patches = view->found.patches;
	r->degenerate = view->found.degenerate;
	r->outliers = view->found.outliers;
	if (run->options->project) {
		r->moved = project(run, &view->found, mask);
		r->iterations = 1;
	}
	compact(run, mask);
	return check_left(run, run->options->alpha > 0 ? "alpha" : "consensus", error);
}

static gnp_status drop_outliers(struct run *run, double *spacing, struct gnp_error *error)
{
	struct view view = {.outlier = NULL};
	unsigned char *mask = gnp_array_new(run->result.kept, 1);
	gnp_status status = mask ? apply(run, &view, mask, spacing, error) : gnp_no_memory("filter", run->result.kept, "points", error);
	view_clear(&view);
	free(mask);
	return status;
}

/* ---- Projection, again ---- */

/* A further move, which is taken back where points move no less than before. */
static gnp_status project_once(struct run *run, struct gnp_error *error)
{
	static const double progress = 0.9;
	struct gnp_filter *r = &run->result;
	struct view view = {.outlier = NULL};
	double *before = gnp_array_new(r->kept, 3 * sizeof *before);
	gnp_status status = before ? look(run, true, true, &view, error) : gnp_no_memory("filter", r->kept, "points", error);
	if (status == GNP_OK) {
		memcpy(before, r->points, 3 * r->kept * sizeof *before);
		double moved = project(run, &view.found, NULL);
		if (moved < progress * r->moved) {
			r->moved = moved;
			r->iterations++;
			take_normals(run, &view.found);
		} else {
			memcpy(r->points, before, 3 * r->kept * sizeof *before);
			r->stop = GNP_FILTER_NO_PROGRESS;
		}
	}
	view_clear(&view);
	free(before);
	return status;
}

/* Until points hardly move. */
static gnp_status project_on(struct run *run, double spacing, struct gnp_error *error)
{
	struct gnp_filter *r = &run->result;
	gnp_status status = GNP_OK;
	while (status == GNP_OK && r->stop == GNP_FILTER_NOT_PROJECTED) {
		if (r->moved <= run->options->tolerance * spacing)
			r->stop = GNP_FILTER_TOLERANCE;
		else if (r->iterations == run->options->iterations)
			r->stop = GNP_FILTER_ITERATIONS;
		else
			status = project_once(run, error);
	}
	return status;
}

/* ---- Start ---- */

static gnp_status begin(struct run *run, const struct gnp_cloud *cloud, struct gnp_error *error)
{
	struct gnp_filter *r = &run->result;
	size_t n = cloud->count;
	r->count = r->kept = n;
	r->keep = gnp_array_new(n, 1);
	r->deviation = gnp_array_new(n, sizeof *r->deviation);
	r->index = gnp_array_new(n, sizeof *r->index);
	r->points = gnp_array_new(n, 3 * sizeof *r->points);
	r->normals = gnp_array_zero(n, 3 * sizeof *r->normals);
	if (!r->keep || !r->deviation || !r->index || !r->points || !r->normals)
		return gnp_no_memory("filter", n, "points", error);
	r->normals_estimated = !cloud->normals;
	memcpy(r->points, cloud->points, 3 * n * sizeof *r->points);
	if (cloud->normals)
		memcpy(r->normals, cloud->normals, 3 * n * sizeof *r->normals);
	for (size_t i = 0; i < n; i++)
		r->index[i] = (uint32_t)i;
	return GNP_OK;
}

static gnp_status prefilter(struct run *run, const struct gnp_cloud *cloud, struct gnp_error *error)
{
	struct gnp_prepared prepared;
	gnp_status status = gnp_prepare_points(cloud, run->task, &prepared, error);
	if (status != GNP_OK)
		return status;
	status = drop_strays(run, &prepared, error);
	gnp_prepared_clear(&prepared);
	return status;
}

gnp_status gnp_filter_run(const struct gnp_cloud *cloud, const struct gnp_filter_options *options,
                          struct gnp_pool *pool, struct gnp_task *task, struct gnp_filter *out, struct gnp_error *error)
{
	struct run run = {.options = options, .pool = pool, .task = task};
	double spacing = 0;
	gnp_status status = check_options(options, error);
	if (status == GNP_OK)
		status = gnp_cloud_check(cloud, least_points(options), error);
	if (status == GNP_OK)
		status = begin(&run, cloud, error);
	if (status == GNP_OK && options->gross > 0)
		status = prefilter(&run, cloud, error);
	if (status == GNP_OK)
		status = drop_outliers(&run, &spacing, error);
	if (status == GNP_OK && options->project)
		status = project_on(&run, spacing, error);
	gnp_task_stage(task, GNP_STAGE_DONE, 0);
	if (status == GNP_OK)
		*out = run.result;
	else
		gnp_filter_clear(&run.result);
	return status;
}

size_t gnp_filter_memory(size_t count, bool given, const struct gnp_filter_options *options)
{
	/* points that stand alone: the neighbours of each, and distances; a copy of the points that are kept, and when they
	 * are projected their areas */
	enum { ISOLATED = 17 * sizeof(uint32_t) + 3 * sizeof(double) + 2, KEPT = 3 * sizeof(double) + 2,
	       PROJECTED = 4 * sizeof(double) };
	const struct gnp_filter *filter = NULL;
	struct gnp_estimate_options estimate = options->estimate;
	estimate.quantities = GNP_QUANTITY_BIT(GNP_POINTS) | GNP_QUANTITY_BIT(GNP_NORMALS) | GNP_QUANTITY_BIT(GNP_DEVIATION);
	estimate.if_offered = GNP_QUANTITY_BIT(GNP_OUTLIER);
	size_t result = sizeof *filter->keep + sizeof *filter->deviation + sizeof *filter->index + 3 * sizeof *filter->points +
	                3 * sizeof *filter->normals;
	size_t apart = options->gross > 0 ? gnp_prepared_memory(count) + count * ISOLATED : 0;
	size_t fitted = gnp_estimate_memory(count, given, &estimate);
	return (apart > fitted ? apart : fitted) + count * (result + KEPT + (options->project ? PROJECTED : 0));
}
