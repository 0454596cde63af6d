#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/check.h"
#include "core/base/memory.h"
#include "core/base/random.h"
#include "core/shapes/eliminate.h"
#include "core/shapes/shape_family.h"
#include "core/shapes/shapes.h"

/* Streams of the sampling seed; the item's number is in the low bits. */
enum { STREAM_CANDIDATE = 1, STREAM_NOISE, STREAM_OUTLIER };

struct sampling {
	const struct gnp_shape *shape;
	const struct gnp_sample_options *options;
	size_t candidates;
	float *places;   /* (candidates, 3) */
	uint32_t *kept;  /* (count) candidates that became samples */
	uint32_t *order; /* (count) for the choice of outliers */
	struct gnp_sample sample;
};

static void random_for(const struct gnp_sample_options *options, int purpose, uint64_t item, struct gnp_random *random)
{
	gnp_random_seed(random, options->seed, (uint64_t)purpose << 56 | item);
}

/* ---- Options ---- */

static gnp_status check_deviation(const char *name, double value, struct gnp_error *error)
{
	if (isfinite(value) && value >= 0)
		return GNP_OK;
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "%s: got %g, need a finite number of at least 0", name, value);
}

static gnp_status check_options(const struct gnp_sample_options *options, struct gnp_error *error)
{
	static const size_t COUNT_MAX = (size_t)1 << 31;
	if (options->count == 0 || options->count > COUNT_MAX)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "count: got %zu, need 1..%zu", options->count, COUNT_MAX);
	gnp_status status = gnp_check_number("outlier_fraction", options->outlier_fraction, 0, 1, error);
	if (status == GNP_OK)
		status = check_deviation("noise", options->noise, error);
	return status == GNP_OK ? check_deviation("outlier_noise", options->outlier_noise, error) : status;
}

/* ---- Memory ---- */

static gnp_status sampling_reserve(struct sampling *s, struct gnp_error *error)
{
	struct gnp_sample *sample = &s->sample;
	size_t count = s->options->count, row = sizeof(double);
	sample->count = count;
	sample->points = gnp_array_new(count, 3 * row);
	sample->exact = gnp_array_new(count, 3 * row);
	sample->normals = gnp_array_new(count, 3 * row);
	sample->mean_curvature = gnp_array_new(count, row);
	sample->gaussian_curvature = gnp_array_new(count, row);
	sample->principal_curvatures = gnp_array_new(count, 2 * row);
	sample->second_form = gnp_array_new(count, 9 * row);
	sample->outlier = gnp_array_zero(count, 1);
	s->places = gnp_array_new(s->candidates, 3 * sizeof *s->places);
	s->kept = gnp_array_new(count, sizeof *s->kept);
	s->order = gnp_array_new(count, sizeof *s->order);
	if (sample->points && sample->exact && sample->normals && sample->mean_curvature && sample->gaussian_curvature &&
	    sample->principal_curvatures && sample->second_form && sample->outlier && s->places && s->kept && s->order)
		return GNP_OK;
	return gnp_error_set(error, GNP_OUT_OF_MEMORY, "sample: no memory for %zu points", count);
}

void gnp_sample_clear(struct gnp_sample *sample)
{
	free(sample->points);
	free(sample->exact);
	free(sample->normals);
	free(sample->mean_curvature);
	free(sample->gaussian_curvature);
	free(sample->principal_curvatures);
	free(sample->second_form);
	free(sample->outlier);
	memset(sample, 0, sizeof *sample);
}

/* ---- Candidates: one in each of equal shares of the area, anywhere in its triangle ---- */

/* Parameters of candidate i; a function of the seed and i alone, so they need not be stored. */
static void candidate_draw(const struct sampling *s, size_t i, double parameters[3])
{
	struct gnp_random random;
	random_for(s->options, STREAM_CANDIDATE, i, &random);
	double t = ((double)i + gnp_random_uniform(&random)) / (double)s->candidates;
	double a = gnp_random_uniform(&random), b = gnp_random_uniform(&random);
	gnp_shape_mesh_pick(&s->shape->mesh, t, a, b, parameters);
}

enum { BATCH = 64 };

static gnp_status candidates_place(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                   struct gnp_error *error)
{
	struct sampling *s = context;
	(void)scratch;
	(void)error;
	for (size_t first = begin; first < end; first += BATCH) {
		double parameters[3 * BATCH], points[3 * BATCH];
		size_t some = end - first < BATCH ? end - first : BATCH;
		for (size_t i = 0; i < some; i++)
			candidate_draw(s, first + i, parameters + 3 * i);
		s->shape->family->place(s->shape, some, parameters, points);
		for (size_t i = 0; i < 3 * some; i++)
			s->places[3 * first + i] = (float)points[i];
	}
	return GNP_OK;
}

/* ---- Geometry and noise ---- */

