#include "core/flow/smooth.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/check.h"
#include "core/base/memory.h"
#include "core/base/select.h"
#include "core/base/vector.h"
#include "core/cells/area.h"
#include "core/cells/volume.h"
#include "core/model/model.h"

/* A cloud being smoothed; arrays in curve order. */
struct work {
	const struct gnp_smooth_options *options;
	struct gnp_pool *pool;
	struct gnp_task *task;
	struct gnp_prepared now; /* order: the identity */
	uint32_t *order;         /* (count) the caller's index of each point */
	unsigned char *fixed;    /* (count) */
	double *start;           /* (count, 3) where the points came from */
	double *area;            /* (count) */
	double *rhs, *x;         /* (count, 3) of the diffusion */
	struct gnp_smooth result;
};

struct gnp_smooth_options gnp_smooth_defaults(void)
{
	return (struct gnp_smooth_options){.estimate = gnp_estimate_defaults(), .noise = NAN,
	                                   .features = GNP_SMOOTH_ROUND, .preserve = true, .rounds = 2};
}

gnp_status gnp_smooth_check(const struct gnp_smooth_options *options, struct gnp_error *error)
{
	enum { ROUNDS_MAX = 20 };
	gnp_status status = gnp_check_integer("features", options->features, GNP_SMOOTH_ROUND, GNP_SMOOTH_KEEP, error);
	if (status == GNP_OK)
		status = gnp_check_integer("rounds", options->rounds, 1, ROUNDS_MAX, error);
	if (status == GNP_OK && !isnan(options->noise))
		status = gnp_check_above("noise", options->noise, 0, 1e100, error);
	return status;
}

static size_t least_points(const struct gnp_estimate_options *options)
{
	size_t k = (size_t)options->k;
	return options->model && options->model->recipe.k > k ? options->model->recipe.k : k;
}

/* ---- Onto the fitted surfaces ---- */

/* Normals on the side of those before. */
static void take_normals(struct work *w, const double *found)
{
	double *own = w->now.normals;
	for (size_t i = 0; i < w->now.count; i++) {
		double side = gnp_dot(found + 3 * i, own + 3 * i) < 0 ? -1 : 1;
		for (size_t c = 0; c < 3; c++)
			own[3 * i + c] = side * found[3 * i + c];
	}
}

/* The noise, by how far points are from their surfaces; moves them there. */
static gnp_status take_points(struct work *w, const double *found, bool first, struct gnp_error *error)
{
	double *p = w->now.points;
	bool finite = true;
	for (size_t i = 0; i < w->now.count; i++) {
		const double d[3] = {found[3 * i] - p[3 * i], found[3 * i + 1] - p[3 * i + 1], found[3 * i + 2] - p[3 * i + 2]};
		double off = gnp_dot(d, w->now.normals + 3 * i);
		finite &= isfinite(off);
		w->rhs[i] = fabs(off);
		for (size_t c = 0; c < 3 && !w->fixed[i]; c++)
			p[3 * i + c] += off * w->now.normals[3 * i + c];
	}
	if (!finite)
		return gnp_error_set(error, GNP_DEGENERATE, "smooth: the fitted surfaces are not finite somewhere");
	if (first)
		w->result.noise = isnan(w->options->noise) ? gnp_median_deviation(w->rhs, w->now.count) : w->options->noise;
	return GNP_OK;
}

static gnp_status project(struct work *w, bool first, struct gnp_error *error)
{
	struct gnp_estimate_options options = w->options->estimate;
	struct gnp_estimate found;
	options.quantities = GNP_QUANTITY_BIT(GNP_POINTS) | GNP_QUANTITY_BIT(GNP_NORMALS);
	options.if_offered = 0;
	options.unjudged = !first;
	if (w->result.model)
		options.model = w->result.model;
	gnp_status status = gnp_estimate_prepared(&w->now, &options, w->pool, w->task, &found, error);
	if (status != GNP_OK)
		return status;
	w->result.model = found.model;
	take_normals(w, found.values[GNP_NORMALS]);
	status = take_points(w, found.values[GNP_POINTS], first, error);
	gnp_estimate_clear(&found);
	return status;
}

/* ---- Evening out ---- */

/* What goes from point to point is less, the more their normals differ. */
static void weaken(struct gnp_stiffness *stiffness, const double *normals)
{
	static const double SHARP = 0.35; /* of the difference of unit normals: 20 degrees */
	for (size_t i = 0; i < stiffness->count; i++) {
		stiffness->diagonal[i] = 0;
		for (size_t at = stiffness->start[i]; at < stiffness->start[i + 1]; at++) {
			const double *a = normals + 3 * i, *b = normals + 3 * (size_t)stiffness->column[at];
			double square = 2 - 2 * fmin(gnp_dot(a, b), 1);
			stiffness->value[at] *= exp(-square / (2 * SHARP * SHARP));
			stiffness->diagonal[i] += stiffness->value[at];
		}
	}
}

