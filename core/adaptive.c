#include "adaptive.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cover.h"
#include "memory.h"
#include "outliers.h"
#include "regression.h"

enum {
	SERVED = 32,        /* points a representative stands for */
	FRAMED = 50,        /* nearest points that set its frame */
	LEVELS = 7,         /* supports tried */
	POINTS_MAX = 760,   /* of the largest */
	NEAR = 100,         /* nearest points whose representatives vote together */
	VOTERS = 12,
	CLIMB = 6,          /* priors tried a support */
	REPRESENTATIVES_A_CHUNK = 24,
	POINTS_A_SERVED = 60 /* of a support, for each point its patch may serve: those within a tenth or so of its reach */
};
static const size_t supports[LEVELS] = {44, 70, 112, 180, 288, 460, 730};

/* What a support of so many points says at a representative. */
struct verdict {
	float log_variance; /* of the Hessian's posterior [1/length^2], relative to others of the cloud */
	float log_length, log_tau;
};

/* A representative's choice. */
struct choice {
	uint32_t points;
	float length, tau;
};

struct state {
	size_t count;
	const double *normals; /* (count, 3) borrowed */
	unsigned char *outlier;         /* (count) */
	uint32_t *representative;       /* (count) */
	struct gnp_cover cover;
	struct choice *choice;          /* (representatives) */
};

/* The data of one local regression, in scratch. */
struct local {
	double u[POINTS_MAX], v[POINTS_MAX], y[POINTS_MAX], ones[POINTS_MAX];
	double rows[POINTS_MAX * GNP_TAYLOR_STRIDE];
	double gram[GNP_TAYLOR_STRIDE * GNP_TAYLOR_STRIDE], moment[GNP_TAYLOR_STRIDE];
	double factor[GNP_TAYLOR_SIZE * GNP_TAYLOR_STRIDE], mean[GNP_TAYLOR_STRIDE];
	double sums[GNP_TAYLOR_STRIDE * GNP_TAYLOR_STRIDE], sums_moment[GNP_TAYLOR_STRIDE]; /* over nested supports */
	uint32_t usable[POINTS_MAX]; /* positions in the patch, ascending by distance */
	size_t usable_count;
	double radius;
};

/* Points of the patch that may lie on the centre's sheet and are no outliers. */
static void collect_usable(const struct state *state, const struct gnp_patch *patch, size_t most, struct local *local)
{
	static const double turned_away = 0.1; /* cosine between normals of one sheet is above this */
	const double *normal = state->normals + 3 * (size_t)patch->centre;
	local->usable_count = 0;
	for (size_t i = 0; i < patch->buffer_count && local->usable_count < most; i++) {
		size_t point = patch->index[i];
		const double *n = state->normals + 3 * point;
		double cosine = n[0] * normal[0] + n[1] * normal[1] + n[2] * normal[2];
		if (!state->outlier[point] && cosine > turned_away)
			local->usable[local->usable_count++] = (uint32_t)i;
	}
}

/* Coordinates about the centre in units of the in-plane reach of the nearest `count` usable points. */
static size_t fill_local(const struct gnp_patch *patch, size_t count, struct local *local)
{
	count = count < local->usable_count ? count : local->usable_count;
	double u0 = patch->u[0], v0 = patch->v[0], w0 = patch->w[0], reach = 0;
	for (size_t i = 0; i < count; i++) {
		size_t at = local->usable[i];
		local->u[i] = patch->u[at] - u0;
		local->v[i] = patch->v[at] - v0;
		local->y[i] = (patch->w[at] - w0) * patch->scale_w;
		local->ones[i] = 1;
		reach = fmax(reach, local->u[i] * local->u[i] + local->v[i] * local->v[i]);
	}
	reach = reach > 0 ? sqrt(reach) : 1;
	local->radius = reach * patch->scale_xy;
	for (size_t i = 0; i < count; i++) {
		local->u[i] /= reach;
		local->v[i] /= reach;
		local->y[i] /= local->radius;
	}
	return count;
}

static struct gnp_regression regression_of(struct local *local, size_t count)
{
	struct gnp_regression regression = {.rows = local->rows, .gram = local->gram, .moment = local->moment};
	gnp_regression_fill(&regression, local->u, local->v, local->y, local->ones, count);
	return regression;
}