static void sample_store(struct gnp_sample *sample, size_t i, const struct gnp_geometry *geometry)
{
	memcpy(sample->exact + 3 * i, geometry->point, sizeof geometry->point);
	memcpy(sample->normals + 3 * i, geometry->normal, sizeof geometry->normal);
	memcpy(sample->principal_curvatures + 2 * i, geometry->principal, sizeof geometry->principal);
	memcpy(sample->second_form + 9 * i, geometry->second_form, sizeof geometry->second_form);
	sample->mean_curvature[i] = geometry->mean;
	sample->gaussian_curvature[i] = geometry->gaussian;
}

static void sample_displace(const struct gnp_sample_options *options, struct gnp_sample *sample, size_t i)
{
	double deviation = sample->outlier[i] ? options->outlier_noise : options->noise;
	struct gnp_random random;
	random_for(options, STREAM_NOISE, i, &random);
	for (size_t c = 0; c < 3; c++)
		sample->points[3 * i + c] = sample->exact[3 * i + c] + deviation * gnp_random_normal(&random);
}

static gnp_status samples_evaluate(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                   struct gnp_error *error)
{
	struct sampling *s = context;
	(void)scratch;
	(void)error;
	for (size_t first = begin; first < end; first += BATCH) {
		double parameters[3 * BATCH];
		struct gnp_geometry geometry[BATCH];
		size_t some = end - first < BATCH ? end - first : BATCH;
		for (size_t i = 0; i < some; i++)
			candidate_draw(s, s->kept[first + i], parameters + 3 * i);
		s->shape->family->evaluate(s->shape, some, parameters, geometry);
		for (size_t i = 0; i < some; i++) {
			sample_store(&s->sample, first + i, &geometry[i]);
			sample_displace(s->options, &s->sample, first + i);
		}
	}
	return GNP_OK;
}

/* Marks the nearest whole number to fraction * count, by the first steps of a shuffle. order: (count), overwritten. */
static void outliers_choose(const struct gnp_sample_options *options, uint32_t *order, unsigned char *outlier)
{
	size_t count = options->count, wanted = (size_t)(options->outlier_fraction * (double)count + 0.5);
	struct gnp_random random;
	random_for(options, STREAM_OUTLIER, 0, &random);
	for (size_t i = 0; i < count; i++)
		order[i] = (uint32_t)i;
	for (size_t i = 0; i < wanted; i++) {
		size_t other = i + gnp_random_below(&random, count - i);
		uint32_t chosen = order[other];
		order[other] = order[i];
		outlier[chosen] = 1;
	}
}

static gnp_status sampling_run(struct sampling *s, struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error)
{
	const struct gnp_shape_mesh *mesh = &s->shape->mesh;
	size_t count = s->options->count;
	gnp_status status = sampling_reserve(s, error);
	if (status == GNP_OK)
		status = gnp_pool_run(pool, task, s->candidates, 64 * BATCH, candidates_place, s, error);
	if (status == GNP_OK)
		status = gnp_eliminate(s->places, s->candidates, count, mesh->area[mesh->triangles], pool, task, s->kept, error);
	if (status != GNP_OK)
		return status;
	outliers_choose(s->options, s->order, s->sample.outlier);
	return gnp_pool_run(pool, task, count, 16 * BATCH, samples_evaluate, s, error);
}

/* Five candidates a sample; a few more for tiny counts, fewer where 32-bit indices end. */
static size_t candidate_count(size_t count)
{
	size_t candidates = 5 * count + 64;
	return candidates < UINT32_MAX ? candidates : UINT32_MAX - 1;
}

gnp_status gnp_sample_create(const struct gnp_shape *shape, const struct gnp_sample_options *options,
                             struct gnp_pool *pool, struct gnp_task *task, struct gnp_sample *out,
                             struct gnp_error *error)
{
	gnp_status status = check_options(options, error);
	if (status != GNP_OK)
		return status;
	struct sampling s = {.shape = shape, .options = options, .candidates = candidate_count(options->count)};
	status = sampling_run(&s, pool, task, error);
	free(s.places);
	free(s.kept);
	free(s.order);
	if (status == GNP_OK)
		*out = s.sample;
	else
		gnp_sample_clear(&s.sample);
	return status;
}

gnp_status gnp_sample_displace(const struct gnp_sample_options *options, struct gnp_sample *sample, struct gnp_error *error)
{
	gnp_status status = check_options(options, error);
	if (status != GNP_OK)
		return status;
	if (options->count != sample->count)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "count: got %zu, the sample has %zu", options->count,
		                     sample->count);
	uint32_t *order = gnp_array_new(sample->count, sizeof *order);
	if (!order)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "sample: no memory for %zu points", sample->count);
	memset(sample->outlier, 0, sample->count);
	outliers_choose(options, order, sample->outlier);
	free(order);
	for (size_t i = 0; i < sample->count; i++)
		sample_displace(options, sample, i);
	return GNP_OK;
}