/* The Gaussian mean over so wide a radius of what x (count, 3) has, or with difference: minus x. */
static gnp_status spread(struct work *w, const struct gnp_stiffness *stiffness, double radius, bool difference,
                         const double *x, struct gnp_error *error)
{
	const struct gnp_diffusion diffusion = {stiffness, w->area, radius * radius / 2, difference ? w->fixed : NULL};
	size_t iterations, width = 3 * w->now.count;
	gnp_status status = GNP_OK;
	if (difference)
		status = gnp_stiffness_apply(stiffness, x, w->rhs, w->pool, w->task, error);
	for (size_t i = 0; i < width && status == GNP_OK; i++)
		w->rhs[i] = difference ? -diffusion.factor * w->rhs[i] : w->area[i / 3] * x[i];
	memset(w->x, 0, width * sizeof *w->x);
	if (status != GNP_OK)
		return status;
	return gnp_diffusion_solve(&diffusion, w->rhs, w->x, w->pool, w->task, &iterations, error);
}

/* An implicit step of the places, along the normals alone. */
static gnp_status diffuse(struct work *w, const struct gnp_stiffness *stiffness, struct gnp_error *error)
{
	static const double LEAST = 0.05; /* of the spacing */
	if (w->result.radius < LEAST * w->result.spacing)
		return GNP_OK;
	gnp_status status = spread(w, stiffness, w->result.radius, true, w->now.points, error);
	for (size_t i = 0; i < w->now.count && status == GNP_OK; i++) {
		const double *n = w->now.normals + 3 * i;
		double along = gnp_dot(w->x + 3 * i, n);
		for (size_t c = 0; c < 3; c++)
			w->now.points[3 * i + c] += along * n[c];
	}
	return status;
}

static double moved(const struct work *w, size_t i)
{
	const double *p = w->now.points + 3 * i, *q = w->start + 3 * i, d[3] = {p[0] - q[0], p[1] - q[1], p[2] - q[2]};
	return gnp_dot(d, w->now.normals + 3 * i);
}

/* What all have moved along their normals. */
static gnp_status take_back(struct work *w, const struct gnp_stiffness *stiffness, struct gnp_error *error)
{
	static const double WIDER = 3, SPACINGS = 4; /* than the diffusion, and at least */
	double radius = fmax(WIDER * w->result.radius, SPACINGS * w->result.spacing);
	double *common = gnp_array_zero(w->now.count, 3 * sizeof *common);
	if (!common)
		return gnp_no_memory("smooth", w->now.count, "points", error);
	for (size_t i = 0; i < w->now.count; i++)
		common[3 * i] = moved(w, i);
	gnp_status status = spread(w, stiffness, radius, false, common, error);
	for (size_t i = 0; i < w->now.count && status == GNP_OK; i++)
		for (size_t c = 0; c < 3 && !w->fixed[i]; c++)
			w->now.points[3 * i + c] -= w->x[3 * i] * w->now.normals[3 * i + c];
	free(common);
	return status;
}

/* No farther from where they came from than noise that was given can have taken them. */
static void hold(struct work *w)
{
	static const double DEVIATIONS = 4;
	double most = DEVIATIONS * w->options->noise;
	for (size_t i = 0; i < w->now.count && !isnan(most); i++) {
		double far = moved(w, i), over = far - fmax(-most, fmin(most, far));
		for (size_t c = 0; c < 3 && !w->fixed[i]; c++)
			w->now.points[3 * i + c] -= over * w->now.normals[3 * i + c];
	}
}

static gnp_status even_out(struct work *w, struct gnp_error *error)
{
	struct gnp_stiffness stiffness;
	double total = 0;
	gnp_status status = gnp_area_measure(&w->now, w->pool, w->task, w->area, NULL, error);
	for (size_t i = 0; i < w->now.count && status == GNP_OK; i++)
		total += w->area[i];
	if (status == GNP_OK && !isfinite(total))
		status = gnp_error_set(error, GNP_DEGENERATE, "smooth: the area of the cloud, %g, is not finite", total);
	if (status == GNP_OK)
		status = gnp_volume_stiffness(&w->now, w->pool, w->task, &stiffness, error);
	if (status != GNP_OK)
		return status;
	w->result.spacing = sqrt(total / (double)w->now.count);
	/* so wide at most that much of the surface is as one */
	w->result.radius = fmin(sqrt(2 * w->result.noise) * sqrt(w->result.spacing), sqrt(total) / 4);
	if (w->options->features == GNP_SMOOTH_KEEP)
		weaken(&stiffness, w->now.normals);
	status = diffuse(w, &stiffness, error);
	if (status == GNP_OK && w->options->preserve)
		status = take_back(w, &stiffness, error);
	hold(w);
	gnp_stiffness_clear(&stiffness);
	return status;
}

/* ---- Start, rounds and end ---- */

