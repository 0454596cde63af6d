#include "weights/validate/ablation.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/base/memory.h"
#include "core/base/random.h"
#include "core/cloud/prepare.h"
#include "core/estimators/projection_fit.h"
#include "core/estimators/sheets.h"
#include "weights/protocol/protocol.h"
#include "weights/validate/ablation_weighted.h"
#include "weights/validate/temporary.h"

enum { BATCH = 16, SHAPES = 2, SURVEYED = 4000, PATH_SIZE = GNP_TEMPORARY_PATH + 96 };

static const struct part {
	const char *name, *help;
} parts[GNP_ABLATION_PARTS] = {
#define GNP_ABLATION_ROW(id, name, help) {name, help},
	GNP_ABLATION_TABLE(GNP_ABLATION_ROW)
#undef GNP_ABLATION_ROW
};

const char *gnp_ablation_name(unsigned part)
{
	return part < GNP_ABLATION_PARTS ? parts[part].name : NULL;
}

const char *gnp_ablation_help(unsigned part)
{
	return part < GNP_ABLATION_PARTS ? parts[part].help : NULL;
}

/* ---- Mean outputs ---- */

/* A cloud under a model, and the sums of its chunks. */
struct survey {
	const struct gnp_model *model;
	struct gnp_prepared prepared;
	unsigned char *outlier; /* (count) in the prepared order */
	size_t reach, outputs, stride;
	double *sums; /* (chunks, outputs) */
};

static size_t usable(const void *context, const struct gnp_patch *patch, size_t most, uint32_t *positions)
{
	const struct survey *survey = context;
	return gnp_sheets_usable(survey->prepared.normals, survey->outlier, patch, most, positions);
}

/* Some patches as estimation makes them, the first about the point `begin` of those surveyed. */
static gnp_status build_patches(const struct survey *survey, size_t begin, size_t count, struct gnp_patch *patches,
                                struct gnp_scratch *scratch, struct gnp_error *error)
{
	const struct gnp_recipe *recipe = &survey->model->recipe;
	const struct gnp_patch_source source = {.points = survey->prepared.points,
	                                        .normals = survey->prepared.normals,
	                                        .k = recipe->k,
	                                        .delta0_ratio = recipe->delta0_ratio,
	                                        .delta0 = recipe->delta0,
	                                        .height_scale = recipe->height_scale,
	                                        .one_sheet = true};
	struct gnp_neighborhoods found;
	uint32_t centres[BATCH];
	for (size_t i = 0; i < count; i++)
		centres[i] = (uint32_t)((begin + i) * survey->stride);
	gnp_status status = gnp_neighborhoods_find(survey->prepared.neighbors, centres, count, survey->reach, 1,
	                                           survey->reach, scratch, &found, error);
	if (status != GNP_OK)
		return status;
	double *coordinates = gnp_scratch_take(scratch, found.start[count], 3 * sizeof *coordinates);
	if (!coordinates)
		return gnp_no_memory("ablation", count, "patches", error);
	for (size_t p = 0; p < count && status == GNP_OK; p++) {
		size_t length = found.start[p + 1] - found.start[p];
		double *own = coordinates + 3 * found.start[p];
		status =
			gnp_patch_build(&source, &found, p, centres[p], own, own + length, own + 2 * length, &patches[p], error);
	}
	return status;
}

static gnp_status survey_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                               struct gnp_error *error)
{
	struct survey *survey = context;
	const struct gnp_network *network = survey->model->network;
	double *sum = survey->sums + begin / BATCH * survey->outputs;
	struct gnp_patch patches[BATCH];
	struct gnp_projected projected;
	gnp_status status = build_patches(survey, begin, end - begin, patches, scratch, error);
	if (status == GNP_OK)
		status = gnp_projected_describe(&network->architecture, patches, end - begin, usable, survey, &projected,
		                                scratch, error);
	if (status == GNP_OK)
		status = gnp_projected_solve(network, false, &projected, scratch, error);
	for (size_t i = 0; i < (end - begin) * survey->outputs && status == GNP_OK; i++)
		sum[i % survey->outputs] += (double)projected.outputs[i];
	return status;
}

static gnp_status survey_prepared(struct survey *survey, const struct gnp_sample *sample, size_t surveyed,
                                  struct gnp_pool *pool, double *total, struct gnp_error *error)
{
	size_t chunks = (surveyed + BATCH - 1) / BATCH;
	survey->outlier = gnp_array_zero(sample->count, 1);
	survey->sums = gnp_array_zero(chunks * survey->outputs, sizeof *survey->sums);
	if (!survey->outlier || !survey->sums)
		return gnp_no_memory("ablation", sample->count, "points", error);
	for (size_t i = 0; i < sample->count; i++)
		survey->outlier[i] = sample->outlier[survey->prepared.order[i]];
	gnp_status status = gnp_pool_run(pool, NULL, surveyed, BATCH, survey_chunk, survey, error);
	for (size_t i = 0; i < chunks * survey->outputs && status == GNP_OK; i++)
		total[i % survey->outputs] += survey->sums[i];
	return status;
}

