#include "core/estimate/estimate_patches.h"

#include <math.h>
#include <string.h>

#include "core/base/task.h"
#include "core/base/vector.h"
#include "core/cells/disk.h"
#include "core/cloud/belief_sample.h"
#include "core/estimate/belief_answer.h"
#include "core/estimate/estimate.h"
#include "core/fit/surface.h"

static size_t nanoseconds(double since)
{
	return (size_t)(1e9 * (gnp_clock() - since));
}

/* The nearest points each patch of a chunk needs: the balls of radius epsilon, or as many as the estimator reaches
 * for. */
static gnp_status find_neighborhoods(const struct gnp_estimate_work *work, size_t begin, size_t count,
                                     struct gnp_scratch *scratch, struct gnp_neighborhoods *found,
                                     struct gnp_error *error)
{
	const struct gnp_prepared *prepared = work->prepared;
	const uint32_t *centres = work->cover.centre + begin;
	size_t k = work->rule.k, reach = 0, most = (size_t)(8 * work->rule.buffer * work->rule.buffer * (double)k) + 64;
	for (size_t p = 0; work->estimator->reach && p < count; p++) {
		size_t wanted = work->estimator->reach(work->state, centres[p]);
		reach = wanted > reach ? wanted : reach;
	}
	if (reach == 0)
		return gnp_neighborhoods_find(prepared->neighbors, centres, count, k, GNP_PATCH_TAU * work->rule.buffer, most, scratch,
		                              found, error);
	reach = reach > k + k / 2 ? reach : k + k / 2;
	reach = reach < prepared->count ? reach : prepared->count;
	return gnp_neighborhoods_find(prepared->neighbors, centres, count, reach, 1, reach, scratch, found, error);
}

static gnp_status build_patches(const struct gnp_estimate_work *work, size_t begin, size_t count,
                                struct gnp_patch *patches, struct gnp_scratch *scratch, struct gnp_error *error)
{
	const struct gnp_prepared *prepared = work->prepared;
	const struct gnp_patch_rule *rule = &work->rule;
	const struct gnp_patch_source source = {.points = prepared->points, .normals = work->sheets ? work->sheets : prepared->normals,
	                                        .k = rule->k, .delta0_ratio = rule->delta0_ratio, .delta0 = rule->delta0,
	                                        .height_scale = rule->height_scale, .one_sheet = work->sheets != NULL};
	struct gnp_neighborhoods found;
	gnp_status status = find_neighborhoods(work, begin, count, scratch, &found, error);
	if (status != GNP_OK)
		return status;
	size_t total = found.start[count];
	double *u = gnp_scratch_take(scratch, total, sizeof *u), *v = gnp_scratch_take(scratch, total, sizeof *v);
	double *w = gnp_scratch_take(scratch, total, sizeof *w);
	if (!u || !v || !w)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "estimate: no memory for patches of %zu points", total);
	for (size_t p = 0; p < count && status == GNP_OK; p++) {
		size_t at = found.start[p];
		status = gnp_patch_build(&source, &found, p, work->cover.centre[begin + p], u + at, v + at, w + at, &patches[p],
		                         error);
	}
	return status;
}

/* The paper's |w - s(u, v)|: the point's height against the surface's, in the patch's scaled height. */
static double deviation(const struct gnp_patch *patch, const struct gnp_surface *surface, const double position[3],
                        double u, double v)
{
	const double *o = surface->origin, d[3] = {position[0] - o[0], position[1] - o[1], position[2] - o[2]};
	return fabs(gnp_dot(d, surface->frame[2]) - gnp_surface_jet(surface, u, v).f) / patch->scale_w;
}

