#include "core/estimate/estimate.h"

#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/cells/disk.h"
#include "core/cloud/belief_sample.h"
#include "core/estimate/belief_answer.h"
#include "core/estimate/estimate_boundary.h"
#include "core/estimate/estimate_patches.h"
#include "core/estimate/estimate_supports.h"
#include "core/estimators/weighted_fit.h"
#include "core/model/model.h"
#include "core/support/votes.h"

/* Patches a chunk: a multiple of the batches of the projection head, and few enough that small requests do not wait
 * long for it. */
enum { PATCHES_A_CHUNK = 48 };

/* The points to estimate at, as the caller counts them; at is NULL for all of them. */
struct choice {
	const uint32_t *at; /* (count) */
	size_t count;
	bool again; /* the cloud is what is left of another */
};

/* Patch p is that of the point at[p], and serves it. */
static gnp_status cover_chosen(const struct gnp_prepared *prepared, const struct choice *choice,
                               struct gnp_cover *cover, struct gnp_error *error)
{
	size_t count = choice->count;
	uint32_t *position = gnp_array_new(prepared->count, sizeof *position); /* inverse of the order */
	cover->count = count;
	cover->centre = gnp_array_new(count, sizeof *cover->centre);
	cover->start = gnp_array_new(count + 1, sizeof *cover->start);
	cover->member = gnp_array_new(count, sizeof *cover->member);
	bool room = position && cover->centre && cover->start && cover->member;
	for (size_t i = 0; room && i < prepared->count; i++)
		position[prepared->order[i]] = (uint32_t)i;
	for (size_t p = 0; room && p < count; p++)
		cover->centre[p] = cover->member[p] = position[choice->at[p]];
	for (size_t p = 0; room && p <= count; p++)
		cover->start[p] = p;
	free(position);
	return room ? GNP_OK : gnp_error_set(error, GNP_OUT_OF_MEMORY, "estimate: no memory for %zu chosen points", count);
}

static gnp_status allocate_values(struct gnp_estimate *estimate, uint64_t quantities, struct gnp_error *error)
{
	for (int q = 0; q < GNP_QUANTITY_COUNT; q++) {
		if (!(quantities & GNP_QUANTITY_BIT(q)))
			continue;
		size_t width = gnp_estimate_width((enum gnp_quantity)q, estimate->basis_size), items;
		bool fits = gnp_size_multiply(estimate->count, width, &items);
		estimate->values[q] = fits ? gnp_array_new(items, sizeof(double)) : NULL;
		if (!estimate->values[q])
			return gnp_error_set(error, GNP_OUT_OF_MEMORY, "estimate: no memory for %zu values of %s", estimate->count,
			                     gnp_quantity_info((enum gnp_quantity)q)->name);
	}
	return GNP_OK;
}

static gnp_status allocate_probes(struct gnp_estimate_work *work, struct gnp_error *error)
{
	work->stride = gnp_belief_sample_stride(work->prepared->count);
	work->probes = gnp_array_zero(work->prepared->count / work->stride + 1, sizeof *work->probes);
	return work->probes ? GNP_OK : gnp_error_set(error, GNP_OUT_OF_MEMORY, "estimate: no memory for probes");
}

/* Both searches and fits run in one loop: its wall time is split as the workers spent theirs. */
static void book_search(struct gnp_estimate_work *work, struct gnp_task *task)
{
	double search = (double)work->search_ns, total = search + (double)work->fit_ns;
	if (task && total > 0)
		gnp_task_rebook(task, GNP_STAGE_ESTIMATE, GNP_STAGE_NEIGHBORS,
		                task->seconds[GNP_STAGE_ESTIMATE] * search / total);
}

/* Some estimators look for outliers in some clouds only. As with quantities that an estimator never has: "all" goes
 * without. */
static gnp_status check_judged(struct gnp_estimate_work *work, const struct gnp_estimate_options *options,
                               struct gnp_error *error)
{
	if (work->outlier || work->weighted || !(work->quantities & GNP_QUANTITY_BIT(GNP_OUTLIER)))
		return GNP_OK;
	if (options->quantities != GNP_QUANTITY_ALL && options->quantities & GNP_QUANTITY_BIT(GNP_OUTLIER))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "quantities: got outlier, which the estimator %s does not judge with weights %s (it does with "
		                     "outliers=left_out)",
		                     work->estimator->name, work->fit.model ? work->fit.model->name : "auto");
	work->quantities &= ~GNP_QUANTITY_BIT(GNP_OUTLIER);
	return GNP_OK;
}

