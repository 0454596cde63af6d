#include "core/estimators/learned.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/estimators/outliers.h"
#include "core/estimators/projection_fit.h"
#include "core/estimators/sheets.h"
#include "core/estimators/weighted_fit.h"
#include "core/model/models.h"
#include "core/network/pooled.h"
#include "core/support/votes.h"

enum {
	POINTS_A_SERVED = 60, /* of a support, for each point its patch may serve as well as that point's own would */
	LEAST_POINTS = 12,    /* of a cloud for weighted models */
	BATCH = 16            /* patches the projection head sees at a time */
};

struct state {
	const struct gnp_model *model;
	size_t count;
	bool judged;            /* outliers were looked for; else none are marked */
	unsigned char *outlier; /* (count) */
	double *normals;        /* (count, 3) of the sheet each point belongs to; NULL of weighted models */
	struct gnp_roughness roughness; /* of weighted models */
	struct gnp_weighted_cloud weighted;
};

static bool is_projection(const struct state *state)
{
	return state->model->architecture.head == GNP_HEAD_PROJECTION;
}

static bool is_weighted(const struct state *state)
{
	return state->model->architecture.head == GNP_HEAD_WEIGHTED;
}

/* The model for any cloud: the first by name that weighs nodes. */
static gnp_status choose_model(const struct gnp_models *models, const struct gnp_model **out, struct gnp_error *error)
{
	size_t count = gnp_models_count(models);
	for (size_t i = 0; i < count; i++)
		if (gnp_models_at(models, i)->architecture.head == GNP_HEAD_WEIGHTED) {
			*out = gnp_models_at(models, i);
			return GNP_OK;
		}
	if (count == 0)
		return gnp_error_set(error, GNP_UNAVAILABLE,
		                     "weights: none are loaded, the estimator gnp needs some; estimator=gmls and estimator=adaptive need none");
	return gnp_error_set(error, GNP_INVALID_ARGUMENT,
	                     "weights: got auto, none of the %zu models is for any cloud (head %s); name one of them", count,
	                     gnp_head_name(GNP_HEAD_WEIGHTED));
}

static gnp_status find_outliers(const struct gnp_fit_cloud *cloud, struct gnp_pool *pool, struct gnp_task *task,
                                struct state *state, struct gnp_error *error)
{
	state->judged = true;
	return gnp_outliers_find(cloud->points, cloud->normals, cloud->count, cloud->neighbors, pool, task, state->outlier,
	                         error);
}

/* ---- The estimator's hooks ---- */

void gnp_learned_release(void *pointer)
{
	struct state *state = pointer;
	if (!state)
		return;
	free(state->outlier);
	free(state->normals);
	gnp_roughness_clear(&state->roughness);
	gnp_votes_free(state->weighted.votes);
	free(state);
}

static bool looks_for_outliers(const struct state *state, enum gnp_outliers_kind outliers)
{
	return outliers == GNP_OUTLIERS_LEFT_OUT ||
	       (outliers == GNP_OUTLIERS_AUTO && is_projection(state) && strcmp(state->model->regime, "outlier") == 0);
}

static gnp_status prepare_weighted(struct state *state, const struct gnp_fit_cloud *cloud, struct gnp_pool *pool,
                                   struct gnp_task *task, struct gnp_error *error)
{
	state->weighted = (struct gnp_weighted_cloud){
		.count = cloud->count, .network = state->model->network,
		.points = {cloud->points, cloud->normals, cloud->given, cloud->neighbors, &state->roughness},
		.votes = gnp_votes_create(cloud->count)};
	if (!state->weighted.votes)
		return gnp_no_memory("gnp", cloud->count, "points", error);
	return gnp_roughness_measure(cloud->neighbors, pool, task, &state->roughness, error);
}

static gnp_status prepare_patched(struct state *state, const struct gnp_fit_cloud *cloud,
                                  enum gnp_outliers_kind outliers,
                                  struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	state->outlier = gnp_array_zero(cloud->count, 1);
	state->normals = gnp_array_new(cloud->count, 3 * sizeof *state->normals);
	if (!state->outlier || !state->normals)
		return gnp_no_memory("gnp", cloud->count, "points", error);
	if (looks_for_outliers(state, outliers))
		status = find_outliers(cloud, pool, task, state, error);
	return status == GNP_OK ? gnp_sheets_normals(cloud, state->outlier, pool, task, state->normals, error) : status;
}

static gnp_status prepare(struct state *state, const struct gnp_fit_cloud *cloud, const struct gnp_fit_options *options,
                          struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error)
{
	state->count = cloud->count;
	state->model = options->model;
	gnp_status status = state->model ? GNP_OK : choose_model(options->models, &state->model, error);
	if (status != GNP_OK)
		return status;
	return is_weighted(state) ? prepare_weighted(state, cloud, pool, task, error)
	                          : prepare_patched(state, cloud, options->outliers, pool, task, error);
}

