#include "core/estimate/estimate.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/check.h"
#include "core/base/memory.h"
#include "core/cloud/belief.h"
#include "core/cloud/cover.h"
#include "core/cloud/prepare.h"
#include "core/fit/surface.h"
#include "core/network/model.h"

/* Patches a chunk: a multiple of the batches of the projection head, and few enough that small requests do not wait long for it. */
enum { K_MIN = 12, K_MAX = 500, PATCHES_A_CHUNK = 48 };

struct gnp_estimate_options gnp_estimate_defaults(void)
{
	return (struct gnp_estimate_options){
		.estimator = GNP_ESTIMATOR_GMLS, .cover = GNP_COVER_COVER, .k = 30, .degree = 3, .basis = GNP_BASIS_TENSOR,
		.weight = GNP_WEIGHT_QUARTIC,
		.quantities = GNP_QUANTITY_BIT(GNP_NORMALS) | GNP_QUANTITY_BIT(GNP_MEAN_CURVATURE) |
		              GNP_QUANTITY_BIT(GNP_GAUSSIAN_CURVATURE)};
}

static const struct gnp_estimator *estimator_of(const struct gnp_estimate_options *options)
{
	return gnp_estimator_at((enum gnp_estimator_kind)options->estimator);
}

static struct gnp_basis basis_of(const struct gnp_estimate_options *options)
{
	const struct gnp_basis wanted = {(enum gnp_basis_kind)options->basis, (unsigned)options->degree};
	return estimator_of(options)->basis(wanted);
}

static uint64_t offered_quantities(const struct gnp_estimator *estimator)
{
	uint64_t offered = GNP_QUANTITY_ALL;
	if (!estimator->errors)
		offered &= ~GNP_QUANTITY_STDERR;
	if (!estimator->outliers)
		offered &= ~GNP_QUANTITY_BIT(GNP_OUTLIER);
	return offered;
}

/* "All" means all the estimator has; asking for another one by name is a mistake worth a message. */
static gnp_status check_quantities(const struct gnp_estimate_options *options, struct gnp_error *error)
{
	const struct gnp_estimator *estimator = estimator_of(options);
	uint64_t lacking = options->quantities & ~offered_quantities(estimator);
	if (!options->quantities || options->quantities & ~GNP_QUANTITY_ALL)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "quantities: got mask %#llx, need some of %#llx",
		                     (unsigned long long)options->quantities, (unsigned long long)GNP_QUANTITY_ALL);
	if (!lacking || options->quantities == GNP_QUANTITY_ALL)
		return GNP_OK;
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "quantities: the estimator %s has no %s", estimator->name,
	                     gnp_quantity_info((enum gnp_quantity)__builtin_ctzll(lacking))->name);
}

static size_t quantity_width(enum gnp_quantity quantity, size_t basis_size)
{
	size_t width = gnp_quantity_info(quantity)->width;
	return width ? width : basis_size;
}

gnp_status gnp_estimate_check(const struct gnp_estimate_options *options, struct gnp_error *error)
{
	const struct {
		const char *name;
		int value, low, high;
	} rows[] = {{"estimator", options->estimator, 0, GNP_ESTIMATOR_KINDS - 1},
	            {"cover", options->cover, GNP_COVER_COVER, GNP_COVER_ALL},
	            {"k", options->k, K_MIN, K_MAX},
	            {"degree", options->degree, 1, GNP_DEGREE_MAX},
	            {"basis", options->basis, GNP_BASIS_TENSOR, GNP_BASIS_TOTAL},
	            {"weight", options->weight, GNP_WEIGHT_QUARTIC, GNP_WEIGHT_LINEAR},
	            {"outliers", options->outliers, GNP_OUTLIERS_AUTO, GNP_OUTLIERS_LEFT_OUT}};
	for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
		gnp_status status = gnp_check_integer(rows[i].name, rows[i].value, rows[i].low, rows[i].high, error);
		if (status != GNP_OK)
			return status;
	}
	struct gnp_basis basis = basis_of(options);
	if (basis.kind != GNP_BASIS_TAYLOR && gnp_basis_size(basis) > (size_t)options->k)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "k: got %d, need at least %zu for degree %d", options->k,
		                     gnp_basis_size(basis), options->degree);
	return check_quantities(options, error);
}

/* The points to estimate at, as the caller counts them; at is NULL for all of them. */
struct choice {
	const uint32_t *at; /* (count) */
	size_t count;
};

/* Patch p is that of the point at[p], and serves it. */
static gnp_status cover_chosen(const struct gnp_prepared *prepared, const struct choice *choice, struct gnp_cover *cover,
                               struct gnp_error *error)
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

