#include "weights/protocol/protocol.h"

#include <math.h>
#include <stdlib.h>

#include "core/base/memory.h"
#include "core/base/random.h"
#include "core/cloud/patch.h"

/* Stream of a subject's seed; the shape's own are below 2^40, the sampling's have 1, 2 and 3 in the top byte. */
static const uint64_t STREAM_CENTRES = UINT64_C(4) << 56;

static const unsigned RADIAL_DEGREES[GNP_RADIAL_DEGREES] = {3, 6, 8, 10, 12, 15, 18, 22};
enum { RESOLVED_K = 30, SKIPS_MAX = 40 };

bool gnp_seed_is_validation(uint64_t seed)
{
	return seed >= GNP_SEED_VALIDATION && seed < 2 * GNP_SEED_VALIDATION;
}

bool gnp_seed_is_watch(uint64_t seed)
{
	return seed >= GNP_SEED_WATCH && seed < GNP_SEED_VALIDATION;
}

gnp_status gnp_seed_check_training(uint64_t seed, struct gnp_error *error)
{
	if (seed < GNP_SEED_WATCH)
		return GNP_OK;
	return gnp_error_set(error, GNP_INVALID_ARGUMENT, "training seed: got %llu, need less than %llu (those that judge begin there)",
	                     (unsigned long long)seed, (unsigned long long)GNP_SEED_WATCH);
}

const char *gnp_family_name(enum gnp_family family)
{
	static const char *const names[GNP_FAMILIES] = {"radial", "toroidal"};
	return (unsigned)family < GNP_FAMILIES ? names[family] : NULL;
}

const struct gnp_regime_info *gnp_regime_info(enum gnp_regime regime)
{
	static const struct gnp_regime_info regimes[GNP_REGIMES] = {
		[GNP_REGIME_CLEAN_30] = {"clean-30", "no noise, k = 30", "clean_30k", 30, 0, 0, 0},
		[GNP_REGIME_CLEAN_50] = {"clean-50", "no noise, k = 50", "clean_50k", 50, 0, 0, 0},
		[GNP_REGIME_OUTLIER_50] = {"outlier-50", "a tenth of the points displaced with sigma = 5e-3, k = 50", "outlier_50k", 50, 0, 0.1, 5e-3},
		[GNP_REGIME_NOISE_70] = {"noise-70", "every point displaced with sigma = 1e-3, k = 70", "noise_70k", 70, 1e-3, 0, 0},
	};
	return (unsigned)regime < GNP_REGIMES ? &regimes[regime] : NULL;
}

unsigned gnp_radial_degree(size_t i)
{
	return RADIAL_DEGREES[i % GNP_RADIAL_DEGREES];
}

struct gnp_protocol gnp_protocol_full(void)
{
	return (struct gnp_protocol){.points = 100000, .shapes = 40, .centres = 2000};
}

struct gnp_protocol gnp_protocol_quick(void)
{
	return (struct gnp_protocol){.points = 100000, .shapes = 4, .centres = 500};
}

static double sharpness(const struct gnp_shape *shape, const struct gnp_sample *sample)
{
	double epsilon = GNP_PATCH_TAU * sqrt(RESOLVED_K * gnp_shape_area(shape) / (M_PI * (double)sample->count));
	double largest = 0;
	for (size_t i = 0; i < 2 * sample->count; i++)
		largest = fmax(largest, fabs(sample->principal_curvatures[i]));
	return largest * epsilon;
}

/* Degrees in turn; fewer shapes than degrees take evenly spaced ones, so that a quick run sees rough shapes too. */
static unsigned radial_degree(const struct gnp_protocol *protocol, size_t draw)
{
	size_t stride = protocol->shapes < GNP_RADIAL_DEGREES ? GNP_RADIAL_DEGREES / protocol->shapes : 1;
	return gnp_radial_degree(draw * stride);
}