static gnp_status prepare_estimator(struct gnp_estimate_work *work, const struct gnp_estimate_options *options,
                                    struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error)
{
	const struct gnp_prepared *prepared = work->prepared;
	const struct gnp_fit_cloud cloud = {prepared->count, prepared->points, prepared->normals, prepared->components == 0,
	                                    prepared->neighbors};
	gnp_status status = GNP_OK;
	if (work->estimator->prepare)
		status = work->estimator->prepare(&cloud, &work->fit, pool, task, &work->state, error);
	if (status == GNP_OK && work->estimator->outliers)
		work->outlier = work->estimator->outliers(work->state);
	if (status == GNP_OK && work->estimator->normals)
		work->sheets = work->estimator->normals(work->state);
	if (status == GNP_OK && work->estimator->weighted)
		work->weighted = work->estimator->weighted(work->state);
	if (status == GNP_OK && work->estimator->rule)
		work->estimator->rule(work->state, &work->rule);
	if (status == GNP_OK && prepared->count < work->rule.k)
		status = gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                       "points: got %zu, need at least %zu, the neighbours of a patch",
		                       prepared->count, work->rule.k);
	work->fit.basis = work->rule.basis;
	return status == GNP_OK ? check_judged(work, options, error) : status;
}

/* Which patches there are, and what each serves. */
static gnp_status make_cover(struct gnp_estimate_work *work, const struct gnp_estimate_options *options,
                             const struct choice *choice, struct gnp_pool *pool, struct gnp_task *task,
                             struct gnp_error *error)
{
	const struct gnp_prepared *prepared = work->prepared;
	if (choice->at)
		return cover_chosen(prepared, choice, &work->cover, error);
	if (work->weighted)
		return GNP_OK; /* it follows from the fits */
	struct gnp_cover_rule rule = {.fixed = work->rule.served, .normals = work->sheets};
	if (options->cover == GNP_COVER_ALL) {
		if (!work->estimator->served)
			return gnp_cover_all(prepared->count, &work->cover, error);
		rule = (struct gnp_cover_rule){.fixed = GNP_SERVED_MAX < prepared->count ? GNP_SERVED_MAX : prepared->count,
		                               .served = work->estimator->served, .context = work->state,
		                               .normals = work->sheets};
	}
	return gnp_cover_greedy(prepared->neighbors, prepared->points, prepared->count, &rule, pool, task, &work->cover,
	                        error);
}

static gnp_status run(struct gnp_estimate_work *work, struct gnp_pool *pool, struct gnp_task *task,
                      struct gnp_error *error)
{
	size_t count = work->weighted && !work->chosen ? work->prepared->count : work->cover.count;
	gnp_task_stage(task, GNP_STAGE_ESTIMATE, count);
	if (!work->weighted)
		return gnp_pool_run(pool, task, count, PATCHES_A_CHUNK, gnp_estimate_patches, work, error);
	return gnp_pool_run(pool, task, count, work->chosen ? PATCHES_A_CHUNK : GNP_ESTIMATE_BLOCK, gnp_estimate_supports,
	                    work, error);
}

static void work_clear(struct gnp_estimate_work *work)
{
	if (work->state)
		work->estimator->release(work->state);
	gnp_cover_clear(&work->cover);
	free(work->probes);
}

static size_t count_outliers(const struct gnp_estimate_work *work)
{
	size_t count = 0;
	for (size_t i = 0; work->outlier && i < work->prepared->count; i++)
		count += work->outlier[i];
	return count;
}

/* Pieces have voted on all points; where points were chosen, who is an outlier was the network's to say. */
static void count_votes(struct gnp_estimate_work *work)
{
	const struct gnp_votes *votes = work->weighted->votes;
	double *column = work->out->values[GNP_OUTLIER];
	for (size_t i = 0; i < work->prepared->count; i++) {
		bool outlier = gnp_votes_outlier(votes, i);
		work->outliers += outlier;
		if (column)
			column[work->prepared->order[i]] = outlier;
		if (work->probes && i == gnp_belief_sample_point(work->stride, work->prepared->count, i / work->stride))
			work->probes[i / work->stride].outlier = outlier;
	}
}

