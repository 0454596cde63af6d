#include "estimate.h"

#include <assert.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cover.h"
#include "memory.h"
#include "order.h"
#include "orient.h"
#include "surface.h"

enum { K_MIN = 12, K_MAX = 500, PATCHES_A_CHUNK = 192 };

struct gnp_estimate_options gnp_estimate_defaults(void)
{
	return (struct gnp_estimate_options){
		.estimator = GNP_ESTIMATOR_GMLS, .cover = GNP_COVER_COVER, .k = 30, .degree = 3, .basis = GNP_BASIS_TENSOR,
		.weight = GNP_WEIGHT_QUARTIC,
		.quantities = GNP_QUANTITY_BIT(GNP_NORMALS) | GNP_QUANTITY_BIT(GNP_MEAN_CURVATURE) |
		              GNP_QUANTITY_BIT(GNP_GAUSSIAN_CURVATURE)};
}

static struct gnp_basis basis_of(const struct gnp_estimate_options *options)
{
	return (struct gnp_basis){(enum gnp_basis_kind)options->basis, (unsigned)options->degree};
}

static size_t quantity_width(enum gnp_quantity quantity, size_t basis_size)
{
	size_t width = gnp_quantity_info(quantity)->width;
	return width ? width : basis_size;
}

static gnp_status check_range(const char *name, int value, int low, int high, struct gnp_error *error)
{
	if (value >= low && value <= high)
		return GNP_OK;
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: got %d, need %d..%d", name, value, low, high);
}

static gnp_status check_options(const struct gnp_estimate_options *options, struct gnp_error *error)
{
	const struct {
		const char *name;
		int value, low, high;
	} rows[] = {{"estimator", options->estimator, 0, GNP_ESTIMATOR_KINDS - 1},
	            {"cover", options->cover, GNP_COVER_COVER, GNP_COVER_ALL},
	            {"k", options->k, K_MIN, K_MAX},
	            {"degree", options->degree, 1, GNP_DEGREE_MAX},
	            {"basis", options->basis, GNP_BASIS_TENSOR, GNP_BASIS_TOTAL},
	            {"weight", options->weight, GNP_WEIGHT_QUARTIC, GNP_WEIGHT_LINEAR}};
	for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
		gnp_status status = check_range(rows[i].name, rows[i].value, rows[i].low, rows[i].high, error);
		if (status != GNP_OK)
			return status;
	}
	if (!options->quantities || options->quantities & ~GNP_QUANTITY_ALL)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "quantities: got mask %#llx, need some of %#llx",
		                     (unsigned long long)options->quantities, (unsigned long long)GNP_QUANTITY_ALL);
	size_t size = gnp_basis_size(basis_of(options));
	if (size > (size_t)options->k)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "k: got %d, need at least %zu for degree %d", options->k, size,
		                     options->degree);
	return GNP_OK;
}

/* The cloud in curve order with everything the patches need. */
struct prepared {
	size_t count;
	uint32_t *order;  /* (count) caller's index of each point */
	double *points;   /* (count, 3) */
	double *normals;  /* (count, 3) unit */
	struct gnp_neighbors *neighbors;
	struct gnp_cover cover;
	size_t components;
	size_t rows;      /* of the outputs */
	bool chosen;      /* a row a patch, not a row a point */
};

/* The points to estimate at, as the caller counts them; at is NULL for all of them. */
struct choice {
	const uint32_t *at; /* (count) */
	size_t count;
};

static void prepared_clear(struct prepared *prepared)
{
	free(prepared->order);
	free(prepared->points);
	free(prepared->normals);
	gnp_neighbors_free(prepared->neighbors);
	gnp_cover_clear(&prepared->cover);
}

static void gather_points(struct prepared *prepared, const struct gnp_cloud *cloud)
{
	for (size_t i = 0; i < prepared->count; i++)
		memcpy(prepared->points + 3 * i, cloud->points + 3 * (size_t)prepared->order[i], 3 * sizeof(double));
}

static void gather_normals(struct prepared *prepared, const struct gnp_cloud *cloud)
{
	for (size_t i = 0; i < prepared->count; i++) {
		const double *n = cloud->normals + 3 * (size_t)prepared->order[i];
		double length = sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
		for (int c = 0; c < 3; c++)
			prepared->normals[3 * i + c] = n[c] / length;
	}
}