/* Climbs the evidence over (rho, tau) from *prior by factors; returns the best, or minus infinity when nothing fits. */
static double climb(const struct gnp_regression *regression, struct gnp_prior *prior, struct gnp_posterior *posterior, int most)
{
	static const double step_rho = 1.6, step_tau = 3;
	const double moves[4][2] = {{step_rho, 1}, {1 / step_rho, 1}, {1, step_tau}, {1, 1 / step_tau}};
	double best = gnp_regression_condition(regression, *prior, posterior) ? posterior->evidence : -INFINITY;
	int tried = 1, since = 0;
	for (int m = 0; tried < most && since < 4; m = (m + 1) % 4, since++) {
		struct gnp_prior next = {prior->rho * moves[m][0], prior->tau * moves[m][1]};
		if (next.rho < 0.05 || next.rho > 8 || next.tau < 0.1 || next.tau > 1e7)
			continue;
		tried++;
		if (gnp_regression_condition(regression, next, posterior) && posterior->evidence > best) {
			best = posterior->evidence;
			*prior = next;
			since = -1;
			m += 3; /* the same move again */
		}
	}
	return best;
}

static struct gnp_prior coarse(const struct gnp_regression *regression, struct gnp_posterior *posterior)
{
	static const double rhos[] = {0.4, 1, 2.2}, taus[] = {1, 10, 300, 1e4, 1e6};
	struct gnp_prior best = {1, 10};
	double highest = -INFINITY;
	for (int r = 0; r < 3; r++)
		for (int t = 0; t < 5; t++) {
			const struct gnp_prior prior = {rhos[r], taus[t]};
			if (gnp_regression_condition(regression, prior, posterior) && posterior->evidence > highest) {
				highest = posterior->evidence;
				best = prior;
			}
		}
	return best;
}

/* log of the summed posterior variance of the Hessian at the centre. */
static double hessian_log_variance(const struct gnp_posterior *posterior, double radius)
{
	double rows[6 * GNP_TAYLOR_STRIDE], c[36];
	gnp_taylor_jets(GNP_TAYLOR_DEGREE, 0, 0, GNP_TAYLOR_STRIDE, rows);
	gnp_regression_covariance(posterior->factor, rows, c);
	return log(posterior->variance * (c[21] + 2 * c[28] + c[35])) - 2 * log(radius);
}

/* Tries every support, each starting from what the one inside it chose. */
static void judge(const struct state *state, const struct gnp_patch *patch, struct local *local, struct verdict *verdicts)
{
	struct gnp_posterior posterior = {.factor = local->factor, .mean = local->mean};
	struct gnp_regression sums = {.rows = local->rows, .gram = local->sums, .moment = local->sums_moment};
	struct gnp_regression inner = {.gram = local->gram, .moment = local->moment};
	struct gnp_prior prior = {1, 10};
	double share = 0, last_share = 0;
	collect_usable(state, patch, supports[LEVELS - 1], local);
	size_t count = fill_local(patch, supports[LEVELS - 1], local);
	gnp_regression_clear(&sums);
	for (int level = 0; level < LEVELS; level++) {
		verdicts[level] = (struct verdict){INFINITY, 0, 0};
		size_t from = sums.count, to = supports[level] < count ? supports[level] : count;
		if (from == to)
			continue;
		for (size_t i = from; i < to; i++)
			share = fmax(share, hypot(local->u[i], local->v[i]));
		gnp_regression_add(&sums, local->u + from, local->v + from, local->y + from, local->ones, to - from);
		gnp_regression_rescale(&sums, share, &inner);
		if (level == 0)
			prior = coarse(&inner, &posterior);
		else
			prior.rho = fmin(prior.rho * share / last_share, 8);
		last_share = share;
		if (!isfinite(climb(&inner, &prior, &posterior, CLIMB)) || !gnp_regression_condition(&inner, prior, &posterior))
			continue;
		double radius = share * local->radius, variance = hessian_log_variance(&posterior, radius);
		verdicts[level] = (struct verdict){(float)variance, (float)log(radius / prior.rho), (float)log(prior.tau)};
	}
}

struct work {
	const struct gnp_fit_cloud *cloud;
	struct state *state;
	struct verdict *verdicts; /* (representatives, LEVELS) */
	uint32_t *voters;         /* (representatives, VOTERS), itself first; ends early with itself again */
};

