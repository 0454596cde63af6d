#include "weights/train/any/any_surface.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/shapes/shapes.h"
#include "core/solids/solid.h"
#include "weights/protocol/protocol.h"

enum { SEEDS = 1 << 30 };

void gnp_any_surface_clear(struct gnp_any_surface *surface)
{
	free(surface->points);
	free(surface->normals);
	free(surface->second_form);
	free(surface->piece);
	free(surface->edge);
	*surface = (struct gnp_any_surface){.count = 0};
}

/* ---- Bodies ---- */

/* One of the group's kinds, each as often. */
static int draw_kind(enum gnp_any_group group, struct gnp_random *random)
{
	int fit[GNP_SOLID_KIND_COUNT], count = 0;
	for (int kind = 0; kind < GNP_SOLID_KIND_COUNT; kind++)
		if ((kind == GNP_SOLID_ROUGH || kind == GNP_SOLID_FACETS) == (group == GNP_ANY_ROUGH))
			fit[count++] = kind;
	return fit[gnp_random_below(random, (uint64_t)count)];
}

static gnp_status draw_solid(enum gnp_any_group group, size_t count, struct gnp_random *random, struct gnp_pool *pool,
                             struct gnp_any_surface *out, struct gnp_error *error)
{
	struct gnp_solid_options options = {
		.seed = gnp_random_below(random, SEEDS), .kind = draw_kind(group, random), .count = count};
	struct gnp_solid_sample sample;
	options.sampling = (int)gnp_random_below(random, GNP_SOLID_SAMPLING_COUNT);
	gnp_status status = gnp_solid_sample_create(&options, pool, NULL, &sample, error);
	if (status != GNP_OK)
		return status;
	*out = (struct gnp_any_surface){
		.count = sample.count, .points = sample.points, .normals = sample.normals, .second_form = sample.second_form,
		.piece = sample.piece, .edge = sample.edge, .spacing = sample.spacing,
		.faceted = options.kind == GNP_SOLID_FACETS};
	for (size_t i = 0; i < sample.count; i++)
		out->edge[i] /= sample.spacing;
	snprintf(out->name, sizeof out->name, "%s %s", gnp_solid_kind_name(options.kind),
	         gnp_solid_sampling_name(options.sampling));
	return GNP_OK;
}

/* ---- The radial family ---- */

static gnp_status make_room(size_t count, struct gnp_any_surface *out, struct gnp_error *error)
{
	*out = (struct gnp_any_surface){.count = count};
	out->points = gnp_array_new(count, 3 * sizeof *out->points);
	out->normals = gnp_array_new(count, 3 * sizeof *out->normals);
	out->second_form = gnp_array_new(count, 9 * sizeof *out->second_form);
	out->piece = gnp_array_zero(count, sizeof *out->piece);
	out->edge = gnp_array_new(count, sizeof *out->edge);
	if (out->points && out->normals && out->second_form && out->piece && out->edge)
		return GNP_OK;
	gnp_any_surface_clear(out);
	return gnp_no_memory("training", count, "points", error);
}

/* count of the sample's points, each set of them as likely. */
static void choose(const struct gnp_sample *sample, size_t count, struct gnp_random *random,
                   struct gnp_any_surface *out)
{
	size_t k = 0;
	for (size_t i = 0; k < count; i++) {
		if (gnp_random_below(random, sample->count - i) >= count - k)
			continue;
		memcpy(out->points + 3 * k, sample->points + 3 * i, 3 * sizeof *out->points);
		memcpy(out->normals + 3 * k, sample->normals + 3 * i, 3 * sizeof *out->normals);
		memcpy(out->second_form + 9 * k, sample->second_form + 9 * i, 9 * sizeof *out->second_form);
		out->edge[k++] = INFINITY;
	}
}

/* Half of them even, half at random: a quarter of an even sample. */
static gnp_status draw_radial(size_t count, struct gnp_random *random, struct gnp_pool *pool,
                              struct gnp_any_surface *out, struct gnp_error *error)
{
	uint64_t seed = gnp_random_below(random, SEEDS);
	unsigned degree = gnp_radial_degree(gnp_random_below(random, GNP_RADIAL_DEGREES));
	bool even = gnp_random_uniform(random) < 0.5;
	const struct gnp_sample_options options = {.count = even ? count : 4 * count, .seed = seed};
	struct gnp_sample sample = {.count = 0};
	struct gnp_shape *shape;
	gnp_status status = gnp_shape_create("radial", seed, degree, &shape, error);
	if (status != GNP_OK)
		return status;
	status = gnp_sample_create(shape, &options, pool, NULL, &sample, error);
	if (status == GNP_OK)
		status = make_room(count, out, error);
	if (status == GNP_OK) {
		choose(&sample, count, random, out);
		out->spacing = sqrt(gnp_shape_area(shape) / (double)count);
		snprintf(out->name, sizeof out->name, "radial %u %s", degree, even ? "even" : "random");
	}
	gnp_sample_clear(&sample);
	gnp_shape_free(shape);
	return status;
}

gnp_status gnp_any_surface_draw(enum gnp_any_group group, size_t count, struct gnp_random *random,
                                struct gnp_pool *pool, struct gnp_any_surface *out, struct gnp_error *error)
{
	static const double RADIAL = 0.2, SMOOTH = 0.58; /* shares below */
	if (group == GNP_ANY_MIXED) {
		double at = gnp_random_uniform(random);
		group = at < RADIAL ? GNP_ANY_RADIAL : at < SMOOTH ? GNP_ANY_SOLID : GNP_ANY_ROUGH;
	}
	struct gnp_any_surface surface;
	gnp_status status = group == GNP_ANY_RADIAL ? draw_radial(count, random, pool, &surface, error)
	                                            : draw_solid(group, count, random, pool, &surface, error);
	if (status == GNP_OK)
		*out = surface;
	return status;
}