struct work {
	const struct gnp_prepared *prepared;
	const struct choice *choice;
	struct gnp_cover cover; /* which patch serves which point */
	const struct gnp_estimator *estimator;
	struct gnp_fit_options fit;
	void *state;                  /* the estimator's view of the whole cloud */
	const unsigned char *outlier; /* (count) in curve order, or NULL */
	const double *sheets;         /* (count, 3) normals that tell sheets apart, or NULL */
	uint64_t quantities;
	struct gnp_patch_rule rule;
	struct gnp_estimate *out;
	struct gnp_belief_probe *probes; /* NULL: the answer is not judged */
	size_t stride;                   /* of the points probed */
	atomic_size_t degenerate;
	atomic_size_t search_ns, fit_ns; /* summed over workers */
};

static size_t nanoseconds(double since)
{
	return (size_t)(1e9 * (gnp_clock() - since));
}

/* The nearest points each patch of a chunk needs: the balls of radius epsilon, or as many as the estimator reaches for. */
static gnp_status find_neighborhoods(const struct work *work, size_t begin, size_t count, struct gnp_scratch *scratch,
                                     struct gnp_neighborhoods *found, struct gnp_error *error)
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

static gnp_status build_patches(const struct work *work, size_t begin, size_t count, struct gnp_patch *patches,
                                struct gnp_scratch *scratch, struct gnp_error *error)
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
static double deviation(const struct gnp_patch *patch, const struct gnp_surface *surface, const double position[3], double u,
                        double v)
{
	const double *o = surface->origin, d[3] = {position[0] - o[0], position[1] - o[1], position[2] - o[2]};
	return fabs(gnp_dot(d, surface->frame[2]) - gnp_surface_jet(surface, u, v).f) / patch->scale_w;
}

static void write_point(const struct work *work, const struct gnp_patch *patch, const struct gnp_fit *fit, size_t point,
                        size_t row)
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
		out->values[GNP_OUTLIER][row] = work->outlier[point];
	if (out->values[GNP_BOUNDARY]) {
		gnp_patch_locate(patch, position, &u, &v);
		out->values[GNP_BOUNDARY][row] = gnp_patch_one_sided(patch, u, v);
	}
}

static void probe_point(const struct work *work, const struct gnp_fit *fit, size_t point)
{
	struct gnp_belief_probe *probe = &work->probes[point / work->stride];
	double u, v, *values[GNP_QUANTITY_COUNT] = {[GNP_NORMALS] = probe->normal};
	gnp_surface_locate(&fit->surface, work->prepared->points + 3 * point, &u, &v);
	gnp_surface_evaluate(&fit->surface, u, v, GNP_QUANTITY_BIT(GNP_NORMALS), 0, values);
	probe->residual = fit->residual;
	probe->outlier = work->outlier && work->outlier[point];
}

static void write_patch(struct work *work, size_t p, const struct gnp_patch *patch, const struct gnp_fit *fit)
{
	const struct gnp_prepared *prepared = work->prepared;
	for (size_t m = work->cover.start[p]; m < work->cover.start[p + 1]; m++) {
		size_t point = work->cover.member[m];
		write_point(work, patch, fit, point, work->choice->at ? p : prepared->order[point]);
		if (work->probes && point == gnp_belief_point(work->stride, prepared->count, point / work->stride))
			probe_point(work, fit, point);
	}
	if (fit->reduced)
		atomic_fetch_add_explicit(&work->degenerate, work->cover.start[p + 1] - work->cover.start[p],
		                          memory_order_relaxed);
}

