#include "core/estimators/adaptive.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/estimators/adaptive_support.h"
#include "core/estimators/outliers.h"
#include "core/estimators/sheets.h"

enum {
	SERVED = 64,         /* points a representative stands for */
	POINTS_A_SERVED = 60 /* of a support, for each point its patch may serve: those within a tenth or so of its reach */
};

void gnp_adaptive_release(void *pointer)
{
	struct gnp_adaptive_state *state = pointer;
	if (!state)
		return;
	free(state->normals);
	free(state->outlier);
	free(state->representative);
	free(state->choice);
	gnp_cover_clear(&state->cover);
	free(state);
}

static gnp_status prepare_state(struct gnp_adaptive_state *state, const struct gnp_fit_cloud *cloud,
                                struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error)
{
	state->count = cloud->count;
	state->normals = gnp_array_new(cloud->count, 3 * sizeof *state->normals);
	state->outlier = gnp_array_new(cloud->count, 1);
	state->representative = gnp_array_new(cloud->count, sizeof *state->representative);
	if (!state->normals || !state->outlier || !state->representative)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "adaptive: no memory for %zu points", cloud->count);
	gnp_status status = gnp_outliers_find(cloud->points, cloud->normals, cloud->count, cloud->neighbors, pool, task,
	                                      state->outlier, error);
	if (status == GNP_OK)
		status = gnp_sheets_normals(cloud, state->outlier, pool, task, state->normals, error);
	if (status == GNP_OK)
		status = gnp_cover_greedy(cloud->neighbors, cloud->points, cloud->count,
		                          &(struct gnp_cover_rule){.fixed = SERVED < cloud->count ? SERVED : cloud->count}, pool, task,
		                          &state->cover, error);
	if (status != GNP_OK)
		return status;
	for (size_t r = 0; r < state->cover.count; r++)
		for (size_t m = state->cover.start[r]; m < state->cover.start[r + 1]; m++)
			state->representative[state->cover.member[m]] = (uint32_t)r;
	state->choice = gnp_array_new(state->cover.count, sizeof *state->choice);
	if (!state->choice)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY,
		                     "adaptive: no memory for %zu representatives", state->cover.count);
	return gnp_adaptive_support_choose(state, cloud, pool, task, error);
}

gnp_status gnp_adaptive_prepare(const struct gnp_fit_cloud *cloud, const struct gnp_fit_options *options,
                                struct gnp_pool *pool, struct gnp_task *task, void **out, struct gnp_error *error)
{
	(void)options;
	struct gnp_adaptive_state *state = gnp_array_zero(1, sizeof *state);
	if (!state)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "adaptive: no memory");
	gnp_status status = prepare_state(state, cloud, pool, task, error);
	if (status == GNP_OK)
		*out = state;
	else
		gnp_adaptive_release(state);
	return status;
}

size_t gnp_adaptive_reach(const void *pointer, uint32_t point)
{
	const struct gnp_adaptive_state *state = pointer;
	size_t wanted = state->choice[state->representative[point]].points;
	return wanted + wanted / 8 + 16; /* room for those that are not usable */
}

size_t gnp_adaptive_served(const void *pointer, uint32_t point)
{
	const struct gnp_adaptive_state *state = pointer;
	size_t served = state->choice[state->representative[point]].points / POINTS_A_SERVED;
	return served < 1 ? 1 : served;
}

const unsigned char *gnp_adaptive_outliers(const void *pointer)
{
	return ((const struct gnp_adaptive_state *)pointer)->outlier;
}

const double *gnp_adaptive_normals(const void *pointer)
{
	return ((const struct gnp_adaptive_state *)pointer)->normals;
}

/* Drops the points that misfit the surface by more than 4.5 sigma; how many are left. */
static size_t drop_misfits(struct gnp_adaptive_local *local, size_t count, const struct gnp_posterior *posterior)
{
	double limit = 4.5 * sqrt(posterior->variance);
	size_t kept = 0;
	for (size_t i = 0; i < count; i++) {
		const double *row = local->rows + i * GNP_TAYLOR_STRIDE;
		double misfit = local->y[i];
		for (size_t j = 0; j < GNP_TAYLOR_SIZE; j++)
			misfit -= row[j] * posterior->mean[j];
		if (fabs(misfit) > limit)
			continue;
		local->u[kept] = local->u[i];
		local->v[kept] = local->v[i];
		local->y[kept++] = local->y[i];
	}
	return kept;
}