/* Standard errors of a posterior under noise; a weighted model's are calibrated, bias and all. */
static bool holds_scatter_alone(const struct gnp_estimate_work *work)
{
	return !work->weighted && (work->quantities & GNP_QUANTITY_STDERR) != 0;
}

/* ---- Without outliers ---- */

/* What is left of a cloud. */
struct kept {
	size_t count;
	uint32_t *row; /* (count) the caller's */
	double *points, *normals; /* normals: NULL where none were given */
};

static void kept_clear(struct kept *kept)
{
	free(kept->row);
	free(kept->points);
	free(kept->normals);
}

static gnp_status keep(const struct gnp_estimate_work *work, struct kept *kept, struct gnp_error *error)
{
	const struct gnp_prepared *prepared = work->prepared;
	size_t most = prepared->count - work->outliers;
	bool given = prepared->components == 0;
	*kept = (struct kept){.row = gnp_array_new(most, sizeof *kept->row),
	                      .points = gnp_array_new(most, 3 * sizeof *kept->points),
	                      .normals = given ? gnp_array_new(most, 3 * sizeof *kept->normals) : NULL};
	if (!kept->row || !kept->points || (given && !kept->normals))
		return gnp_no_memory("estimate", most, "points without outliers", error);
	for (size_t i = 0; i < prepared->count; i++) {
		if (gnp_votes_outlier(work->weighted->votes, i))
			continue;
		memcpy(kept->points + 3 * kept->count, prepared->points + 3 * i, 3 * sizeof *kept->points);
		if (given)
			memcpy(kept->normals + 3 * kept->count, prepared->normals + 3 * i, 3 * sizeof *kept->normals);
		kept->row[kept->count++] = prepared->order[i];
	}
	return GNP_OK;
}

static gnp_status estimate_choice(const struct gnp_prepared *prepared, const struct gnp_estimate_options *options,
                                  const struct choice *choice, struct gnp_pool *pool, struct gnp_task *task,
                                  struct gnp_estimate *estimate, struct gnp_error *error);

/* Where outliers are many, fits do better without them: the rest is estimated again as a cloud of its own. */
static bool is_worth_again(const struct gnp_estimate_work *work, const struct choice *choice,
                           const struct gnp_estimate_options *options)
{
	enum { FEW = 32 }; /* one in so many: what noise alone has in its tails is less */
	return work->weighted && !choice->at && !choice->again && work->outliers * FEW > work->prepared->count &&
	       work->prepared->count - work->outliers > 4 * (size_t)options->k;
}

/* Rows of the kept points are written over. */
static gnp_status estimate_again(const struct gnp_estimate_work *work, const struct gnp_estimate_options *options,
                                 struct gnp_pool *pool, struct gnp_task *task, struct gnp_estimate *estimate,
                                 struct gnp_error *error)
{
	struct kept kept;
	struct gnp_prepared prepared = {.count = 0};
	size_t patches = estimate->patches, outliers = estimate->outliers;
	gnp_status status = keep(work, &kept, error);
	if (status == GNP_OK) {
		const struct gnp_cloud cloud = {kept.count, kept.points, kept.normals};
		status = gnp_prepare(&cloud, pool, task, &prepared, error);
	}
	for (size_t i = 0; i < prepared.count; i++)
		prepared.order[i] = kept.row[prepared.order[i]];
	kept_clear(&kept);
	if (status == GNP_OK)
		status = estimate_choice(&prepared, options, &(struct choice){.again = true}, pool, task, estimate, error);
	estimate->patches += patches;
	estimate->outliers += outliers;
	gnp_prepared_clear(&prepared);
	return status;
}

/* ---- All of it ---- */