static void find_voters(const struct state *state, const struct gnp_patch *patch, uint32_t self, uint32_t *voters)
{
	size_t found = 1;
	voters[0] = self;
	for (size_t i = 0; i < patch->buffer_count && i < NEAR && found < VOTERS; i++) {
		uint32_t other = state->representative[patch->index[i]];
		bool known = false;
		for (size_t j = 0; j < found && !known; j++)
			known = voters[j] == other;
		if (!known)
			voters[found++] = other;
	}
	for (; found < VOTERS; found++)
		voters[found] = self;
}

static gnp_status judge_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	struct work *work = context;
	const struct gnp_fit_cloud *cloud = work->cloud;
	size_t reach = POINTS_MAX < cloud->count ? POINTS_MAX : cloud->count;
	const struct gnp_patch_source source = {cloud->points, cloud->normals, FRAMED < reach ? FRAMED : reach, 1e-9};
	struct gnp_neighborhoods found;
	gnp_status status = gnp_neighborhoods_find(cloud->neighbors, work->state->cover.centre + begin, end - begin, reach, 1,
	                                           reach, scratch, &found, error);
	if (status != GNP_OK)
		return status;
	struct local *local = gnp_scratch_take(scratch, 1, sizeof *local);
	double *u = gnp_scratch_take(scratch, 3 * reach, sizeof *u);
	if (!local || !u)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "adaptive: no memory for a patch of %zu points", reach);
	for (size_t r = begin; r < end; r++) {
		struct gnp_patch patch;
		status = gnp_patch_build(&source, &found, r - begin, work->state->cover.centre[r], u, u + reach, u + 2 * reach, &patch,
		                         error);
		if (status != GNP_OK)
			return status;
		judge(work->state, &patch, local, work->verdicts + r * LEVELS);
		find_voters(work->state, &patch, (uint32_t)r, work->voters + r * VOTERS);
	}
	return GNP_OK;
}

/* The support of smallest mean log variance among the voters that could judge it, and their mean prior there. */
static void choose(const struct work *work, size_t r, struct choice *choice)
{
	const uint32_t *voters = work->voters + r * VOTERS;
	double lowest = INFINITY;
	for (int level = 0; level < LEVELS; level++) {
		double variance = 0, length = 0, tau = 0;
		int votes = 0;
		for (int i = 0; i < VOTERS && (i == 0 || voters[i] != voters[0]); i++) {
			const struct verdict *verdict = &work->verdicts[(size_t)voters[i] * LEVELS + level];
			if (!isfinite(verdict->log_variance))
				continue;
			variance += verdict->log_variance;
			length += verdict->log_length;
			tau += verdict->log_tau;
			votes++;
		}
		if (votes && variance / votes < lowest) {
			lowest = variance / votes;
			*choice = (struct choice){(uint32_t)supports[level], (float)exp(length / votes), (float)exp(tau / votes)};
		}
	}
}

static gnp_status choose_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	struct work *work = context;
	(void)scratch;
	(void)error;
	for (size_t r = begin; r < end; r++) {
		work->state->choice[r] = (struct choice){(uint32_t)supports[0], 1, 1};
		choose(work, r, &work->state->choice[r]);
	}
	return GNP_OK;
}

static gnp_status choose_supports(struct state *state, const struct gnp_fit_cloud *cloud, struct gnp_pool *pool,
                                  struct gnp_task *task, struct gnp_error *error)
{
	struct work work = {.cloud = cloud, .state = state};
	size_t count = state->cover.count;
	work.verdicts = gnp_array_new(count, LEVELS * sizeof *work.verdicts);
	work.voters = gnp_array_new(count, VOTERS * sizeof *work.voters);
	gnp_status status = GNP_OK;
	if (!work.verdicts || !work.voters)
		status = gnp_error_set(error, GNP_OUT_OF_MEMORY, "adaptive: no memory for %zu representatives", count);
	if (status == GNP_OK)
		status = gnp_pool_run(pool, task, count, REPRESENTATIVES_A_CHUNK, judge_chunk, &work, error);
	if (status == GNP_OK)
		status = gnp_pool_run(pool, task, count, 1024, choose_chunk, &work, error);
	free(work.verdicts);
	free(work.voters);
	return status;
}

void gnp_adaptive_release(void *pointer)
{
	struct state *state = pointer;
	if (!state)
		return;
	free(state->outlier);
	free(state->representative);
	free(state->choice);
	gnp_cover_clear(&state->cover);
	free(state);
}