static void fit_patch(const struct gnp_adaptive_state *state, const struct gnp_patch *patch,
                      struct gnp_adaptive_local *local, double *coefficients, double *factor, struct gnp_fit *fit)
{
	enum { REFITS = 3 };
	const struct gnp_adaptive_support *choice = &state->choice[state->representative[patch->centre]];
	struct gnp_posterior posterior = {.factor = factor, .mean = coefficients};
	gnp_adaptive_local_collect(state, patch, choice->points, local);
	size_t count = gnp_adaptive_local_fill(patch, choice->points, local), kept = count;
	struct gnp_prior prior = {fmin(local->radius / choice->length, 8), choice->tau};
	bool solved = false;
	for (int refit = 0; refit < REFITS; refit++) {
		struct gnp_regression regression = gnp_adaptive_local_regression(local, count);
		solved = gnp_regression_condition(&regression, prior, &posterior);
		if (!solved)
			break;
		gnp_regression_mean(&posterior);
		gnp_regression_round(prior, &posterior);
		kept = drop_misfits(local, count, &posterior);
		if (kept == count || kept < GNP_TAYLOR_SIZE / 2)
			break;
		count = kept;
	}
	*fit = (struct gnp_fit){.reduced = !solved, .residual = solved ? sqrt(posterior.variance) * local->radius : 0};
	fit->surface = (struct gnp_surface){.basis = {GNP_BASIS_TAYLOR, GNP_TAYLOR_DEGREE}, .coefficients = coefficients,
	                                    .scale_xy = local->radius, .scale_w = local->radius, .factor = factor,
	                                    .variance = posterior.variance, .noise = sqrt(posterior.variance) * local->radius};
	for (int part = 0; part < 3; part++)
		fit->surface.doubt[part] = choice->doubt;
	memcpy(fit->surface.frame, patch->frame, sizeof patch->frame);
	const double centre[3] = {patch->u[0] * patch->scale_xy, patch->v[0] * patch->scale_xy, patch->w[0] * patch->scale_w};
	for (int c = 0; c < 3; c++)
		fit->surface.origin[c] = patch->origin[c] + centre[0] * patch->frame[0][c] + centre[1] * patch->frame[1][c] +
		                         centre[2] * patch->frame[2][c];
	if (solved)
		return;
	/* Nothing to go by: the plane of the patch, with no knowledge of anything. */
	memset(coefficients, 0, GNP_TAYLOR_STRIDE * sizeof *coefficients);
	memset(factor, 0, GNP_TAYLOR_SIZE * GNP_TAYLOR_STRIDE * sizeof *factor);
	for (size_t i = 0; i < GNP_TAYLOR_SIZE; i++)
		factor[i * GNP_TAYLOR_STRIDE + i] = 1;
	fit->surface.variance = 1;
	fit->surface.noise = local->radius;
}

gnp_status gnp_adaptive_fit(const struct gnp_fit_options *options, const void *pointer, const struct gnp_patch *patches,
                            size_t count, struct gnp_fit *fits, struct gnp_scratch *scratch, struct gnp_error *error)
{
	const struct gnp_adaptive_state *state = pointer;
	(void)options;
	double *coefficients = gnp_scratch_take(scratch, count * GNP_TAYLOR_STRIDE, sizeof *coefficients);
	double *factors = gnp_scratch_take(scratch, count * GNP_TAYLOR_SIZE * GNP_TAYLOR_STRIDE, sizeof *factors);
	struct gnp_adaptive_local *local = gnp_scratch_take(scratch, 1, sizeof *local);
	if (!coefficients || !factors || !local)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "adaptive: no memory for %zu patches", count);
	for (size_t i = 0; i < count; i++)
		fit_patch(state, &patches[i], local, coefficients + i * GNP_TAYLOR_STRIDE,
		          factors + i * GNP_TAYLOR_SIZE * GNP_TAYLOR_STRIDE, &fits[i]);
	return GNP_OK;
}
