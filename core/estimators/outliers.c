#include "core/estimators/outliers.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/select.h"
#include "core/cloud/cover.h"
#include "core/cloud/patch.h"
#include "core/fit/least_squares.h"
#include "core/fit/taylor.h"

enum {
	SERVED = 12,     /* points a judging patch serves: each point is judged about JUDGED / SERVED times */
	JUDGED = 50,     /* nearest points a patch judges */
	POINTS = 130,    /* points it fits */
	FRAMED = 50,     /* nearest points that set its frame */
	DEGREE = 5, SIZE = 21, STRIDE = 24,
	ABSOLUTE_STEPS = 4, TUKEY_STEPS = 6,
	PATCHES_A_CHUNK = 32
};
static const double cut = 5, tukey = 4.7;
static const double calm = 3.5; /* a plain fit with no misfit above this many scales has nothing to be robust against */

struct judgement {
	uint32_t point;
	float ratio; /* misfit over the patch's scale; with its sign bit set from another sheet, NaN where the patch cannot judge */
};

struct work {
	const struct gnp_patch_source *source;
	const struct gnp_neighbors *neighbors;
	const struct gnp_cover *cover;
	size_t fitted, judged; /* POINTS and JUDGED, or all points of a smaller cloud */
	struct judgement *judgements; /* (patches, judged) */
	size_t *start;                /* (points + 1) of each point's judgements in ratios */
	float *ratios;
	unsigned char *outlier;
};

struct robust_fit {
	double u[POINTS], v[POINTS], w[POINTS], reach;
	double rows[POINTS * STRIDE], weight[POINTS], misfit[POINTS], sorted[POINTS];
	double gram[STRIDE * STRIDE], moment[STRIDE];
};

static void reweight(struct robust_fit *fit, size_t count, double scale, int step)
{
	for (size_t i = 0; i < count; i++) {
		double e = fit->misfit[i];
		if (step < ABSOLUTE_STEPS - 1) {
			fit->weight[i] = 0.3 * scale / fmax(e, 0.3 * scale);
		} else {
			double t = 1 - e * e / (tukey * tukey * scale * scale);
			fit->weight[i] = t > 0 ? t * t : 0;
		}
	}
}

/* The points of the centre's sheet, in units of their in-plane reach; how many. */
static size_t fill(const struct gnp_patch_source *source, const struct gnp_patch *patch, struct robust_fit *fit)
{
	const double *normal = source->normals + 3 * (size_t)patch->centre;
	size_t count = 0;
	fit->reach = 0;
	for (size_t i = 0; i < patch->buffer_count; i++) {
		if (!gnp_same_sheet(source->normals + 3 * (size_t)patch->index[i], normal))
			continue;
		fit->u[count] = patch->u[i];
		fit->v[count] = patch->v[i];
		fit->w[count++] = patch->w[i];
		fit->reach = fmax(fit->reach, hypot(patch->u[i], patch->v[i]));
	}
	for (size_t i = 0; i < count; i++) {
		fit->u[i] /= fit->reach;
		fit->v[i] /= fit->reach;
	}
	return count;
}

static double largest(const double *values, size_t count)
{
	double most = 0;
	for (size_t i = 0; i < count; i++)
		most = fmax(most, values[i]);
	return most;
}

/* Leaves the coefficients in fit->moment and returns the scale of the misfits; negative when the data leave no
 * choice. */
static double robust_scale(size_t count, struct robust_fit *fit)
{
	enum { SPARE = 8 };
	if (count < SIZE + SPARE || !(fit->reach > 0))
		return -1;
	double scale = -1, dof = sqrt((double)count / (double)(count - SIZE));
	for (size_t i = 0; i < count; i++)
		fit->weight[i] = 1;
	gnp_taylor_rows(DEGREE, fit->u, fit->v, count, STRIDE, fit->rows);
	for (int step = 0; step < ABSOLUTE_STEPS + TUKEY_STEPS; step++) {
		gnp_normal_equations(fit->rows, fit->weight, fit->w, count, STRIDE, fit->gram, fit->moment);
		for (size_t i = 0; i < SIZE; i++)
			fit->gram[i * STRIDE + i] += 1e-9;
		if (!gnp_cholesky_factor(fit->gram, SIZE, STRIDE, 1e-14))
			return -1;
		gnp_cholesky_forward(fit->gram, SIZE, STRIDE, fit->moment, fit->moment);
		gnp_cholesky_backward(fit->gram, SIZE, STRIDE, fit->moment, fit->moment);
		for (size_t i = 0; i < count; i++) {
			double sum = fit->w[i];
			for (size_t j = 0; j < SIZE; j++)
				sum -= fit->rows[i * STRIDE + j] * fit->moment[j];
			fit->misfit[i] = fabs(sum);
		}
		memcpy(fit->sorted, fit->misfit, count * sizeof(double));
		scale = fmax(dof * gnp_median_deviation(fit->sorted, count), 1e-12);
		if (step == 0 && largest(fit->misfit, count) < calm * scale)
			return scale;
		reweight(fit, count, scale, step);
	}
	return scale;
}

