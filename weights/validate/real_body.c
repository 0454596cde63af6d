#include "weights/validate/real_body.h"

#include <math.h>

#include "core/shapes/shapes.h"

/* noise: deviation on every coordinate, in mean spacings sqrt(area / count). */
static const struct body {
	const char *name, *shape;
	size_t count;
	double noise;
} bodies[] = {
	{"torus of 200 points", "torus", 200, 0},
	{"torus of 2,000 points, noise 0.3", "torus", 2000, 0.3},
	{"saddle, open", "saddle", 10000, 0},
	{"saddle, open, noise 0.3", "saddle", 10000, 0.3},
	{"cylinder, open", "cylinder", 10000, 0},
	{"cylinder, open, noise 1", "cylinder", 10000, 1},
	{"bumpy torus, noise 1", "bumpy_torus", 20000, 1},
};
enum { BODIES = sizeof bodies / sizeof bodies[0] };

const char *gnp_real_body_name(size_t i)
{
	return i < BODIES ? bodies[i].name : NULL;
}

/* The arrays that a cloud has too become the cloud's. */
static gnp_status take_sample(struct gnp_sample *sample, struct gnp_real_cloud *out)
{
	*out = (struct gnp_real_cloud){.count = sample->count, .points = sample->points, .normals = sample->normals,
	                               .mean_curvature = sample->mean_curvature};
	sample->points = sample->normals = sample->mean_curvature = NULL;
	gnp_sample_clear(sample);
	return GNP_OK;
}

gnp_status gnp_real_body_make(size_t i, struct gnp_pool *pool, struct gnp_real_cloud *out, struct gnp_error *error)
{
	const struct body *body = &bodies[i];
	struct gnp_shape *shape;
	struct gnp_sample sample;
	gnp_status status = gnp_shape_create(body->shape, 0, 0, &shape, error);
	if (status != GNP_OK)
		return status;
	const struct gnp_sample_options options = {.count = body->count, .seed = gnp_real_cloud_seed(body->name),
	                                           .noise = body->noise * sqrt(gnp_shape_area(shape) / (double)body->count)};
	status = gnp_sample_create(shape, &options, pool, NULL, &sample, error);
	gnp_shape_free(shape);
	return status == GNP_OK ? take_sample(&sample, out) : status;
}