static gnp_status begin(struct work *w, const struct gnp_cloud *cloud, const unsigned char *fixed,
                        struct gnp_error *error)
{
	gnp_status status = gnp_prepare(cloud, w->pool, w->task, &w->now, error);
	if (status != GNP_OK)
		return status;
	size_t count = w->now.count;
	w->result.count = count;
	w->result.normals_estimated = !cloud->normals;
	w->result.components = w->now.components;
	w->order = gnp_array_new(count, sizeof *w->order);
	w->fixed = gnp_array_zero(count, 1);
	w->start = gnp_array_new(count, 3 * sizeof *w->start);
	w->area = gnp_array_new(count, sizeof *w->area);
	w->rhs = gnp_array_new(count, 3 * sizeof *w->rhs);
	w->x = gnp_array_new(count, 3 * sizeof *w->x);
	if (!w->order || !w->fixed || !w->start || !w->area || !w->rhs || !w->x)
		return gnp_no_memory("smooth", count, "points", error);
	memcpy(w->start, w->now.points, 3 * count * sizeof *w->start);
	for (size_t i = 0; i < count; i++) {
		w->order[i] = w->now.order[i];
		w->fixed[i] = fixed && fixed[w->order[i]];
		w->now.order[i] = (uint32_t)i;
	}
	return GNP_OK;
}

static gnp_status go_round(struct work *w, int round, struct gnp_error *error)
{
	gnp_status status = round ? gnp_prepared_index(&w->now, error) : GNP_OK;
	if (status == GNP_OK)
		status = gnp_task_check(w->task, error);
	if (status == GNP_OK)
		status = project(w, round == 0, error);
	if (status == GNP_OK)
		status = gnp_prepared_index(&w->now, error);
	return status == GNP_OK ? even_out(w, error) : status;
}

/* In the caller's order. */
static gnp_status finish(struct work *w, struct gnp_error *error)
{
	struct gnp_smooth *r = &w->result;
	r->points = gnp_array_new(r->count, 3 * sizeof *r->points);
	r->normals = gnp_array_new(r->count, 3 * sizeof *r->normals);
	r->moved = gnp_array_new(r->count, sizeof *r->moved);
	if (!r->points || !r->normals || !r->moved)
		return gnp_no_memory("smooth", r->count, "points", error);
	for (size_t i = 0; i < r->count; i++) {
		size_t to = w->order[i];
		memcpy(r->points + 3 * to, w->now.points + 3 * i, 3 * sizeof *r->points);
		memcpy(r->normals + 3 * to, w->now.normals + 3 * i, 3 * sizeof *r->normals);
		r->moved[to] = moved(w, i);
	}
	return GNP_OK;
}

void gnp_smooth_clear(struct gnp_smooth *smooth)
{
	free(smooth->points);
	free(smooth->normals);
	free(smooth->moved);
	*smooth = (struct gnp_smooth){0};
}

gnp_status gnp_smooth_run(const struct gnp_cloud *cloud, const unsigned char *fixed,
                          const struct gnp_smooth_options *options, struct gnp_pool *pool, struct gnp_task *task,
                          struct gnp_smooth *out, struct gnp_error *error)
{
	struct work w = {.options = options, .pool = pool, .task = task};
	gnp_status status = gnp_smooth_check(options, error);
	if (status == GNP_OK)
		status = gnp_cloud_check(cloud, least_points(&options->estimate), error);
	if (status == GNP_OK)
		status = begin(&w, cloud, fixed, error);
	for (int round = 0; round < options->rounds && status == GNP_OK; round++)
		status = go_round(&w, round, error);
	if (status == GNP_OK)
		status = finish(&w, error);
	gnp_prepared_clear(&w.now);
	void *const arrays[] = {w.order, w.fixed, w.start, w.area, w.rhs, w.x};
	for (size_t i = 0; i < sizeof arrays / sizeof *arrays; i++)
		free(arrays[i]);
	if (status == GNP_OK)
		*out = w.result;
	else
		gnp_smooth_clear(&w.result);
	return status;
}

/* While a round estimates, or while it evens out: a stiffness of some seven entries a point as it is made. */
size_t gnp_smooth_memory(size_t count, bool given, const struct gnp_smooth_options *options)
{
	enum { OWN = 4 + 1 + 13 * sizeof(double), EVENING = 20 * 8 + 2 * 20 * 12 + 15 * sizeof(double) };
	struct gnp_estimate_options estimate = options->estimate;
	estimate.quantities = GNP_QUANTITY_BIT(GNP_POINTS) | GNP_QUANTITY_BIT(GNP_NORMALS);
	estimate.if_offered = 0;
	size_t start = gnp_estimate_memory(count, given, &estimate), later = gnp_estimate_memory(count, true, &estimate);
	size_t evening = gnp_prepared_memory(count) + count * EVENING, most = later > evening ? later : evening;
	return (start > most ? start : most) + count * OWN;
}