/* Patch p is that of the point at[p], and serves it. */
static gnp_status cover_chosen(const struct prepared *prepared, const struct choice *choice, struct gnp_cover *cover,
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

static gnp_status prepare_cover(const struct gnp_estimate_options *options, const struct choice *choice,
                                struct gnp_pool *pool, struct gnp_task *task, struct prepared *prepared,
                                struct gnp_error *error)
{
	size_t n = prepared->count;
	prepared->chosen = choice->at != NULL;
	prepared->rows = prepared->chosen ? choice->count : n;
	if (prepared->chosen)
		return cover_chosen(prepared, choice, &prepared->cover, error);
	if (options->cover == GNP_COVER_ALL)
		return gnp_cover_all(n, &prepared->cover, error);
	return gnp_cover_greedy(prepared->neighbors, prepared->points, n, (size_t)options->k / 3, pool, task, &prepared->cover,
	                        error);
}

static gnp_status prepare(const struct gnp_cloud *cloud, const struct gnp_estimate_options *options,
                          const struct choice *choice, struct gnp_pool *pool, struct gnp_task *task,
                          struct prepared *prepared, struct gnp_error *error)
{
	size_t n = cloud->count;
	prepared->count = n;
	prepared->order = gnp_array_new(n, sizeof *prepared->order);
	prepared->points = gnp_array_new(n, 3 * sizeof(double));
	prepared->normals = gnp_array_new(n, 3 * sizeof(double));
	if (!prepared->order || !prepared->points || !prepared->normals)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "estimate: no memory for %zu points", n);
	gnp_task_stage(task, GNP_STAGE_ORDER, 0);
	gnp_status status = gnp_order_compute(cloud->points, n, prepared->order, error);
	if (status != GNP_OK)
		return status;
	gather_points(prepared, cloud);
	gnp_task_stage(task, GNP_STAGE_NEIGHBORS, 0);
	status = gnp_neighbors_build(prepared->points, n, &prepared->neighbors, error);
	if (status != GNP_OK)
		return status;
	gnp_task_stage(task, GNP_STAGE_ORIENT, cloud->normals ? n : 2 * n); /* two passes over the points */
	if (cloud->normals)
		gather_normals(prepared, cloud);
	else
		status = gnp_orient_normals(prepared->points, n, prepared->neighbors, 0, pool, task, prepared->normals,
		                            &prepared->components, error);
	if (status != GNP_OK)
		return status;
	gnp_task_stage(task, GNP_STAGE_NEIGHBORS, n);
	return prepare_cover(options, choice, pool, task, prepared, error);
}

struct work {
	const struct prepared *prepared;
	const struct gnp_estimator *estimator;
	struct gnp_fit_options fit;
	uint64_t quantities;
	size_t k;
	struct gnp_estimate *out;
	atomic_size_t degenerate;
	atomic_size_t search_ns, fit_ns; /* summed over workers */
};

static size_t nanoseconds(double since)
{
	return (size_t)(1e9 * (gnp_clock() - since));
}

static gnp_status build_patches(const struct work *work, size_t begin, size_t count, struct gnp_patch *patches,
                                struct gnp_scratch *scratch, struct gnp_error *error)
{
	const struct prepared *prepared = work->prepared;
	const struct gnp_patch_source source = {prepared->points, prepared->normals, work->estimator->support,
	                                        work->estimator->delta0_ratio};
	size_t most = 8 * work->k + 64;
	struct gnp_neighborhoods found;
	gnp_status status = gnp_neighborhoods_find(prepared->neighbors, prepared->cover.centre + begin, count, work->k,
	                                           GNP_PATCH_TAU * source.support, most, scratch, &found, error);
	if (status != GNP_OK)
		return status;
	size_t total = found.start[count];
	double *u = gnp_scratch_take(scratch, total, sizeof *u), *v = gnp_scratch_take(scratch, total, sizeof *v);
	double *w = gnp_scratch_take(scratch, total, sizeof *w);
	if (!u || !v || !w)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "estimate: no memory for patches of %zu points", total);
	for (size_t p = 0; p < count && status == GNP_OK; p++) {
		size_t at = found.start[p];
		status = gnp_patch_build(&source, &found, p, prepared->cover.centre[begin + p], u + at, v + at, w + at, &patches[p],
		                         error);
	}
	return status;
}

static void write_patch(struct work *work, size_t p, const struct gnp_patch *patch, const double *coefficients,
                        const struct gnp_fit *fit)
{
	const struct prepared *prepared = work->prepared;
	struct gnp_estimate *out = work->out;
	const struct gnp_surface surface = {work->fit.basis, coefficients, patch};
	for (size_t m = prepared->cover.start[p]; m < prepared->cover.start[p + 1]; m++) {
		size_t point = prepared->cover.member[m], row = prepared->chosen ? p : prepared->order[point];
		double u, v;
		gnp_patch_locate(patch, prepared->points + 3 * point, &u, &v);
		gnp_surface_evaluate(&surface, u, v, work->quantities, row, out->values);
		if (out->values[GNP_SURFACE_COEFFICIENTS])
			memcpy(out->values[GNP_SURFACE_COEFFICIENTS] + row * out->basis_size, coefficients,
			       out->basis_size * sizeof *coefficients);
		if (out->values[GNP_RESIDUAL])
			out->values[GNP_RESIDUAL][row] = fit->residual * patch->scale_w;
	}
	if (fit->degree < work->fit.basis.degree)
		atomic_fetch_add_explicit(&work->degenerate, prepared->cover.start[p + 1] - prepared->cover.start[p],
		                          memory_order_relaxed);
}

