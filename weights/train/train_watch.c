#include "weights/train/train_watch.h"

#include <math.h>
#include <stdlib.h>

#include "core/base/memory.h"
#include "core/base/random.h"
#include "weights/train/loss.h"
#include "weights/train/train_fit.h"

enum { PATCHES_A_CHUNK = 8 };

/* What is compared at a centre; known is false where the surface is no graph over the patch. */
struct outcome {
	bool known;
	struct gnp_jet jet, truth;
};

struct gnp_train_watch {
	struct gnp_train_recipe recipe;
	const struct gnp_trainable *network;
	struct gnp_pool *pool;
	size_t shapes, centres; /* centres of each shape */
	struct gnp_train_cloud *clouds; /* (shapes) */
	uint32_t *at;                   /* (shapes, centres) */
	struct outcome *outcomes;       /* (shapes, centres) */
};

static void choose_centres(const struct gnp_train_cloud *cloud, uint64_t seed, size_t count, uint32_t *at)
{
	struct gnp_random random;
	gnp_random_seed(&random, seed, 0);
	for (size_t i = 0; i < count; i++)
		do
			at[i] = (uint32_t)gnp_random_below(&random, cloud->prepared.count);
		while (cloud->outlier[at[i]]);
}

static gnp_status fill(struct gnp_train_watch *watch, const struct gnp_train_data *data, struct gnp_error *error)
{
	size_t total;
	bool fits = gnp_size_multiply(watch->shapes, watch->centres, &total);
	watch->clouds = gnp_array_zero(watch->shapes, sizeof *watch->clouds);
	watch->at = fits ? gnp_array_new(total, sizeof *watch->at) : NULL;
	watch->outcomes = fits ? gnp_array_new(total, sizeof *watch->outcomes) : NULL;
	if (!watch->clouds || !watch->at || !watch->outcomes)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "watched shapes: no memory for %zu with %zu centres",
		                     watch->shapes, watch->centres);
	gnp_status status = GNP_OK;
	for (size_t i = 0; status == GNP_OK && i < watch->shapes; i++) {
		status = gnp_train_data_watch(data, i, watch->pool, &watch->clouds[i], error);
		if (status == GNP_OK)
			choose_centres(&watch->clouds[i], i, watch->centres, watch->at + i * watch->centres);
	}
	return status;
}

gnp_status gnp_train_watch_open(const struct gnp_train_data *data, const struct gnp_train_recipe *recipe, size_t shapes,
                                size_t centres, const struct gnp_trainable *network, struct gnp_pool *pool,
                                struct gnp_train_watch **out, struct gnp_error *error)
{
	struct gnp_train_watch *watch = calloc(1, sizeof *watch);
	if (!watch)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "watched shapes: no memory");
	*watch = (struct gnp_train_watch){.recipe = *recipe, .network = network, .pool = pool, .shapes = shapes, .centres = centres};
	gnp_status status = fill(watch, data, error);
	if (status == GNP_OK)
		*out = watch;
	else
		gnp_train_watch_close(watch);
	return status;
}

void gnp_train_watch_close(struct gnp_train_watch *watch)
{
	if (!watch)
		return;
	for (size_t i = 0; watch->clouds && i < watch->shapes; i++)
		gnp_train_cloud_clear(&watch->clouds[i]);
	free(watch->clouds);
	free(watch->at);
	free(watch->outcomes);
	free(watch);
}

/* The fit where the point was found, the truth where it came from: as the judge of estimators compares. */
static struct outcome compare(const struct gnp_train_watch *watch, const struct gnp_train_patches *patches, size_t p,
                              const double *coefficients)
{
	double rows[6 * GNP_BASIS_MAX];
	const struct gnp_patch *patch = &patches->patches[p];
	size_t truth = patches->truth_start[p];
	if (patches->truth_start[p + 1] == truth)
		return (struct outcome){.known = false};
	return (struct outcome){
		true, gnp_train_fit_jet(watch->network->basis, coefficients, patch, patch->u[0], patch->v[0], rows),
		patches->truth[truth].jet};
}

/* At most PATCHES_A_CHUNK centres of one shape. */
static gnp_status watch_centres(struct gnp_train_watch *watch, size_t shape, size_t first, size_t count,
                                struct gnp_scratch *scratch, struct gnp_error *error)
{
	const struct gnp_trainable *network = watch->network;
	size_t from = shape * watch->centres + first, size = gnp_basis_size(network->basis);
	struct gnp_train_patches patches;
	double *coefficients = gnp_scratch_take(scratch, count, size * sizeof *coefficients);
	if (!coefficients)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "watched shapes: no memory for %zu patches", count);
	gnp_status status = gnp_train_patches_build(&watch->clouds[shape], &watch->recipe, watch->at + from, count, scratch,
	                                            &patches, error);
	if (status == GNP_OK)
		status = network->forward(network->state, &patches, coefficients, NULL, scratch, error);
	for (size_t p = 0; status == GNP_OK && p < count; p++)
		watch->outcomes[from + p] = compare(watch, &patches, p, coefficients + p * size);
	return status;
}

static gnp_status watch_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                              struct gnp_error *error)
{
	struct gnp_train_watch *watch = context;
	gnp_status status = GNP_OK;
	while (begin < end && status == GNP_OK) {
		size_t shape = begin / watch->centres, first = begin % watch->centres, left = watch->centres - first;
		size_t count = end - begin < left ? end - begin : left;
		status = watch_centres(watch, shape, first, count, scratch, error);
		begin += count;
	}
	return status;
}

static void score_shape(const struct gnp_train_watch *watch, size_t shape, double errors[GNP_SCORES])
{
	static const enum gnp_loss_term terms[GNP_SCORES] = {
		[GNP_SCORE_INVERSE_METRIC] = GNP_LOSS_INVERSE_METRIC, [GNP_SCORE_SECOND_FORM] = GNP_LOSS_SECOND_FORM,
		[GNP_SCORE_GAUSSIAN] = GNP_LOSS_GAUSSIAN, [GNP_SCORE_MEAN] = GNP_LOSS_MEAN};
	struct gnp_loss_sums sums = {{0}, {0}};
	size_t known = 0;
	for (size_t i = 0; i < watch->centres; i++) {
		const struct outcome *outcome = &watch->outcomes[shape * watch->centres + i];
		if (outcome->known)
			gnp_loss_add(&sums, 1, &outcome->jet, &outcome->truth);
		known += outcome->known;
	}
	for (int s = 0; s < GNP_SCORES; s++)
		errors[s] += s == GNP_SCORE_NORMAL ? sums.error[GNP_LOSS_ANGLE] / (2 * (double)known)
		                                   : sqrt(sums.error[terms[s]] / sums.size[terms[s]]);
}

gnp_status gnp_train_watch_run(struct gnp_train_watch *watch, const float *parameters, double errors[GNP_SCORES],
                               struct gnp_error *error)
{
	double sums[GNP_SCORES] = {0};
	gnp_status status = watch->network->load(watch->network->state, parameters, error);
	if (status == GNP_OK)
		status = gnp_pool_run(watch->pool, NULL, watch->shapes * watch->centres, PATCHES_A_CHUNK, watch_chunk, watch, error);
	if (status != GNP_OK)
		return status;
	for (size_t i = 0; i < watch->shapes; i++)
		score_shape(watch, i, sums);
	for (int s = 0; s < GNP_SCORES; s++)
		errors[s] = sums[s] / (double)watch->shapes;
	return GNP_OK;
}
