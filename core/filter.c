#include "filter.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "area.h"
#include "memory.h"
#include "model.h"
#include "strays.h"
#include "vector.h"

struct gnp_filter_options gnp_filter_defaults(void)
{
	return (struct gnp_filter_options){.estimate = gnp_estimate_defaults(), .alpha = 0.1, .consensus = true, .gross = 3, .cluster = 50,
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

static gnp_status check_number(const char *name, double value, double least, double most, struct gnp_error *error)
{
	if (value >= least && value <= most)
		return GNP_OK;
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: got %g, need %g..%g", name, value, least, most);
}

static gnp_status check_options(const struct gnp_filter_options *options, struct gnp_error *error)
{
	if (!(options->alpha > 0 && options->alpha <= 1e100))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "alpha: got %g, need a number above 0", options->alpha);
	if (options->gross != 0 && !(options->gross >= 1 && options->gross <= 1e6))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "gross: got %g, need 1..1e6 local spacings, or 0 for none", options->gross);
	gnp_status status = check_number("cluster", options->cluster, 1, 1e6, error);
	if (status == GNP_OK)
		status = check_number("iterations", options->iterations, 1, 100, error);
	return status == GNP_OK ? check_number("tolerance", options->tolerance, 0, 1e6, error) : status;
}

static size_t least_points(const struct gnp_filter_options *options)
{
	return options->estimate.model ? options->estimate.model->recipe.k : (size_t)options->estimate.k;
}

/* ---- The filter under way ---- */

struct run {
	const struct gnp_filter_options *options;
	struct gnp_pool *pool;
	struct gnp_task *task;
	struct gnp_filter result;
};

static gnp_status no_memory(size_t count, struct gnp_error *error)
{
	return gnp_error_set(error, GNP_OUT_OF_MEMORY, "filter: no memory for %zu points", count);
}

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
	return gnp_error_set(error, GNP_DEGENERATE, "filter: %s leaves %zu of %zu points, need at least %zu, a neighbourhood", rule,
	                     run->result.kept, run->result.count, need);
}

/* ---- Gross outliers ---- */

static gnp_status drop_strays(struct run *run, const struct gnp_prepared *prepared, struct gnp_error *error)
{
	struct gnp_filter *r = &run->result;
	size_t count = r->count;
	unsigned char *stray = gnp_array_new(count, 1), *keep = gnp_array_new(count, 1);
	double *away = gnp_array_new(count, sizeof *away);
	gnp_status status = stray && keep && away ? GNP_OK : no_memory(count, error);
	gnp_task_stage(run->task, GNP_STAGE_FILTER, 2 * count);
	if (status == GNP_OK)
		status = gnp_strays_find(prepared, run->options->gross, (size_t)run->options->cluster, run->pool, run->task, stray, away,
		                         &r->dropped_gross, error);
	for (size_t i = 0; i < count && status == GNP_OK; i++) {
		size_t row = prepared->order[i];
		keep[row] = r->keep[row] = !stray[i];
		r->deviation[row] = away[i];
	}
	if (status == GNP_OK)
		compact(run, keep);
	free(stray);
	free(keep);
	free(away);
	return status == GNP_OK ? check_left(run, "the pre-filter for gross outliers", error) : status;
}

/* ---- Deviations ---- */

/* Estimates at the points that are left, in their order; the normals are theirs if those are `known`. *spacing (may be NULL): the root
 * of the mean area a point stands for. */
static gnp_status estimate(struct run *run, bool known, struct gnp_estimate *found, double *spacing, struct gnp_error *error)
{
	const struct gnp_cloud cloud = {run->result.kept, run->result.points, known ? run->result.normals : NULL};
	struct gnp_estimate_options options = run->options->estimate;
	struct gnp_prepared prepared;
	double *area = spacing ? gnp_array_new(cloud.count, sizeof *area) : NULL, total = 0;
	options.quantities = GNP_QUANTITY_BIT(GNP_POINTS) | GNP_QUANTITY_BIT(GNP_NORMALS) | GNP_QUANTITY_BIT(GNP_DEVIATION);
	options.if_offered = run->options->consensus ? GNP_QUANTITY_BIT(GNP_OUTLIER) : 0;
	gnp_status status = area || !spacing ? gnp_cloud_check(&cloud, least_points(run->options), error) : no_memory(cloud.count, error);
	if (status == GNP_OK)
		status = gnp_prepare(&cloud, run->pool, run->task, &prepared, error);
	if (status != GNP_OK) {
		free(area);
		return status;
	}
	if (!known)
		run->result.components = prepared.components;
	if (area)
		status = gnp_area_measure(&prepared, run->pool, run->task, area, NULL, error);
	for (size_t i = 0; area && i < cloud.count && status == GNP_OK; i++)
		total += area[i];
	if (spacing)
		*spacing = sqrt(total / (double)cloud.count);
	if (status == GNP_OK)
		status = gnp_estimate_prepared(&prepared, &options, run->pool, run->task, found, error);
	gnp_prepared_clear(&prepared);
	free(area);
	return status;
}