static gnp_status estimate_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                 struct gnp_error *error)
{
	struct work *work = context;
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

static gnp_status allocate_values(struct gnp_estimate *estimate, uint64_t quantities, struct gnp_error *error)
{
	for (int q = 0; q < GNP_QUANTITY_COUNT; q++) {
		if (!(quantities & GNP_QUANTITY_BIT(q)))
			continue;
		size_t width = quantity_width((enum gnp_quantity)q, estimate->basis_size), items;
		bool fits = gnp_size_multiply(estimate->count, width, &items);
		estimate->values[q] = fits ? gnp_array_new(items, sizeof(double)) : NULL;
		if (!estimate->values[q])
			return gnp_error_set(error, GNP_OUT_OF_MEMORY, "estimate: no memory for %zu values of %s", estimate->count,
			                     gnp_quantity_info((enum gnp_quantity)q)->name);
	}
	return GNP_OK;
}

static gnp_status allocate_probes(struct work *work, struct gnp_error *error)
{
	work->stride = gnp_belief_stride(work->prepared->count);
	work->probes = gnp_array_zero(work->prepared->count / work->stride + 1, sizeof *work->probes);
	return work->probes ? GNP_OK : gnp_error_set(error, GNP_OUT_OF_MEMORY, "estimate: no memory for probes");
}

/* Both searches and fits run in one loop: its wall time is split as the workers spent theirs. */
static void book_search(struct work *work, struct gnp_task *task)
{
	double search = (double)work->search_ns, total = search + (double)work->fit_ns;
	if (task && total > 0)
		gnp_task_rebook(task, GNP_STAGE_ESTIMATE, GNP_STAGE_NEIGHBORS,
		                task->seconds[GNP_STAGE_ESTIMATE] * search / total);
}

/* Some estimators look for outliers in some clouds only. As with quantities that an estimator never has: "all" goes without. */
static gnp_status check_judged(struct work *work, const struct gnp_estimate_options *options, struct gnp_error *error)
{
	if (work->outlier || !(work->quantities & GNP_QUANTITY_BIT(GNP_OUTLIER)))
		return GNP_OK;
	if (options->quantities != GNP_QUANTITY_ALL && options->quantities & GNP_QUANTITY_BIT(GNP_OUTLIER))
		return gnp_error_set(error, GNP_INVALID_ARGUMENT,
		                     "quantities: got outlier, which the estimator %s does not judge with weights %s (it does with outliers=left_out)",
		                     work->estimator->name, work->fit.model ? work->fit.model->name : "auto");
	work->quantities &= ~GNP_QUANTITY_BIT(GNP_OUTLIER);
	return GNP_OK;
}

static gnp_status prepare_estimator(struct work *work, const struct gnp_estimate_options *options, struct gnp_pool *pool, struct gnp_task *task,
                                    struct gnp_error *error)
{
	const struct gnp_prepared *prepared = work->prepared;
	const struct gnp_fit_cloud cloud = {prepared->count, prepared->points, prepared->normals, prepared->neighbors};
	gnp_status status = GNP_OK;
	if (work->estimator->prepare)
		status = work->estimator->prepare(&cloud, &work->fit, pool, task, &work->state, error);
	if (status == GNP_OK && work->estimator->outliers)
		work->outlier = work->estimator->outliers(work->state);
	if (status == GNP_OK && work->estimator->normals)
		work->sheets = work->estimator->normals(work->state);
	if (status == GNP_OK && work->estimator->rule)
		work->estimator->rule(work->state, &work->rule);
	if (status == GNP_OK && prepared->count < work->rule.k)
		status = gnp_error_set(error, GNP_INVALID_ARGUMENT, "points: got %zu, need at least %zu, the neighbours of a patch",
		                       prepared->count, work->rule.k);
	work->fit.basis = work->rule.basis;
	return status == GNP_OK ? check_judged(work, options, error) : status;
}

/* Which patches there are, and what each serves. */
static gnp_status make_cover(struct work *work, const struct gnp_estimate_options *options, struct gnp_pool *pool,
                             struct gnp_task *task, struct gnp_error *error)
{
	const struct gnp_prepared *prepared = work->prepared;
	if (work->choice->at)
		return cover_chosen(prepared, work->choice, &work->cover, error);
	struct gnp_cover_rule rule = {.fixed = work->rule.served, .normals = work->sheets};
	if (options->cover == GNP_COVER_ALL) {
		if (!work->estimator->served)
			return gnp_cover_all(prepared->count, &work->cover, error);
		rule = (struct gnp_cover_rule){.fixed = GNP_SERVED_MAX < prepared->count ? GNP_SERVED_MAX : prepared->count,
		                               .served = work->estimator->served, .context = work->state, .normals = work->sheets};
	}
	return gnp_cover_greedy(prepared->neighbors, prepared->points, prepared->count, &rule, pool, task, &work->cover, error);
}

static void work_clear(struct work *work)
{
	if (work->state)
		work->estimator->release(work->state);
	gnp_cover_clear(&work->cover);
	free(work->probes);
}

static size_t count_outliers(const struct work *work)
{
	size_t count = 0;
	for (size_t i = 0; work->outlier && i < work->prepared->count; i++)
		count += work->outlier[i];
	return count;
}

static gnp_status estimate_choice(const struct gnp_prepared *prepared, const struct gnp_estimate_options *options,
                                  const struct choice *choice, struct gnp_pool *pool, struct gnp_task *task,
                                    struct gnp_estimate *estimate, struct gnp_error *error)
{
	const struct gnp_estimator *estimator = estimator_of(options);
	struct work work = {.prepared = prepared, .choice = choice, .estimator = estimator,
	                    .fit = {.basis = basis_of(options), .weight = (enum gnp_weight_kind)options->weight,
	                            .outliers = (enum gnp_outliers_kind)options->outliers,
	                            .model = options->model, .models = options->models},
	                    .quantities = (options->quantities | options->if_offered) & offered_quantities(estimator),
	                    .rule = {.k = (size_t)options->k, .served = (size_t)options->k / 3, .buffer = 1, .delta0_ratio = 0.1,
	                             .basis = basis_of(options)},
	                    .out = estimate};
	gnp_task_stage(task, GNP_STAGE_PREPARE, 0);
	gnp_status status = prepare_estimator(&work, options, pool, task, error);
	gnp_task_stage(task, GNP_STAGE_NEIGHBORS, prepared->count);
	if (status == GNP_OK)
		status = make_cover(&work, options, pool, task, error);
	estimate->count = choice->at ? choice->count : prepared->count;
	estimate->basis_size = gnp_basis_size(work.fit.basis);
	if (status == GNP_OK)
		status = allocate_values(estimate, work.quantities, error);
	if (status == GNP_OK && !choice->at && !options->unjudged && task)
		status = allocate_probes(&work, error);
	gnp_task_stage(task, GNP_STAGE_ESTIMATE, work.cover.count);
	if (status == GNP_OK)
		status = gnp_pool_run(pool, task, work.cover.count, PATCHES_A_CHUNK, estimate_chunk, &work, error);
	if (status == GNP_OK && work.probes)
		status = gnp_belief_check_answer(prepared, work.probes, (work.quantities & GNP_QUANTITY_STDERR) != 0, pool, task, error);
	gnp_task_stage(task, GNP_STAGE_DONE, 0);
	book_search(&work, task);
	estimate->components = prepared->components;
	estimate->patches = work.cover.count;
	estimate->degenerate = work.degenerate;
	estimate->outliers = count_outliers(&work);
	estimate->model = estimator->model && status == GNP_OK ? estimator->model(work.state) : NULL;
	work_clear(&work);
	return status;
}

static gnp_status check_choice(const struct choice *choice, size_t points, struct gnp_error *error)
{
	if (choice->count == 0 || choice->count > UINT32_MAX)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "at: got %zu points, need 1..%u", choice->count, UINT32_MAX);
	for (size_t i = 0; i < choice->count; i++)
		if (choice->at[i] >= points)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "at[%zu]: got point %u, the cloud has %zu", i, choice->at[i],
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
		status = gnp_error_set(error, GNP_DEGENERATE, "points: got %zu, need at least %d, a neighbourhood", prepared->count,
		                       options->k);
	if (status != GNP_OK)
		return status;
	return estimate_ready(prepared, options, &(struct choice){NULL, 0}, pool, task, out, error);
}