static gnp_status prepare_state(struct state *state, const struct gnp_fit_cloud *cloud, struct gnp_pool *pool,
                                struct gnp_task *task, struct gnp_error *error)
{
	state->count = cloud->count;
	state->normals = cloud->normals;
	state->outlier = gnp_array_new(cloud->count, 1);
	state->representative = gnp_array_new(cloud->count, sizeof *state->representative);
	if (!state->outlier || !state->representative)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "adaptive: no memory for %zu points", cloud->count);
	gnp_status status = gnp_outliers_find(cloud->points, cloud->normals, cloud->count, cloud->neighbors, pool, task,
	                                      state->outlier, error);
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
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "adaptive: no memory for %zu representatives", state->cover.count);
	return choose_supports(state, cloud, pool, task, error);
}

gnp_status gnp_adaptive_prepare(const struct gnp_fit_cloud *cloud, struct gnp_pool *pool, struct gnp_task *task,
                                void **out, struct gnp_error *error)
{
	struct state *state = gnp_array_zero(1, sizeof *state);
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
	const struct state *state = pointer;
	size_t wanted = state->choice[state->representative[point]].points;
	return wanted + wanted / 8 + 16; /* room for those that are not usable */
}

size_t gnp_adaptive_served(const void *pointer, uint32_t point)
{
	const struct state *state = pointer;
	size_t served = state->choice[state->representative[point]].points / POINTS_A_SERVED;
	return served < 1 ? 1 : served;
}

const unsigned char *gnp_adaptive_outliers(const void *pointer)
{
	return ((const struct state *)pointer)->outlier;
}

/* Drops the points that misfit the surface by more than 4.5 sigma; how many are left. */
static size_t drop_misfits(struct local *local, size_t count, const struct gnp_posterior *posterior)
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

static void fit_patch(const struct state *state, const struct gnp_patch *patch, struct local *local, double *coefficients,
                      double *factor, struct gnp_fit *fit)
{
	enum { REFITS = 3 };
	const struct choice *choice = &state->choice[state->representative[patch->centre]];
	struct gnp_posterior posterior = {.factor = factor, .mean = coefficients};
	collect_usable(state, patch, choice->points, local);
	size_t count = fill_local(patch, choice->points, local), kept = count;
	struct gnp_prior prior = {fmin(local->radius / choice->length, 8), choice->tau};
	bool solved = false;
	for (int refit = 0; refit < REFITS; refit++) {
		struct gnp_regression regression = regression_of(local, count);
		solved = gnp_regression_condition(&regression, prior, &posterior);
		if (!solved)
			break;
		gnp_regression_mean(&posterior);
		kept = drop_misfits(local, count, &posterior);
		if (kept == count || kept < GNP_TAYLOR_SIZE / 2)
			break;
		count = kept;
	}
	*fit = (struct gnp_fit){.reduced = !solved, .residual = solved ? sqrt(posterior.variance) * local->radius : 0};
	fit->surface = (struct gnp_surface){.basis = {GNP_BASIS_TAYLOR, GNP_TAYLOR_DEGREE}, .coefficients = coefficients,
	                                    .scale_xy = local->radius, .scale_w = local->radius, .factor = factor,
	                                    .variance = posterior.variance};
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
}

gnp_status gnp_adaptive_fit(const struct gnp_fit_options *options, const void *pointer, const struct gnp_patch *patches,
                            size_t count, struct gnp_fit *fits, struct gnp_scratch *scratch, struct gnp_error *error)
{
	const struct state *state = pointer;
	(void)options;
	double *coefficients = gnp_scratch_take(scratch, count * GNP_TAYLOR_STRIDE, sizeof *coefficients);
	double *factors = gnp_scratch_take(scratch, count * GNP_TAYLOR_SIZE * GNP_TAYLOR_STRIDE, sizeof *factors);
	struct local *local = gnp_scratch_take(scratch, 1, sizeof *local);
	if (!coefficients || !factors || !local)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "adaptive: no memory for %zu patches", count);
	for (size_t i = 0; i < count; i++)
		fit_patch(state, &patches[i], local, coefficients + i * GNP_TAYLOR_STRIDE,
		          factors + i * GNP_TAYLOR_SIZE * GNP_TAYLOR_STRIDE, &fits[i]);
	return GNP_OK;
}