/* Whose deviation is not a number has no surface about it: it goes too, by the largest deviation there is. */
static double finite_deviation(double deviation)
{
	return isfinite(deviation) ? deviation : 1e100;
}

/* The rule itself: mask (kept) out. */
static void apply_rule(struct run *run, const struct gnp_estimate *found, unsigned char *mask)
{
	struct gnp_filter *r = &run->result;
	for (size_t i = 0; i < r->kept; i++) {
		double deviation = finite_deviation(found->values[GNP_DEVIATION][i]);
		bool near = deviation <= run->options->alpha, judged = found->values[GNP_OUTLIER] && found->values[GNP_OUTLIER][i] > 0;
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

static gnp_status drop_outliers(struct run *run, double *spacing, struct gnp_error *error)
{
	struct gnp_filter *r = &run->result;
	struct gnp_estimate found = {0};
	unsigned char *mask = gnp_array_new(r->kept, 1);
	gnp_status status = mask ? estimate(run, !r->normals_estimated, &found, spacing, error) : no_memory(r->kept, error);
	if (status == GNP_OK) {
		apply_rule(run, &found, mask);
		take_normals(run, &found);
		r->model = found.model;
		r->patches = found.patches;
		r->degenerate = found.degenerate;
		if (run->options->project) {
			r->moved = project(run, &found, mask);
			r->iterations = 1;
		}
		compact(run, mask);
	}
	gnp_estimate_clear(&found);
	free(mask);
	return status == GNP_OK ? check_left(run, "alpha", error) : status;
}

/* ---- Projection, again ---- */

/* A further move, which is taken back where points move no less than before. */
static gnp_status project_once(struct run *run, struct gnp_error *error)
{
	static const double progress = 0.9;
	struct gnp_filter *r = &run->result;
	struct gnp_estimate found = {0};
	double *before = gnp_array_new(r->kept, 3 * sizeof *before);
	gnp_status status = before ? estimate(run, true, &found, NULL, error) : no_memory(r->kept, error);
	if (status == GNP_OK) {
		memcpy(before, r->points, 3 * r->kept * sizeof *before);
		double moved = project(run, &found, NULL);
		if (moved < progress * r->moved) {
			r->moved = moved;
			r->iterations++;
			take_normals(run, &found);
		} else {
			memcpy(r->points, before, 3 * r->kept * sizeof *before);
			r->stop = GNP_FILTER_NO_PROGRESS;
		}
	}
	gnp_estimate_clear(&found);
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
		return no_memory(n, error);
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

gnp_status gnp_filter_run(const struct gnp_cloud *cloud, const struct gnp_filter_options *options, struct gnp_pool *pool,
                          struct gnp_task *task, struct gnp_filter *out, struct gnp_error *error)
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
		status = drop_outliers(&run, options->project ? &spacing : NULL, error);
	if (status == GNP_OK && options->project)
		status = project_on(&run, spacing, error);
	gnp_task_stage(task, GNP_STAGE_DONE, 0);
	if (status == GNP_OK)
		*out = run.result;
	else
		gnp_filter_clear(&run.result);
	return status;
}

size_t gnp_filter_memory(size_t count, const struct gnp_filter_options *options)
{
	/* the result; the cloud made ready, strays' neighbours; areas and a copy of the points when projecting */
	enum { RESULT = 62, READY = 160, STRAYS = 17 * 4 + 26, PROJECTED = 32 };
	struct gnp_estimate_options estimate = options->estimate;
	estimate.quantities = GNP_QUANTITY_BIT(GNP_POINTS) | GNP_QUANTITY_BIT(GNP_NORMALS) | GNP_QUANTITY_BIT(GNP_DEVIATION);
	estimate.if_offered = GNP_QUANTITY_BIT(GNP_OUTLIER);
	size_t each = RESULT + READY + (options->gross > 0 ? STRAYS : 0) + (options->project ? PROJECTED : 0);
	return gnp_estimate_memory(count, &estimate) + count * each;
}