gnp_status gnp_estimate_run(const struct gnp_cloud *cloud, const struct gnp_estimate_options *options,
                            struct gnp_pool *pool, struct gnp_task *task, struct gnp_estimate *out,
                            struct gnp_error *error)
{
	return estimate_cloud(cloud, options, &(struct choice){NULL, 0}, pool, task, out, error);
}

gnp_status gnp_estimate_at(const struct gnp_cloud *cloud, const struct gnp_estimate_options *options, const uint32_t *at,
                           size_t at_count, struct gnp_pool *pool, struct gnp_task *task, struct gnp_estimate *out,
                           struct gnp_error *error)
{
	assert(at);
	return estimate_cloud(cloud, options, &(struct choice){at, at_count}, pool, task, out, error);
}

void gnp_estimate_clear(struct gnp_estimate *estimate)
{
	for (int q = 0; q < GNP_QUANTITY_COUNT; q++)
		free(estimate->values[q]);
	*estimate = (struct gnp_estimate){0};
}

size_t gnp_estimate_memory(size_t count, const struct gnp_estimate_options *options)
{
	/* order 4, points and normals 48, search tree 80, cover 16; orientation's graph 250, gone before the outputs fill */
	/* an estimator that looks at the whole cloud first: judgements of outliers 90, verdicts on supports 80, its choices 20,
	 * normals of sheets 24 */
	enum { PREPARED = 148, ORIENTATION = 250, SURVEYED = 214, FIXED = 16 << 20 };
	size_t width = 0, size = gnp_basis_size(basis_of(options));
	for (int q = 0; q < GNP_QUANTITY_COUNT; q++)
		if ((options->quantities | options->if_offered) & GNP_QUANTITY_BIT(q))
			width += quantity_width((enum gnp_quantity)q, size);
	size_t outputs = width * sizeof(double);
	size_t prepared = PREPARED + (estimator_of(options)->prepare ? SURVEYED : 0);
	return FIXED + count * (prepared + (outputs > ORIENTATION ? outputs : ORIENTATION));
}
