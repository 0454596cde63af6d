#include "core/estimators/adaptive_support.h"

#include <math.h>
#include <stdlib.h>

#include "core/base/memory.h"
#include "core/estimators/sheets.h"

enum {
	FRAMED = 50,        /* nearest points that set its frame */
	LEVELS = 6,         /* supports tried */
	NEAR = 100,         /* nearest points whose representatives vote together */
	VOTERS = 12,
	RHOS = 3, TAUS = 7, PRIORS = RHOS * TAUS, /* priors tried a support */
	REPRESENTATIVES_A_CHUNK = 24
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

void gnp_adaptive_local_collect(const struct gnp_adaptive_state *state, const struct gnp_patch *patch, size_t most,
                                struct gnp_adaptive_local *local)
{
	local->usable_count = gnp_sheets_usable(state->normals, state->outlier, patch, most, local->usable);
}

size_t gnp_adaptive_local_fill(const struct gnp_patch *patch, size_t count, struct gnp_adaptive_local *local)
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

struct gnp_regression gnp_adaptive_local_regression(struct gnp_adaptive_local *local, size_t count)
{
	struct gnp_regression regression = {.rows = local->rows, .gram = local->gram, .moment = local->moment};
	gnp_regression_fill(&regression, local->u, local->v, local->y, local->ones, count);
	return regression;
}

/* The grid of priors: how fast orders fall off, and the size of third-order terms against the noise, from none to
 * free. */
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
static void judge(const struct gnp_adaptive_state *state, const struct gnp_patch *patch,
                  struct gnp_adaptive_local *local, struct view *views)
{
	struct gnp_posterior posterior = {.factor = local->factor, .mean = local->mean};
	struct gnp_regression sums = {.rows = local->rows, .gram = local->sums, .moment = local->sums_moment};
	struct gnp_regression inner = {.gram = local->gram, .moment = local->moment};
	double share = 0;
	gnp_adaptive_local_collect(state, patch, supports[LEVELS - 1], local);
	size_t count = gnp_adaptive_local_fill(patch, supports[LEVELS - 1], local);
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
	struct gnp_adaptive_state *state;
	struct view *views;       /* (representatives, LEVELS) */
	uint32_t *voters;         /* (representatives, VOTERS), itself first; ends early with itself again */
};

static void find_voters(const struct gnp_adaptive_state *state, const struct gnp_patch *patch, uint32_t self,
                        uint32_t *voters)
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

static gnp_status judge_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                              struct gnp_error *error)
{
	struct work *work = context;
	const struct gnp_fit_cloud *cloud = work->cloud;
	size_t reach = GNP_ADAPTIVE_POINTS_MAX < cloud->count ? GNP_ADAPTIVE_POINTS_MAX : cloud->count;
	const struct gnp_patch_source source = {.points = cloud->points, .normals = work->state->normals,
	                                        .k = FRAMED < reach ? FRAMED : reach, .delta0_ratio = 1e-9, .one_sheet = true};
	struct gnp_neighborhoods found;
	gnp_status status = gnp_neighborhoods_find(cloud->neighbors, work->state->cover.centre + begin, end - begin, reach, 1,
	                                           reach, scratch, &found, error);
	if (status != GNP_OK)
		return status;
	struct gnp_adaptive_local *local = gnp_scratch_take(scratch, 1, sizeof *local);
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

/* The support of smallest Hessian variance. A support too wide for the basis shows by more apparent noise than a
 * narrower one; that excess is smooth, so a share of it bends the fit coherently: variance times 1 + share * points *
 * excess. */
static void choose(const struct work *work, size_t r, struct gnp_adaptive_support *choice)
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
		*choice = (struct gnp_adaptive_support){(uint32_t)supports[level], (float)(exp(p->log_radius) / prior.rho), (float)prior.tau,
		                          (float)doubt};
	}
}

static gnp_status choose_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                               struct gnp_error *error)
{
	struct work *work = context;
	(void)scratch;
	(void)error;
	for (size_t r = begin; r < end; r++) {
		work->state->choice[r] = (struct gnp_adaptive_support){(uint32_t)supports[0], 1, 1, 1};
		choose(work, r, &work->state->choice[r]);
	}
	return GNP_OK;
}

gnp_status gnp_adaptive_support_choose(struct gnp_adaptive_state *state, const struct gnp_fit_cloud *cloud,
                                       struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error)
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