gnp_status gnp_learned_prepare(const struct gnp_fit_cloud *cloud, const struct gnp_fit_options *options,
                               struct gnp_pool *pool, struct gnp_task *task, void **out, struct gnp_error *error)
{
	struct state *state = gnp_array_zero(1, sizeof *state);
	if (!state)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "gnp: no memory");
	gnp_status status = prepare(state, cloud, options, pool, task, error);
	if (status == GNP_OK)
		*out = state;
	else
		gnp_learned_release(state);
	return status;
}

const struct gnp_model *gnp_learned_model(const void *pointer)
{
	return ((const struct state *)pointer)->model;
}

/* The support a fit hardly ever is narrower than: of the second shell. */
static size_t support(const struct state *state)
{
	const struct gnp_architecture *a = &state->model->architecture;
	return a->shell[a->shells > 1 ? 1 : 0];
}

void gnp_learned_rule(const void *pointer, struct gnp_patch_rule *rule)
{
	const struct state *state = pointer;
	const struct gnp_recipe *recipe = &state->model->recipe;
	static const struct gnp_basis taylor = {GNP_BASIS_TAYLOR, GNP_TAYLOR_DEGREE}, legendre = {GNP_BASIS_TENSOR, 3};
	/* The pooled head is trained on the whole patch. */
	size_t third = recipe->k / 3, middle = is_projection(state) ? support(state) / 6 : 2 * third;
	if (is_weighted(state)) {
		*rule = (struct gnp_patch_rule){.k = LEAST_POINTS, .served = 1, .buffer = 1, .basis = taylor};
		return;
	}
	*rule = (struct gnp_patch_rule){recipe->k,      middle > third ? middle : third, recipe->buffer, recipe->delta0_ratio,
	                                recipe->delta0, recipe->height_scale,            is_projection(state) ? taylor : legendre};
}

size_t gnp_learned_reach(const void *pointer, uint32_t point)
{
	const struct state *state = pointer;
	(void)point;
	return is_projection(state) ? gnp_projection_reach(&state->model->architecture) : 0;
}

size_t gnp_learned_served(const void *pointer, uint32_t point)
{
	const struct state *state = pointer;
	(void)point;
	return is_projection(state) && support(state) >= 2 * POINTS_A_SERVED ? support(state) / POINTS_A_SERVED : 1;
}

const unsigned char *gnp_learned_outliers(const void *pointer)
{
	const struct state *state = pointer;
	return state->judged ? state->outlier : NULL;
}

const struct gnp_weighted_cloud *gnp_learned_weighted(const void *pointer)
{
	const struct state *state = pointer;
	return is_weighted(state) ? &state->weighted : NULL;
}

const double *gnp_learned_normals(const void *pointer)
{
	return ((const struct state *)pointer)->normals;
}

/* ---- Fits ---- */

static void set_surface(const struct gnp_patch *patch, struct gnp_basis basis, const double *coefficients,
                        double scale_w, struct gnp_fit *fit)
{
	*fit = (struct gnp_fit){.surface = {.basis = basis, .coefficients = coefficients, .scale_xy = patch->scale_xy,
	                                    .scale_w = scale_w}};
	memcpy(fit->surface.origin, patch->origin, sizeof patch->origin);
	memcpy(fit->surface.frame, patch->frame, sizeof patch->frame);
}

static size_t usable(const void *context, const struct gnp_patch *patch, size_t most, uint32_t *positions)
{
	const struct state *state = context;
	return gnp_sheets_usable(state->normals, state->outlier, patch, most, positions);
}

/* Of at most BATCH patches: their sums take 100 kB each. coefficients (count, GNP_TAYLOR_STRIDE) out. */
static gnp_status fit_batch(const struct state *state, const struct gnp_patch *patches, size_t count,
                            double *coefficients, struct gnp_fit *fits, struct gnp_scratch *scratch,
                            struct gnp_error *error)
{
	const struct gnp_network *network = state->model->network;
	static const struct gnp_basis taylor = {GNP_BASIS_TAYLOR, GNP_TAYLOR_DEGREE};
	struct gnp_projected projected;
	gnp_status status = gnp_projected_describe(&network->architecture, patches, count, usable, state, &projected,
	                                           scratch, error);
	if (status == GNP_OK)
		status = gnp_projected_solve(network, false, &projected, scratch, error);
	for (size_t p = 0; p < count && status == GNP_OK; p++) {
		const struct gnp_projection_fit *fit = &projected.fits[p];
		double *own = coefficients + p * GNP_TAYLOR_STRIDE;
		memcpy(own, fit->coefficients, sizeof fit->coefficients);
		set_surface(&patches[p], taylor, own, patches[p].scale_xy, &fits[p]);
		fits[p].residual = fit->weight > 0 ? sqrt(fit->misfit / fit->weight) * patches[p].scale_xy : 0;
		fits[p].reduced = projected.sums[p].count[0] < network->architecture.shell[0];
	}
	return status;
}

