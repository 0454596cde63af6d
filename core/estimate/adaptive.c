#include "core/estimate/adaptive.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/cloud/cover.h"
#include "core/estimate/outliers.h"
#include "core/estimate/sheets.h"
#include "core/fit/regression.h"

enum {
	SERVED = 64,        /* points a representative stands for */
	FRAMED = 50,        /* nearest points that set its frame */
	LEVELS = 6,         /* supports tried */
	POINTS_MAX = 760,   /* of the largest, with room */
	NEAR = 100,         /* nearest points whose representatives vote together */
	VOTERS = 12,
	RHOS = 3, TAUS = 7, PRIORS = RHOS * TAUS, /* priors tried a support */
	REPRESENTATIVES_A_CHUNK = 24,
	POINTS_A_SERVED = 60 /* of a support, for each point its patch may serve: those within a tenth or so of its reach */
};
static const size_t supports[LEVELS] = {32, 48, 90, 180, 360, 720};

/* What one prior makes of one support at a representative. */
struct verdict {
	float evidence;     /* minus infinity where nothing fits */
	float log_variance; /* of the Hessian's posterior [1/length^2] */
	float log_noise;    /* of the noise's standard deviation [length] */
};

/* A representative's view of a support. */
struct view {
	float log_radius;
	struct verdict verdicts[PRIORS];
};

/* A representative's choice. */
struct choice {
	uint32_t points;
	float length, tau;
	float doubt; /* factor of the posterior's variances for what the support leaves unexplained */
};

struct state {
	size_t count;
	double *normals;                /* (count, 3) of the sheet each point belongs to */
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

static void collect_usable(const struct state *state, const struct gnp_patch *patch, size_t most, struct local *local)
{
	local->usable_count = gnp_sheets_usable(state->normals, state->outlier, patch, most, local->usable);
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

/* The grid of priors: how fast orders fall off, and the size of third-order terms against the noise, from none to free. */
static struct gnp_prior prior_at(int index)
{
	static const double rhos[RHOS] = {0.7, 1.3, 2.2}, thirds[TAUS] = {0.15, 0.5, 1.5, 5, 20, 200, 1e4};
	double rho = rhos[index / TAUS];
	return (struct gnp_prior){rho, thirds[index % TAUS] / (rho * rho * rho)};
}

/* log of the summed posterior variance of the Hessian at the centre, where its entries are coefficients. */
static double hessian_log_variance(const struct gnp_posterior *posterior, double radius)
{
	double uu = gnp_regression_variance(posterior->factor, 3), uv = gnp_regression_variance(posterior->factor, 4);
	double vv = gnp_regression_variance(posterior->factor, 5);
	return log(posterior->variance * (4 * uu + 2 * uv + 4 * vv)) - 2 * log(radius);
}

static struct verdict judge_prior(const struct gnp_regression *regression, int index, double radius,
                                  struct gnp_posterior *posterior)
{
	if (!gnp_regression_condition(regression, prior_at(index), posterior))
		return (struct verdict){-INFINITY, INFINITY, 0};
	return (struct verdict){(float)posterior->evidence, (float)hessian_log_variance(posterior, radius),
	                        (float)(0.5 * log(posterior->variance) + log(radius))};
}

/* Tries every prior on every support; the sums of a support go on into the next wider one. */
static void judge(const struct state *state, const struct gnp_patch *patch, struct local *local, struct view *views)
{
	struct gnp_posterior posterior = {.factor = local->factor, .mean = local->mean};
	struct gnp_regression sums = {.rows = local->rows, .gram = local->sums, .moment = local->sums_moment};
	struct gnp_regression inner = {.gram = local->gram, .moment = local->moment};
	double share = 0;
	collect_usable(state, patch, supports[LEVELS - 1], local);
	size_t count = fill_local(patch, supports[LEVELS - 1], local);
	gnp_regression_clear(&sums);
	for (int level = 0; level < LEVELS; level++) {
		size_t from = sums.count, to = supports[level] < count ? supports[level] : count;
		for (size_t i = from; i < to; i++)
			share = fmax(share, hypot(local->u[i], local->v[i]));
		if (from < to)
			gnp_regression_add(&sums, local->u + from, local->v + from, local->y + from, local->ones, to - from);
		gnp_regression_rescale(&sums, share, &inner);
		double radius = share * local->radius;
		views[level].log_radius = (float)log(radius);
		for (int i = 0; i < PRIORS; i++)
			views[level].verdicts[i] = from < to ? judge_prior(&inner, i, radius, &posterior)
			                                     : (struct verdict){-INFINITY, INFINITY, 0};
	}
}

struct work {
	const struct gnp_fit_cloud *cloud;
	struct state *state;
	struct view *views;       /* (representatives, LEVELS) */
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
	const struct gnp_patch_source source = {.points = cloud->points, .normals = work->state->normals,
	                                        .k = FRAMED < reach ? FRAMED : reach, .delta0_ratio = 1e-9, .one_sheet = true};
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
		judge(work->state, &patch, local, work->views + r * LEVELS);
		find_voters(work->state, &patch, (uint32_t)r, work->voters + r * VOTERS);
	}
	return GNP_OK;
}

/* The voters' agreement on a support: the prior of highest joint evidence, and their means under it. */
struct poll {
	int prior; /* -1 when no prior fits at all of them */
	double log_variance, log_noise, log_radius;
};

static struct poll poll(const struct work *work, const uint32_t *voters, int level)
{
	struct poll best = {.prior = -1};
	double highest = -INFINITY;
	for (int p = 0; p < PRIORS; p++) {
		double evidence = 0;
		struct poll mean = {.prior = p};
		int votes = 0;
		for (; votes < VOTERS && (votes == 0 || voters[votes] != voters[0]); votes++) {
			const struct view *view = &work->views[(size_t)voters[votes] * LEVELS + level];
			evidence += view->verdicts[p].evidence;
			mean.log_variance += view->verdicts[p].log_variance;
			mean.log_noise += view->verdicts[p].log_noise;
			mean.log_radius += view->log_radius;
		}
		if (!(evidence > highest))
			continue;
		highest = evidence;
		best = (struct poll){p, mean.log_variance / votes, mean.log_noise / votes, mean.log_radius / votes};
	}
	return best;
}

/* The support of smallest Hessian variance. A support too wide for the basis shows by more apparent noise than a narrower
 * one; that excess is smooth, so a share of it bends the fit coherently: variance times 1 + share * points * excess. */
static void choose(const struct work *work, size_t r, struct choice *choice)
{
	static const double coherent_share = 0.02;
	struct poll polls[LEVELS];
	double quietest = INFINITY, lowest = INFINITY;
	for (int level = 0; level < LEVELS; level++) {
		polls[level] = poll(work, work->voters + r * VOTERS, level);
		if (polls[level].prior >= 0)
			quietest = fmin(quietest, polls[level].log_noise);
	}
	for (int level = 0; level < LEVELS; level++) {
		const struct poll *p = &polls[level];
		if (p->prior < 0)
			continue;
		double doubt = 1 + coherent_share * (double)supports[level] * (exp(2 * (p->log_noise - quietest)) - 1);
		if (p->log_variance + log(doubt) >= lowest)
			continue;
		struct gnp_prior prior = prior_at(p->prior);
		lowest = p->log_variance + log(doubt);
		*choice = (struct choice){(uint32_t)supports[level], (float)(exp(p->log_radius) / prior.rho), (float)prior.tau,
		                          (float)doubt};
	}
}

static gnp_status choose_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	struct work *work = context;
	(void)scratch;
	(void)error;
	for (size_t r = begin; r < end; r++) {
		work->state->choice[r] = (struct choice){(uint32_t)supports[0], 1, 1, 1};
		choose(work, r, &work->state->choice[r]);
	}
	return GNP_OK;
}