static gnp_status draw_one(const struct gnp_protocol *protocol, size_t draw, struct gnp_pool *pool,
                           struct gnp_subject *subject, struct gnp_error *error)
{
	struct gnp_shape *shape;
	subject->seed = GNP_SEED_VALIDATION | (uint64_t)subject->family << 40 | draw;
	subject->degree = subject->family == GNP_FAMILY_RADIAL ? radial_degree(protocol, draw) : 0;
	gnp_status status = gnp_shape_create(gnp_family_name(subject->family), subject->seed, subject->degree, &shape, error);
	if (status != GNP_OK)
		return status;
	const struct gnp_sample_options clean = {.count = protocol->points, .seed = subject->seed};
	status = gnp_sample_create(shape, &clean, pool, NULL, &subject->sample, error);
	if (status == GNP_OK)
		subject->sharpness = sharpness(shape, &subject->sample);
	gnp_shape_free(shape);
	return status;
}

static bool judged(const struct gnp_subject *subject)
{
	return subject->family != GNP_FAMILY_TOROIDAL || subject->sharpness <= 1;
}

gnp_status gnp_subject_draw(const struct gnp_protocol *protocol, struct gnp_draws *draws, struct gnp_pool *pool,
                            struct gnp_subject *subject, struct gnp_error *error)
{
	struct gnp_subject next = {0};
	gnp_status status = GNP_OK;
	for (int skips = 0; skips == 0 || !judged(&next); skips++) {
		gnp_subject_clear(&next);
		if (skips > SKIPS_MAX)
			return gnp_error_set(error, GNP_INVALID_ARGUMENT, "points: got %zu, too few to resolve %d %s draws in a row",
			                     protocol->points, SKIPS_MAX, gnp_family_name(draws->family));
		next.family = draws->family;
		status = draw_one(protocol, draws->drawn++, pool, &next, error);
		if (status != GNP_OK)
			return status;
	}
	next.centre_count = protocol->centres;
	next.centres = gnp_array_new(protocol->points, sizeof *next.centres); /* all points, for the shuffle */
	if (!next.centres) {
		gnp_subject_clear(&next);
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "centres: no memory for %zu points", protocol->points);
	}
	draws->accepted++;
	*subject = next;
	return GNP_OK;
}

/* The first steps of a shuffle of all that is no outlier. */
static gnp_status choose_centres(struct gnp_subject *subject, struct gnp_error *error)
{
	size_t candidates = 0;
	for (size_t i = 0; i < subject->sample.count; i++)
		if (!subject->sample.outlier[i])
			subject->centres[candidates++] = (uint32_t)i;
	if (candidates < subject->centre_count)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "centres: got %zu, the cloud has %zu points that are no outliers",
		                     subject->centre_count, candidates);
	struct gnp_random random;
	gnp_random_seed(&random, subject->seed, STREAM_CENTRES);
	for (size_t i = 0; i < subject->centre_count; i++) {
		size_t other = i + gnp_random_below(&random, candidates - i);
		uint32_t chosen = subject->centres[other];
		subject->centres[other] = subject->centres[i];
		subject->centres[i] = chosen;
	}
	return GNP_OK;
}

gnp_status gnp_subject_enter(struct gnp_subject *subject, enum gnp_regime regime, struct gnp_error *error)
{
	const struct gnp_regime_info *info = gnp_regime_info(regime);
	const struct gnp_sample_options options = {.count = subject->sample.count, .seed = subject->seed, .noise = info->noise,
	                                           .outlier_fraction = info->outlier_fraction,
	                                           .outlier_noise = info->outlier_noise};
	gnp_status status = gnp_sample_displace(&options, &subject->sample, error);
	return status == GNP_OK ? choose_centres(subject, error) : status;
}

void gnp_subject_clear(struct gnp_subject *subject)
{
	gnp_sample_clear(&subject->sample);
	free(subject->centres);
	*subject = (struct gnp_subject){0};
}