static gnp_status fit_projection(const struct state *state, const struct gnp_patch *patches, size_t count,
                                 struct gnp_fit *fits, struct gnp_scratch *scratch, struct gnp_error *error)
{
	double *coefficients = gnp_scratch_take(scratch, count * GNP_TAYLOR_STRIDE, sizeof *coefficients);
	gnp_status status = GNP_OK;
	if (!coefficients)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "gnp: no memory for %zu patches", count);
	for (size_t first = 0; first < count && status == GNP_OK; first += BATCH) {
		struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
		size_t some = count - first < BATCH ? count - first : BATCH;
		status = fit_batch(state, patches + first, some, coefficients + first * GNP_TAYLOR_STRIDE, fits + first,
		                   scratch, error);
		gnp_scratch_release(scratch, mark);
	}
	return status;
}

static gnp_status lay_out(const struct gnp_patch *patches, size_t count, struct gnp_network_batch *batch,
                          struct gnp_scratch *scratch, struct gnp_error *error)
{
	size_t *start = gnp_scratch_take(scratch, count + 1, sizeof *start);
	size_t *inner = gnp_scratch_take(scratch, count, sizeof *inner);
	size_t rows = 0;
	for (size_t p = 0; p < count; p++)
		rows += patches[p].buffer_count;
	float *nodes = gnp_scratch_take(scratch, rows, 3 * sizeof *nodes), *node = nodes;
	if (!start || !inner || !nodes)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "gnp: no memory for %zu nodes", rows);
	start[0] = 0;
	for (size_t p = 0; p < count; p++) {
		const struct gnp_patch *patch = &patches[p];
		start[p + 1] = start[p] + patch->buffer_count;
		inner[p] = patch->count;
		for (size_t i = 0; i < patch->buffer_count; i++, node += 3) {
			node[0] = (float)patch->u[i];
			node[1] = (float)patch->v[i];
			node[2] = (float)patch->w[i];
		}
	}
	*batch = (struct gnp_network_batch){count, start, inner, nodes};
	return GNP_OK;
}

static double misfit_of(const struct gnp_patch *patch, const struct gnp_surface *surface)
{
	double sum = 0;
	for (size_t i = 0; i < patch->count; i++) {
		struct gnp_jet jet = gnp_basis_jet(surface->basis, surface->coefficients, patch->u[i], patch->v[i]);
		double height = surface->scale_w * jet.f;
		sum += (height - patch->w[i] * patch->scale_w) * (height - patch->w[i] * patch->scale_w);
	}
	return sqrt(sum / (double)patch->count);
}

static gnp_status fit_pooled(const struct state *state, const struct gnp_patch *patches, size_t count,
                             struct gnp_fit *fits, struct gnp_scratch *scratch, struct gnp_error *error)
{
	static const struct gnp_basis legendre = {GNP_BASIS_TENSOR, 3};
	const struct gnp_network *network = state->model->network;
	size_t size = network->architecture.outputs;
	double *coefficients = gnp_scratch_take(scratch, count * size, sizeof *coefficients);
	float *outputs = gnp_scratch_take(scratch, count * size, sizeof *outputs);
	struct gnp_network_batch batch;
	if (!coefficients || !outputs)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "gnp: no memory for %zu patches", count);
	gnp_status status = lay_out(patches, count, &batch, scratch, error);
	if (status == GNP_OK)
		status = gnp_pooled_forward(network, &batch, outputs, NULL, scratch, error);
	for (size_t p = 0; p < count && status == GNP_OK; p++) {
		for (size_t i = 0; i < size; i++)
			coefficients[p * size + i] = (double)outputs[p * size + i];
		set_surface(&patches[p], legendre, coefficients + p * size, patches[p].scale_w, &fits[p]);
		fits[p].residual = misfit_of(&patches[p], &fits[p].surface);
	}
	return status;
}

gnp_status gnp_learned_fit(const struct gnp_fit_options *options, const void *pointer, const struct gnp_patch *patches,
                           size_t count, struct gnp_fit *fits, struct gnp_scratch *scratch, struct gnp_error *error)
{
	const struct state *state = pointer;
	(void)options;
	return is_projection(state) ? fit_projection(state, patches, count, fits, scratch, error)
	                            : fit_pooled(state, patches, count, fits, scratch, error);
}