static gnp_status estimate_choice(const struct gnp_prepared *prepared, const struct gnp_estimate_options *options,
                                  const struct choice *choice, struct gnp_pool *pool, struct gnp_task *task,
                                  struct gnp_estimate *estimate, struct gnp_error *error)
{
	const struct gnp_estimator *estimator = gnp_estimate_estimator(options);
	struct gnp_estimate_work work = {.prepared = prepared, .chosen = choice->at, .estimator = estimator,
	                    .own = options->cover == GNP_COVER_ALL,
	                    .fit = {.basis = gnp_estimate_basis(options), .weight = (enum gnp_weight_kind)options->weight,
	                            .outliers = (enum gnp_outliers_kind)options->outliers,
	                            .model = options->model, .models = options->models},
	                    .quantities = gnp_estimate_quantities(options),
	                    .rule = {.k = (size_t)options->k, .served = (size_t)options->k / 3, .buffer = 1, .delta0_ratio = 0.1,
	                             .basis = gnp_estimate_basis(options)},
	                    .out = estimate};
	gnp_task_stage(task, GNP_STAGE_PREPARE, 0);
	gnp_status status = prepare_estimator(&work, options, pool, task, error);
	gnp_task_stage(task, GNP_STAGE_NEIGHBORS, prepared->count);
	if (status == GNP_OK)
		status = make_cover(&work, options, choice, pool, task, error);
	if (!choice->again)
		estimate->count = choice->at ? choice->count : prepared->count;
	estimate->basis_size = gnp_basis_size(work.fit.basis);
	if (status == GNP_OK && !choice->again)
		status = allocate_values(estimate, work.quantities, error);
	if (status == GNP_OK && !choice->at && !options->unjudged && task)
		status = allocate_probes(&work, error);
	if (status == GNP_OK && estimate->values[GNP_BOUNDARY])
		status = gnp_disk_usual(prepared, pool, task, &work.usual_gap, error);
	if (status == GNP_OK)
		status = run(&work, pool, task, error);
	if (status == GNP_OK && work.weighted && !work.chosen)
		count_votes(&work);
	if (status == GNP_OK && estimate->values[GNP_BOUNDARY])
		status = gnp_estimate_boundary(&work, pool, task, error);
	gnp_task_stage(task, GNP_STAGE_DONE, 0);
	book_search(&work, task);
	estimate->components = prepared->components;
	estimate->patches = work.weighted ? work.patches : work.cover.count;
	estimate->degenerate = work.degenerate;
	estimate->outliers = work.weighted ? work.outliers : count_outliers(&work);
	estimate->model = estimator->model && status == GNP_OK ? estimator->model(work.state) : NULL;
	if (status == GNP_OK && is_worth_again(&work, choice, options))
		status = estimate_again(&work, options, pool, task, estimate, error);
	else if (status == GNP_OK && work.probes)
		status = gnp_belief_answer_check(prepared, work.probes, holds_scatter_alone(&work), pool, task, error);
	gnp_task_stage(task, GNP_STAGE_DONE, 0);
	work_clear(&work);
	return status;
}

static gnp_status check_choice(const struct choice *choice, size_t points, struct gnp_error *error)
{
	if (choice->count == 0 || choice->count > UINT32_MAX)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "at: got %zu points, need 1..%u", choice->count, UINT32_MAX);
	for (size_t i = 0; i < choice->count; i++)
		if (choice->at[i] >= points)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT,
			                     "at[%zu]: got point %u, the cloud has %zu", i, choice->at[i],
			                     points);
	return GNP_OK;
}

/* From a cloud that is checked and ready. */
static gnp_status estimate_ready(const struct gnp_prepared *prepared, const struct gnp_estimate_options *options,
                                 const struct choice *choice, struct gnp_pool *pool, struct gnp_task *task,
                                 struct gnp_estimate *out, struct gnp_error *error)
{
	struct gnp_estimate result = {0};
	gnp_status status = estimate_choice(prepared, options, choice, pool, task, &result, error);
	if (status == GNP_OK)
		*out = result;
	else
		gnp_estimate_clear(&result);
	return status;
}

static gnp_status estimate_cloud(const struct gnp_cloud *cloud, const struct gnp_estimate_options *options,
                                 const struct choice *choice, struct gnp_pool *pool, struct gnp_task *task,
                                 struct gnp_estimate *out, struct gnp_error *error)
{
	gnp_status status = gnp_estimate_check(options, error);
	if (status == GNP_OK)
		status = gnp_cloud_check(cloud, (size_t)options->k, error);
	if (status == GNP_OK && choice->at)
		status = check_choice(choice, cloud->count, error);
	if (status != GNP_OK)
		return status;
	struct gnp_prepared prepared;
	status = gnp_prepare(cloud, pool, task, &prepared, error);
	if (status != GNP_OK)
		return status;
	status = estimate_ready(&prepared, options, choice, pool, task, out, error);
	if (status == GNP_OK)
		out->normals_estimated = !cloud->normals;
	gnp_prepared_clear(&prepared);
	return status;
}