static gnp_status choose_supports(struct state *state, const struct gnp_fit_cloud *cloud, struct gnp_pool *pool,
                                  struct gnp_task *task, struct gnp_error *error)
{
	struct work work = {.cloud = cloud, .state = state};
	size_t count = state->cover.count;
	work.views = gnp_array_new(count, LEVELS * sizeof *work.views);
	work.voters = gnp_array_new(count, VOTERS * sizeof *work.voters);
	gnp_status status = GNP_OK;
	if (!work.views || !work.voters)
		status = gnp_error_set(error, GNP_OUT_OF_MEMORY, "adaptive: no memory for %zu representatives", count);
	if (status == GNP_OK)
		status = gnp_pool_run(pool, task, count, REPRESENTATIVES_A_CHUNK, judge_chunk, &work, error);
	if (status == GNP_OK)
		status = gnp_pool_run(pool, task, count, 1024, choose_chunk, &work, error);
	free(work.views);
	free(work.voters);
	return status;
}

void gnp_adaptive_release(void *pointer)
{
	struct state *state = pointer;
	if (!state)
		return;
	free(state->normals);
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
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "adaptive: no memory for %zu representatives", state->cover.count);
	return choose_supports(state, cloud, pool, task, error);
}

gnp_status gnp_adaptive_prepare(const struct gnp_fit_cloud *cloud, const struct gnp_fit_options *options,
                                struct gnp_pool *pool, struct gnp_task *task, void **out, struct gnp_error *error)
{
	(void)options;
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

const double *gnp_adaptive_normals(const void *pointer)
{
	return ((const struct state *)pointer)->normals;
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
	                                    .variance = posterior.variance, .doubt = choice->doubt};
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
