#include "weights/validate/ablation_weighted.h"

#include <stdlib.h>

#include "core/base/memory.h"
#include "core/base/random.h"
#include "core/cloud/prepare.h"
#include "core/estimators/estimators.h"
#include "core/estimators/weighted_fit.h"
#include "core/network/frame_choice.h"
#include "core/network/weighted_head.h"
#include "core/solids/solid.h"
#include "weights/protocol/protocol.h"

enum { BATCH = GNP_WEIGHTED_BATCH, OUTPUTS = GNP_WEIGHTED_OUTPUTS, POINTS = 4000, SURVEYED = 400 };
static const double noises[] = {0, 0.1, 0.3, 1, 2}; /* in spacings; each body has one of them */

/* A cloud under a model, and the sums of its chunks. */
struct survey {
	const struct gnp_weighted_cloud *cloud;
	size_t stride;
	double *sums; /* (chunks, OUTPUTS) */
};

static void put_first(uint32_t *index, size_t count, uint32_t centre)
{
	size_t at = 0;
	while (at < count && index[at] != centre)
		at++;
	if (at > 0 && at < count) {
		index[at] = index[0];
		index[0] = centre;
	}
}

/* The support as estimation builds it, from a row of the widest search. */
static gnp_status build(const struct gnp_weighted_cloud *cloud, uint32_t centre, uint32_t *index,
                        const double *distance, size_t found, struct gnp_support *support, struct gnp_error *error)
{
	struct gnp_ladder ladder;
	put_first(index, found, centre);
	gnp_support_look(&cloud->points, centre, index, found < GNP_LADDER_REACH ? found : GNP_LADDER_REACH, &ladder);
	unsigned step = gnp_frame_choose(cloud->network, &ladder);
	if (gnp_support_build(&cloud->points, centre, &ladder, step, index, distance, found, 0, support))
		return GNP_OK;
	return gnp_error_set(error, GNP_DEGENERATE, "ablation: the points about point %u coincide", (unsigned)centre);
}

static gnp_status survey_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                               struct gnp_error *error)
{
	const struct survey *survey = context;
	const struct gnp_weighted_cloud *cloud = survey->cloud;
	size_t count = end - begin, reach = GNP_SUPPORT_POINTS < cloud->count ? GNP_SUPPORT_POINTS : cloud->count;
	struct gnp_support *supports[BATCH];
	struct gnp_neighborhoods found;
	struct gnp_weighted_pass pass;
	uint32_t centres[BATCH] = {0};
	for (size_t i = 0; i < count; i++) {
		centres[i] = (uint32_t)((begin + i) * survey->stride);
		supports[i] = gnp_scratch_take(scratch, 1, sizeof *supports[i]);
		if (!supports[i])
			return gnp_no_memory("ablation", count, "supports", error);
	}
	gnp_status status =
		gnp_neighborhoods_find(cloud->points.neighbors, centres, count, reach, 1, reach, scratch, &found, error);
	for (size_t i = 0; i < count && status == GNP_OK; i++)
		status = build(cloud, centres[i], found.index + found.start[i], found.distance + found.start[i],
		               found.start[i + 1] - found.start[i], supports[i], error);
	if (status == GNP_OK)
		status = gnp_weighted_forward(cloud->network, (const struct gnp_support *const *)supports, count, &pass,
		                              scratch, error);
	for (size_t i = 0; i < count * OUTPUTS && status == GNP_OK; i++)
		survey->sums[begin / BATCH * OUTPUTS + i % OUTPUTS] += (double)pass.outputs[i];
	return status;
}

/* Adds the outputs at `surveyed` points of a prepared cloud to total (OUTPUTS). */
static gnp_status survey_prepared(const struct gnp_model *model, const struct gnp_prepared *prepared, size_t surveyed,
                                  struct gnp_pool *pool, double *total, struct gnp_error *error)
{
	const struct gnp_estimator *estimator = gnp_estimator_at(GNP_ESTIMATOR_GNP);
	const struct gnp_fit_cloud cloud = {.count = prepared->count,
	                                    .points = prepared->points,
	                                    .normals = prepared->normals,
	                                    .neighbors = prepared->neighbors};
	const struct gnp_fit_options options = {.model = model};
	size_t chunks = (surveyed + BATCH - 1) / BATCH;
	void *state = NULL;
	gnp_status status = estimator->prepare(&cloud, &options, pool, NULL, &state, error);
	if (status != GNP_OK)
		return status;
	struct survey survey = {estimator->weighted(state), prepared->count / surveyed,
	                        gnp_array_zero(chunks * OUTPUTS, sizeof(double))};
	status = survey.sums ? gnp_pool_run(pool, NULL, surveyed, BATCH, survey_chunk, &survey, error)
	                     : gnp_no_memory("ablation", surveyed, "supports", error);
	for (size_t i = 0; i < chunks * OUTPUTS && status == GNP_OK; i++)
		total[i % OUTPUTS] += survey.sums[i];
	free(survey.sums);
	estimator->release(state);
	return status;
}

static gnp_status survey_body(const struct gnp_model *model, int kind, size_t points, struct gnp_pool *pool,
                              double *total, size_t *count, struct gnp_error *error)
{
	const uint64_t seed = GNP_SEED_WATCH + (UINT64_C(1) << 50) + (uint64_t)kind;
	const struct gnp_solid_options options = {.seed = seed,
	                                          .kind = kind,
	                                          .count = points < POINTS ? points : POINTS,
	                                          .sampling = kind % GNP_SOLID_SAMPLING_COUNT};
	struct gnp_solid_sample sample;
	struct gnp_prepared prepared;
	struct gnp_random random;
	gnp_status status = gnp_solid_sample_create(&options, pool, NULL, &sample, error);
	if (status != GNP_OK)
		return status;
	double noise = noises[kind * 2 % (int)(sizeof noises / sizeof *noises)] * sample.spacing;
	gnp_random_seed(&random, seed, 1);
	for (size_t i = 0; i < 3 * sample.count; i++)
		sample.points[i] += noise * gnp_random_normal(&random);
	const struct gnp_cloud cloud = {sample.count, sample.points, NULL};
	size_t surveyed = sample.count < SURVEYED ? sample.count : SURVEYED;
	status = gnp_prepare(&cloud, pool, NULL, &prepared, error);
	if (status == GNP_OK) {
		status = survey_prepared(model, &prepared, surveyed, pool, total, error);
		gnp_prepared_clear(&prepared);
	}
	gnp_solid_sample_clear(&sample);
	*count += surveyed;
	return status;
}

gnp_status gnp_ablation_weighted_outputs(const struct gnp_model *model, size_t points, struct gnp_pool *pool,
                                         float *outputs, struct gnp_error *error)
{
	double total[OUTPUTS] = {0};
	size_t count = 0;
	gnp_status status = GNP_OK;
	for (int kind = 0; kind < GNP_SOLID_KIND_COUNT && status == GNP_OK; kind++)
		status = survey_body(model, kind, points, pool, total, &count, error);
	for (size_t i = 0; i < OUTPUTS && status == GNP_OK; i++)
		outputs[i] = (float)(total[i] / (double)count);
	return status;
}