static gnp_status estimate_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                 struct gnp_error *error)
{
	struct work *work = context;
	size_t count = end - begin, size = work->out->basis_size;
	double started = gnp_clock();
	struct gnp_patch *patches = gnp_scratch_take(scratch, count, sizeof *patches);
	struct gnp_fit *fits = gnp_scratch_take(scratch, count, sizeof *fits);
	double *coefficients = gnp_scratch_take(scratch, count * size, sizeof *coefficients);
	if (!patches || !fits || !coefficients)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "estimate: no memory for %zu patches", count);
	gnp_status status = build_patches(work, begin, count, patches, scratch, error);
	if (status != GNP_OK)
		return status;
	atomic_fetch_add_explicit(&work->search_ns, nanoseconds(started), memory_order_relaxed);
	started = gnp_clock();
	status = work->estimator->fit(&work->fit, patches, count, coefficients, fits, scratch, error);
	if (status != GNP_OK)
		return status;
	for (size_t p = 0; p < count; p++)
		write_patch(work, begin + p, &patches[p], coefficients + p * size, &fits[p]);
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

/* Both searches and fits run in one loop: its wall time is split as the workers spent theirs. */
static void book_search(struct work *work, struct gnp_task *task)
{
	double search = (double)work->search_ns, total = search + (double)work->fit_ns;
	if (task && total > 0)
		gnp_task_rebook(task, GNP_STAGE_ESTIMATE, GNP_STAGE_NEIGHBORS,
		                task->seconds[GNP_STAGE_ESTIMATE] * search / total);
}

static gnp_status estimate_prepared(const struct prepared *prepared, const struct gnp_estimate_options *options,
                                    struct gnp_pool *pool, struct gnp_task *task, struct gnp_estimate *estimate,
                                    struct gnp_error *error)
{
	estimate->count = prepared->rows;
	estimate->basis_size = gnp_basis_size(basis_of(options));
	gnp_status status = allocate_values(estimate, options->quantities, error);
	if (status != GNP_OK)
		return status;
	struct work work = {.prepared = prepared,
	                    .estimator = gnp_estimator_at((enum gnp_estimator_kind)options->estimator),
	                    .fit = {basis_of(options), (enum gnp_weight_kind)options->weight},
	                    .quantities = options->quantities, .k = (size_t)options->k, .out = estimate};
	gnp_task_stage(task, GNP_STAGE_ESTIMATE, prepared->cover.count);
	status = gnp_pool_run(pool, task, prepared->cover.count, PATCHES_A_CHUNK, estimate_chunk, &work, error);
	gnp_task_stage(task, GNP_STAGE_DONE, 0);
	book_search(&work, task);
	estimate->components = prepared->components;
	estimate->patches = prepared->cover.count;
	estimate->degenerate = work.degenerate;
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

static gnp_status estimate_choice(const struct gnp_cloud *cloud, const struct gnp_estimate_options *options,
                                  const struct choice *choice, struct gnp_pool *pool, struct gnp_task *task,
                                  struct gnp_estimate *out, struct gnp_error *error)
{
	gnp_status status = check_options(options, error);
	if (status == GNP_OK)
		status = gnp_cloud_check(cloud, (size_t)options->k, error);
	if (status == GNP_OK && choice->at)
		status = check_choice(choice, cloud->count, error);
	if (status != GNP_OK)
		return status;
	struct prepared prepared = {0};
	struct gnp_estimate result = {.normals_estimated = !cloud->normals};
	status = prepare(cloud, options, choice, pool, task, &prepared, error);
	if (status == GNP_OK)
		status = estimate_prepared(&prepared, options, pool, task, &result, error);
	if (status == GNP_OK)
		*out = result;
	else
		gnp_estimate_clear(&result);
	prepared_clear(&prepared);
	return status;
}

gnp_status gnp_estimate_run(const struct gnp_cloud *cloud, const struct gnp_estimate_options *options,
                            struct gnp_pool *pool, struct gnp_task *task, struct gnp_estimate *out,
                            struct gnp_error *error)
{
	return estimate_choice(cloud, options, &(struct choice){NULL, 0}, pool, task, out, error);
}

gnp_status gnp_estimate_at(const struct gnp_cloud *cloud, const struct gnp_estimate_options *options, const uint32_t *at,
                           size_t at_count, struct gnp_pool *pool, struct gnp_task *task, struct gnp_estimate *out,
                           struct gnp_error *error)
{
	assert(at);
	return estimate_choice(cloud, options, &(struct choice){at, at_count}, pool, task, out, error);
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
	enum { PREPARED = 148, ORIENTATION = 250, FIXED = 16 << 20 };
	size_t width = 0, size = gnp_basis_size(basis_of(options));
	for (int q = 0; q < GNP_QUANTITY_COUNT; q++)
		if (options->quantities & GNP_QUANTITY_BIT(q))
			width += quantity_width((enum gnp_quantity)q, size);
	size_t outputs = width * sizeof(double);
	return FIXED + count * (PREPARED + (outputs > ORIENTATION ? outputs : ORIENTATION));
}