gnp_status gnp_estimate_prepared(const struct gnp_prepared *prepared, const struct gnp_estimate_options *options,
                                 struct gnp_pool *pool, struct gnp_task *task, struct gnp_estimate *out,
                                 struct gnp_error *error)
{
	gnp_status status = gnp_estimate_check(options, error);
	if (status == GNP_OK && prepared->count < (size_t)options->k)
		status = gnp_error_set(error, GNP_DEGENERATE,
		                       "points: got %zu, need at least %d, a neighbourhood", prepared->count,
		                       options->k);
	if (status != GNP_OK)
		return status;
	return estimate_ready(prepared, options, &(struct choice){0}, pool, task, out, error);
}

gnp_status gnp_estimate_run(const struct gnp_cloud *cloud, const struct gnp_estimate_options *options,
                            struct gnp_pool *pool, struct gnp_task *task, struct gnp_estimate *out,
                            struct gnp_error *error)
{
	return estimate_cloud(cloud, options, &(struct choice){0}, pool, task, out, error);
}

gnp_status gnp_estimate_at(const struct gnp_cloud *cloud, const struct gnp_estimate_options *options,
                           const uint32_t *at, size_t at_count, struct gnp_pool *pool, struct gnp_task *task,
                           struct gnp_estimate *out, struct gnp_error *error)
{
	assert(at);
	return estimate_cloud(cloud, options, &(struct choice){at, at_count, false}, pool, task, out, error);
}

void gnp_estimate_clear(struct gnp_estimate *estimate)
{
	for (int q = 0; q < GNP_QUANTITY_COUNT; q++)
		free(estimate->values[q]);
	*estimate = (struct gnp_estimate){0};
}

/* An estimator that looks at the whole cloud first keeps normals of sheets, outliers and choices of supports; while it
 * looks, judgements and verdicts of representatives are there too: bytes a point, as measured. A weighted model keeps
 * the cloud's roughness and votes alone, and has no cover; what is left without outliers is kept while it
 * is prepared as a cloud of its own. What does not grow with the cloud is FIXED. */
enum { SURVEYING = 176, SURVEYED = 48, VOTED = 6, KEPT = 28, KEPT_GIVEN = 52, FIXED = 23 << 18 };

static size_t larger(size_t a, size_t b)
{
	return a > b ? a : b;
}

/* With the model that is named, or that for any cloud. */
static bool is_weighted(const struct gnp_estimate_options *options)
{
	return options->estimator == GNP_ESTIMATOR_GNP &&
	       (!options->model || options->model->architecture.head == GNP_HEAD_WEIGHTED);
}

size_t gnp_estimate_memory(size_t count, bool given, const struct gnp_estimate_options *options)
{
	const struct gnp_cover *cover = NULL;
	uint64_t quantities = gnp_estimate_quantities(options);
	bool weighted = is_weighted(options), surveys = !weighted && gnp_estimate_estimator(options)->prepare != NULL;
	size_t width = 0, size = gnp_basis_size(gnp_estimate_basis(options));
	for (int q = 0; q < GNP_QUANTITY_COUNT; q++)
		if (quantities & GNP_QUANTITY_BIT(q))
			width += gnp_estimate_width((enum gnp_quantity)q, size);
	size_t covered = sizeof *cover->centre + sizeof *cover->start + sizeof *cover->member + (surveys ? SURVEYED : 0);
	size_t fitting = width * sizeof(double) + (weighted ? VOTED : covered);
	size_t ready = gnp_prepared_memory(count), most = ready + count * larger(fitting, surveys ? SURVEYING : 0);
	if (weighted) /* beside it what is left without outliers is prepared, and fitted */
		most += larger(count * (given ? KEPT_GIVEN : KEPT) + gnp_prepare_memory(count, given), ready + count * VOTED);
	if (quantities & GNP_QUANTITY_BIT(GNP_BOUNDARY))
		most += gnp_estimate_boundary_memory(count);
	return FIXED + larger(most, gnp_prepare_memory(count, given));
}
