#include "weights/validate/real_body.h"

#include <math.h>
#include <stdio.h>

#include "core/base/memory.h"
#include "core/base/random.h"
#include "core/shapes/shapes.h"
#include "core/solids/solid.h"

/* noise: deviation on every coordinate, in mean spacings sqrt(area / count). */
static const struct smooth {
	const char *name, *shape;
	size_t count;
	double noise;
	bool open;
} smooth[] = {
	{"torus", "torus", 200, 0, false},
	{"torus", "torus", 2000, 0.3, false},
	{"saddle", "saddle", 10000, 0, true},
	{"saddle", "saddle", 10000, 0.3, true},
	{"cylinder", "cylinder", 10000, 0, true},
	{"cylinder", "cylinder", 10000, 1, true},
	{"bumpy torus", "bumpy_torus", 20000, 1, false},
};

static const struct creased {
	const char *name;
	int sampling;
	double noise;
	bool edges; /* points near them are judged too */
} creased[] = {
	{"even", GNP_SOLID_EVEN, 0, false},
	{"even, edges too", GNP_SOLID_EVEN, 0, true},
	{"random, noise 0.3", GNP_SOLID_RANDOM, 0.3, false},
	{"gradient, noise 0.1", GNP_SOLID_GRADIENT, 0.1, false},
};
enum { SMOOTH = sizeof smooth / sizeof smooth[0], CREASED = sizeof creased / sizeof creased[0], SOLID_POINTS = 10000 };

bool gnp_real_body_name(size_t i, struct gnp_real_body_name *out)
{
	if (i < SMOOTH) {
		snprintf(out->surface, sizeof out->surface, "%s", smooth[i].name);
		snprintf(out->sampling, sizeof out->sampling, "even, noise %.1f", smooth[i].noise);
		return true;
	}
	size_t kind = (i - SMOOTH) / CREASED;
	if (kind >= GNP_SOLID_KIND_COUNT)
		return false;
	snprintf(out->surface, sizeof out->surface, "solid: %s", gnp_solid_kind_name((int)kind));
	snprintf(out->sampling, sizeof out->sampling, "%s", creased[(i - SMOOTH) % CREASED].name);
	return true;
}

/* The arrays that a cloud has too become the cloud's. */
static gnp_status make_smooth(const struct smooth *body, uint64_t seed, struct gnp_pool *pool,
                              struct gnp_real_cloud *out, struct gnp_error *error)
{
	struct gnp_shape *shape;
	struct gnp_sample sample;
	gnp_status status = gnp_shape_create(body->shape, 0, 0, &shape, error);
	if (status != GNP_OK)
		return status;
	const struct gnp_sample_options options = {
		.count = body->count, .seed = seed, .noise = body->noise * sqrt(gnp_shape_area(shape) / (double)body->count)};
	status = gnp_sample_create(shape, &options, pool, NULL, &sample, error);
	gnp_shape_free(shape);
	if (status != GNP_OK)
		return status;
	*out = (struct gnp_real_cloud){.count = sample.count,
	                               .points = sample.points,
	                               .normals = sample.normals,
	                               .mean_curvature = sample.mean_curvature,
	                               .gaussian_curvature = sample.gaussian_curvature,
	                               .open = body->open,
	                               .detailed = true,
	                               .hardness = body->noise > 0 ? GNP_REAL_NOISE : GNP_REAL_SMOOTH};
	sample.points = sample.normals = sample.mean_curvature = sample.gaussian_curvature = NULL;
	gnp_sample_clear(&sample);
	return GNP_OK;
}

/* K of the second fundamental form as a symmetric tensor in space, of which one eigenvalue is 0. */
static double gaussian_of(const double *form)
{
	double trace = form[0] + form[4] + form[8], squares = 0;
	for (int i = 0; i < 9; i++)
		squares += form[i] * form[i];
	return (trace * trace - squares) / 2;
}

static enum gnp_real_hardness hardness_of(const struct creased *way)
{
	if (way->sampling != GNP_SOLID_EVEN && way->sampling != GNP_SOLID_RANDOM)
		return GNP_REAL_UNEVEN;
	return way->noise > 0 ? GNP_REAL_NOISE : GNP_REAL_EDGES;
}

/* Curvature, noise, and which points are not judged. */
static void fill_creased(const struct creased *way, uint64_t seed, const struct gnp_solid_sample *sample,
                         struct gnp_real_cloud *out)
{
	struct gnp_random random;
	gnp_random_seed(&random, seed, 1);
	for (size_t i = 0; i < sample->count; i++) {
		const double *form = sample->second_form + 9 * i;
		out->mean_curvature[i] = (form[0] + form[4] + form[8]) / 2;
		out->gaussian_curvature[i] = gaussian_of(form);
		out->edge[i] = sample->edge[i] / sample->spacing;
		out->unjudged[i] = !way->edges && sample->edge[i] <= sample->spacing;
		for (int c = 0; c < 3; c++)
			out->points[3 * i + c] += way->noise * sample->spacing * gnp_random_normal(&random);
	}
}

static gnp_status make_creased(int kind, const struct creased *way, uint64_t seed, struct gnp_pool *pool,
                               struct gnp_real_cloud *out, struct gnp_error *error)
{
	const struct gnp_solid_options options = {
		.seed = seed, .kind = kind, .count = SOLID_POINTS, .sampling = way->sampling};
	struct gnp_solid_sample sample;
	gnp_status status = gnp_solid_sample_create(&options, pool, NULL, &sample, error);
	if (status != GNP_OK)
		return status;
	struct gnp_real_cloud cloud = {.count = sample.count,
	                               .points = sample.points,
	                               .normals = sample.normals,
	                               .mean_curvature = gnp_array_new(sample.count, sizeof(double)),
	                               .gaussian_curvature = gnp_array_new(sample.count, sizeof(double)),
	                               .edge = gnp_array_new(sample.count, sizeof(double)),
	                               .detailed = !way->edges, /* those are another's points again */
	                               .hardness = hardness_of(way),
	                               .unjudged = gnp_array_new(sample.count, 1)};
	sample.points = sample.normals = NULL;
	if (cloud.mean_curvature && cloud.gaussian_curvature && cloud.edge && cloud.unjudged) {
		fill_creased(way, seed, &sample, &cloud);
		*out = cloud;
	} else {
		status = gnp_no_memory("body", sample.count, "points", error);
		gnp_real_cloud_clear(&cloud);
	}
	gnp_solid_sample_clear(&sample);
	return status;
}

gnp_status gnp_real_body_make(size_t i, struct gnp_pool *pool, struct gnp_real_cloud *out, struct gnp_error *error)
{
	struct gnp_real_body_name name = {0};
	gnp_real_body_name(i, &name);
	uint64_t seed = gnp_real_cloud_seed(name.surface);
	if (i < SMOOTH)
		return make_smooth(&smooth[i], seed, pool, out, error);
	return make_creased((int)((i - SMOOTH) / CREASED), &creased[(i - SMOOTH) % CREASED], seed, pool, out, error);
}