/* Adds the outputs at `surveyed` points of a sample to total (outputs). */
static gnp_status survey_sample(const struct gnp_model *model, const struct gnp_sample *sample, size_t surveyed,
                                struct gnp_pool *pool, double *total, struct gnp_error *error)
{
	struct survey survey = {
		.model = model, .outputs = gnp_projection_outputs(&model->architecture), .stride = sample->count / surveyed};
	const struct gnp_cloud cloud = {sample->count, sample->points, sample->normals};
	size_t reach = gnp_projection_reach(&model->architecture);
	reach = reach > model->recipe.k * 3 / 2 ? reach : model->recipe.k * 3 / 2;
	survey.reach = reach < sample->count ? reach : sample->count;
	gnp_status status = gnp_prepare(&cloud, pool, NULL, &survey.prepared, error);
	if (status != GNP_OK)
		return status;
	status = survey_prepared(&survey, sample, surveyed, pool, total, error);
	free(survey.outlier);
	free(survey.sums);
	gnp_prepared_clear(&survey.prepared);
	return status;
}

/* Displaced as in one regime, which is passed over when it is not of the kind that the model was trained for. */
static gnp_status survey_regime(const struct gnp_model *model, const struct gnp_regime_info *regime,
                                struct gnp_sample *sample, uint64_t seed, size_t surveyed, struct gnp_pool *pool,
                                double *total, size_t *count, struct gnp_error *error)
{
	const struct gnp_sample_options options = {.count = sample->count,
	                                           .seed = seed,
	                                           .noise = regime->noise,
	                                           .outlier_fraction = regime->outlier_fraction,
	                                           .outlier_noise = regime->outlier_noise};
	gnp_status status = gnp_sample_displace(&options, sample, error);
	*count += surveyed;
	return status == GNP_OK ? survey_sample(model, sample, surveyed, pool, total, error) : status;
}

/* Whether a model's regime is the kind of one of the protocol's: its word is the beginning of that one's name. */
static bool is_of(const char *regime, const struct gnp_regime_info *info)
{
	return strncmp(info->name, regime, strlen(regime)) == 0;
}

static bool is_of_none(const char *regime)
{
	for (int r = 0; r < GNP_REGIMES; r++)
		if (is_of(regime, gnp_regime_info((enum gnp_regime)r)))
			return false;
	return true;
}

static gnp_status survey_shape(const struct gnp_model *model, unsigned which, size_t points, struct gnp_pool *pool,
                               double *total, size_t *count, struct gnp_error *error)
{
	const uint64_t seed = GNP_SEED_WATCH + (UINT64_C(1) << 50) + which; /* none of those that are watched by */
	const struct gnp_sample_options clean = {.count = points, .seed = seed};
	size_t surveyed = points < SURVEYED ? points : SURVEYED;
	struct gnp_shape *shape;
	struct gnp_sample sample;
	gnp_status status = gnp_shape_create("radial", seed, gnp_radial_degree(1 + 4 * (size_t)which), &shape, error);
	if (status != GNP_OK)
		return status;
	status = gnp_sample_create(shape, &clean, pool, NULL, &sample, error);
	gnp_shape_free(shape);
	if (status != GNP_OK)
		return status;
	for (int r = 0; r < GNP_REGIMES && status == GNP_OK; r++)
		if (is_of(model->regime, gnp_regime_info((enum gnp_regime)r)) || is_of_none(model->regime))
			status = survey_regime(model, gnp_regime_info((enum gnp_regime)r), &sample, seed, surveyed, pool, total,
			                       count, error);
	gnp_sample_clear(&sample);
	return status;
}

gnp_status gnp_ablation_mean_outputs(const struct gnp_model *model, size_t points, struct gnp_pool *pool,
                                     float *outputs, struct gnp_error *error)
{
	size_t width = gnp_projection_outputs(&model->architecture), count = 0;
	if (model->architecture.head == GNP_HEAD_WEIGHTED)
		return gnp_ablation_weighted_outputs(model, points, pool, outputs, error);
	double *total = gnp_array_zero(width, sizeof *total);
	gnp_status status = total ? GNP_OK : gnp_no_memory("ablation", width, "outputs", error);
	for (unsigned which = 0; which < SHAPES && status == GNP_OK; which++)
		status = survey_shape(model, which, points, pool, total, &count, error);
	for (size_t i = 0; i < width && status == GNP_OK; i++)
		outputs[i] = (float)(total[i] / (double)count);
	free(total);
	return status;
}

/* ---- Altered weights ---- */

bool gnp_ablation_has(const struct gnp_model *model, enum gnp_ablation_part part)
{
	bool weighted = model->architecture.head == GNP_HEAD_WEIGHTED;
	bool trunk = part == GNP_ABLATION_REMOVED || part == GNP_ABLATION_RANDOM;
	if (part == GNP_ABLATION_NONE)
		return true;
	if (trunk && model->architecture.trunk == GNP_TRUNK_NONE)
		return false;
	return weighted || (part != GNP_ABLATION_WEIGHTS && model->architecture.head == GNP_HEAD_PROJECTION);
}