static void write_point(const struct gnp_estimate_work *work, const struct gnp_patch *patch, const struct gnp_fit *fit,
                        const struct gnp_estimate_judgement *judgement, size_t point, size_t row)
{
	struct gnp_estimate *out = work->out;
	const double *position = work->prepared->points + 3 * point;
	double u, v;
	gnp_surface_locate(&fit->surface, position, &u, &v);
	gnp_surface_evaluate(&fit->surface, u, v, work->quantities, row, out->values);
	if (out->values[GNP_SURFACE_COEFFICIENTS])
		memcpy(out->values[GNP_SURFACE_COEFFICIENTS] + row * out->basis_size, fit->surface.coefficients,
		       out->basis_size * sizeof(double));
	if (out->values[GNP_RESIDUAL])
		out->values[GNP_RESIDUAL][row] = fit->residual;
	if (out->values[GNP_DEVIATION])
		out->values[GNP_DEVIATION][row] = deviation(patch, &fit->surface, position, u, v);
	if (out->values[GNP_OUTLIER])
		out->values[GNP_OUTLIER][row] = judgement->outlier;
	if (out->values[GNP_CREASE])
		out->values[GNP_CREASE][row] = judgement->crease;
	if (out->values[GNP_BOUNDARY]) {
		gnp_patch_locate(patch, position, &u, &v);
		out->values[GNP_BOUNDARY][row] = gnp_disk_may_exceed(patch->u, patch->v, patch->count, u, v, work->usual_gap);
	}
}

static void probe_point(const struct gnp_estimate_work *work, const struct gnp_fit *fit,
                        const struct gnp_estimate_judgement *judgement, size_t point)
{
	struct gnp_belief_probe *probe = &work->probes[point / work->stride];
	double u, v, *values[GNP_QUANTITY_COUNT] = {[GNP_NORMALS] = probe->normal};
	gnp_surface_locate(&fit->surface, work->prepared->points + 3 * point, &u, &v);
	gnp_surface_evaluate(&fit->surface, u, v, GNP_QUANTITY_BIT(GNP_NORMALS), 0, values);
	probe->residual = fit->residual;
	probe->outlier = judgement->outlier;
}

void gnp_estimate_write(struct gnp_estimate_work *work, const struct gnp_patch *patch, const struct gnp_fit *fit,
                        const struct gnp_estimate_judgement *judgement, size_t point, size_t row)
{
	write_point(work, patch, fit, judgement, point, row);
	if (work->probes && point == gnp_belief_sample_point(work->stride, work->prepared->count, point / work->stride))
		probe_point(work, fit, judgement, point);
}

static void write_patch(struct gnp_estimate_work *work, size_t p, const struct gnp_patch *patch,
                        const struct gnp_fit *fit)
{
	const struct gnp_prepared *prepared = work->prepared;
	for (size_t m = work->cover.start[p]; m < work->cover.start[p + 1]; m++) {
		size_t point = work->cover.member[m];
		const struct gnp_estimate_judgement judgement = {.outlier = work->outlier && work->outlier[point]};
		gnp_estimate_write(work, patch, fit, &judgement, point, work->chosen ? p : prepared->order[point]);
	}
	if (fit->reduced)
		atomic_fetch_add_explicit(&work->degenerate, work->cover.start[p + 1] - work->cover.start[p],
		                          memory_order_relaxed);
}

gnp_status gnp_estimate_patches(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                struct gnp_error *error)
{
	struct gnp_estimate_work *work = context;
	size_t count = end - begin;
	double started = gnp_clock();
	struct gnp_patch *patches = gnp_scratch_take(scratch, count, sizeof *patches);
	struct gnp_fit *fits = gnp_scratch_take(scratch, count, sizeof *fits);
	if (!patches || !fits)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "estimate: no memory for %zu patches", count);
	gnp_status status = build_patches(work, begin, count, patches, scratch, error);
	if (status != GNP_OK)
		return status;
	atomic_fetch_add_explicit(&work->search_ns, nanoseconds(started), memory_order_relaxed);
	started = gnp_clock();
	status = work->estimator->fit(&work->fit, work->state, patches, count, fits, scratch, error);
	if (status != GNP_OK)
		return status;
	for (size_t p = 0; p < count; p++)
		write_patch(work, begin + p, &patches[p], &fits[p]);
	atomic_fetch_add_explicit(&work->fit_ns, nanoseconds(started), memory_order_relaxed);
	return GNP_OK;
}