/* What the fit to a patch thinks of its nearest points. */
static void judge(const struct work *work, const struct gnp_patch *patch, struct robust_fit *fit, struct judgement *out)
{
	const double *normals = work->source->normals, *normal = normals + 3 * (size_t)patch->centre;
	double scale = robust_scale(fill(work->source, patch, fit), fit);
	if (scale <= 0) {
		for (size_t i = 0; i < work->judged; i++)
			out[i] = (struct judgement){patch->index[i], NAN};
		return;
	}
	for (size_t i = 0; i < work->judged; i++) {
		fit->u[i] = patch->u[i] / fit->reach;
		fit->v[i] = patch->v[i] / fit->reach;
	}
	gnp_taylor_rows(DEGREE, fit->u, fit->v, work->judged, STRIDE, fit->rows);
	for (size_t i = 0; i < work->judged; i++) {
		double misfit = patch->w[i];
		for (size_t j = 0; j < SIZE; j++)
			misfit -= fit->rows[i * STRIDE + j] * fit->moment[j];
		float ratio = (float)(fabs(misfit) / scale);
		bool own = gnp_same_sheet(normals + 3 * (size_t)patch->index[i], normal);
		out[i] = (struct judgement){patch->index[i], own ? ratio : -ratio};
	}
}

static gnp_status judge_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                              struct gnp_error *error)
{
	struct work *work = context;
	struct gnp_neighborhoods found;
	gnp_status status = gnp_neighborhoods_find(work->neighbors, work->cover->centre + begin, end - begin, work->fitted, 1,
	                                           work->fitted, scratch, &found, error);
	if (status != GNP_OK)
		return status;
	struct robust_fit *fit = gnp_scratch_take(scratch, 1, sizeof *fit);
	double *u = gnp_scratch_take(scratch, 3 * work->fitted, sizeof *u);
	if (!fit || !u)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "outliers: no memory for a patch of %zu points", work->fitted);
	for (size_t p = begin; p < end; p++) {
		struct gnp_patch patch;
		status = gnp_patch_build(work->source, &found, p - begin, work->cover->centre[p], u, u + work->fitted,
		                         u + 2 * work->fitted, &patch, error);
		if (status != GNP_OK)
			return status;
		judge(work, &patch, fit, work->judgements + p * work->judged);
	}
	return GNP_OK;
}

/* The median judgement by patches of the point's own sheet; by all when those are less than a quarter, for then the
 * point's normal fits none about it and names no sheet. 0 without any. */
static double median_judgement(const float *ratios, size_t count)
{
	enum { MOST = 256 };
	double own[MOST], all[MOST];
	size_t owns = 0, total = 0;
	for (size_t i = 0; i < count && total < MOST; i++) {
		if (isnan(ratios[i]))
			continue;
		all[total++] = fabs((double)ratios[i]);
		if (!signbit(ratios[i]))
			own[owns++] = ratios[i];
	}
	return 4 * owns >= total ? gnp_median(own, owns) : gnp_median(all, total);
}

static gnp_status verdict_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                struct gnp_error *error)
{
	struct work *work = context;
	(void)scratch;
	(void)error;
	for (size_t p = begin; p < end; p++)
		work->outlier[p] = median_judgement(work->ratios + work->start[p], work->start[p + 1] - work->start[p]) > cut;
	return GNP_OK;
}

/* Judgements by patch to judgements by point. */
static void collect(struct work *work, size_t count)
{
	size_t total = work->cover->count * work->judged;
	for (size_t i = 0; i < total; i++)
		work->start[work->judgements[i].point + 1]++;
	for (size_t p = 0; p < count; p++)
		work->start[p + 1] += work->start[p];
	for (size_t i = total; i-- > 0;)
		work->ratios[--work->start[work->judgements[i].point + 1]] = work->judgements[i].ratio;
	/* filling from the back has moved each start to its own place, one slot late */
	memmove(work->start, work->start + 1, count * sizeof *work->start);
	work->start[count] = total;
}

gnp_status gnp_outliers_find(const double *points, const double *normals, size_t count,
                             const struct gnp_neighbors *neighbors, struct gnp_pool *pool, struct gnp_task *task,
                             unsigned char *outlier, struct gnp_error *error)
{
	struct gnp_cover cover = {0};
	gnp_status status = gnp_cover_greedy(neighbors, points, count, &(struct gnp_cover_rule){.fixed = SERVED}, pool, task,
	                                     &cover, error);
	if (status != GNP_OK)
		return status;
	const struct gnp_patch_source source = {.points = points, .normals = normals, .k = count < FRAMED ? count : FRAMED,
	                                        .delta0_ratio = 1e-9, .one_sheet = true};
	struct work work = {.source = &source, .neighbors = neighbors, .cover = &cover, .outlier = outlier,
	                    .fitted = count < POINTS ? count : POINTS, .judged = count < JUDGED ? count : JUDGED};
	work.judgements = gnp_array_new(cover.count, work.judged * sizeof *work.judgements);
	work.ratios = gnp_array_new(cover.count, work.judged * sizeof *work.ratios);
	work.start = gnp_array_zero(count + 2, sizeof *work.start);
	if (!work.judgements || !work.ratios || !work.start)
		status = gnp_error_set(error, GNP_OUT_OF_MEMORY, "outliers: no memory for %zu points", count);
	if (status == GNP_OK)
		status = gnp_pool_run(pool, task, cover.count, PATCHES_A_CHUNK, judge_chunk, &work, error);
	if (status == GNP_OK) {
		collect(&work, count);
		status = gnp_pool_run(pool, task, count, 4096, verdict_chunk, &work, error);
	}
	free(work.judgements);
	free(work.ratios);
	free(work.start);
	gnp_cover_clear(&cover);
	return status;
}