/* Of a layer whose first inputs are the trunk's values. */
static void remove_columns(const struct gnp_model *model, const char *layer, float *parameters)
{
	const struct gnp_parameter_row *row = gnp_layout_find(&model->network->layout, layer);
	for (size_t i = 0; row && i < row->shape[0]; i++)
		memset(parameters + row->offset + i * row->shape[1], 0, model->architecture.width * sizeof *parameters);
}

static void remove_trunk(const struct gnp_model *model, float *parameters)
{
	remove_columns(model, "head.0.weight", parameters);
	remove_columns(model, "node.0.weight", parameters);
}

/* Whether a tensor is of the layers and kernels that see the nodes, not of what goes by what these say. */
static bool is_of_trunk(const char *name)
{
	static const char *const others[] = {"head.", "node.", "frame."};
	for (size_t i = 0; i < sizeof others / sizeof *others; i++)
		if (strncmp(name, others[i], strlen(others[i])) == 0)
			return false;
	return true;
}

static void draw_trunk(const struct gnp_model *model, float *parameters)
{
	const struct gnp_layout *layout = &model->network->layout;
	struct gnp_random random;
	gnp_random_seed(&random, GNP_SEED_REAL, 0);
	for (size_t r = 0; r < layout->rows; r++) {
		const struct gnp_parameter_row *row = &layout->row[r];
		double squares = 0;
		if (!is_of_trunk(row->name))
			continue;
		for (size_t i = 0; i < row->count; i++)
			squares += (double)parameters[row->offset + i] * (double)parameters[row->offset + i];
		for (size_t i = 0; i < row->count; i++)
			parameters[row->offset + i] = (float)(sqrt(squares / (double)row->count) * gnp_random_normal(&random));
	}
}

static gnp_status fix_outputs(const struct gnp_model *model, size_t points, struct gnp_pool *pool, float *parameters,
                              struct gnp_error *error)
{
	const struct gnp_layout *layout = &model->network->layout;
	const struct gnp_parameter_row *weight = gnp_layout_find(layout, "head.4.weight");
	const struct gnp_parameter_row *bias = gnp_layout_find(layout, "head.4.bias");
	memset(parameters + weight->offset, 0, weight->count * sizeof *parameters);
	return gnp_ablation_mean_outputs(model, points, pool, parameters + bias->offset, error);
}

/* Logits of 30 throughout. */
static void weigh_alike(const struct gnp_model *model, float *parameters)
{
	const struct gnp_layout *layout = &model->network->layout;
	const struct gnp_parameter_row *weight = gnp_layout_find(layout, "node.2.weight");
	memset(parameters + weight->offset, 0, weight->count * sizeof *parameters);
	parameters[gnp_layout_find(layout, "node.2.bias")->offset] = 30;
}

static gnp_status save_altered(const struct gnp_model *model, enum gnp_ablation_part part, size_t points,
                               struct gnp_pool *pool, const char *path, struct gnp_error *error)
{
	size_t total = model->network->layout.total;
	float *parameters = gnp_array_new(total, sizeof *parameters);
	gnp_status status = GNP_OK;
	if (!parameters)
		return gnp_no_memory("ablation", total, "parameters", error);
	memcpy(parameters, model->network->parameters, total * sizeof *parameters);
	if (part == GNP_ABLATION_REMOVED)
		remove_trunk(model, parameters);
	else if (part == GNP_ABLATION_RANDOM)
		draw_trunk(model, parameters);
	else if (part == GNP_ABLATION_WEIGHTS)
		weigh_alike(model, parameters);
	else if (part == GNP_ABLATION_CONSTANT)
		status = fix_outputs(model, points, pool, parameters, error);
	const struct gnp_model_source source = {.architecture = model->architecture,
	                                        .recipe = model->recipe,
	                                        .regime = model->regime,
	                                        .parameters = parameters};
	if (status == GNP_OK)
		status = gnp_model_save(path, &source, error);
	free(parameters);
	return status;
}

static void path_of(const char *folder, const struct gnp_model *model, char path[PATH_SIZE])
{
	snprintf(path, PATH_SIZE, "%s/%s.safetensors", folder, model->name);
}

/* Models come from folders, so there is one for as long as it takes. */
gnp_status gnp_ablation_models(const struct gnp_models *models, enum gnp_ablation_part part, size_t points,
                               struct gnp_pool *pool, struct gnp_models **out, struct gnp_error *error)
{
	char folder[GNP_TEMPORARY_PATH], path[PATH_SIZE];
	gnp_status status = gnp_temporary_folder(folder, error);
	if (status != GNP_OK)
		return status;
	for (size_t i = 0; i < gnp_models_count(models) && status == GNP_OK; i++) {
		const struct gnp_model *model = gnp_models_at(models, i);
		path_of(folder, model, path);
		status = gnp_ablation_has(model, part) ? save_altered(model, part, points, pool, path, error) : GNP_OK;
	}
	if (status == GNP_OK)
		status = gnp_models_load(folder, out, error);
	for (size_t i = 0; i < gnp_models_count(models); i++) {
		path_of(folder, gnp_models_at(models, i), path);
		unlink(path);
	}
	rmdir(folder);
	return status;
}
