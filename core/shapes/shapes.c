#include "core/shapes/shapes.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/names.h"
#include "core/shapes/shape_family.h"

static const struct gnp_shape_family *const TABLES[] = {gnp_shapes_parametric, gnp_shapes_radial, gnp_shapes_implicit};

/* The i-th family over all tables, or NULL past the last. */
static const struct gnp_shape_family *family_at(size_t i)
{
	for (size_t t = 0; t < sizeof TABLES / sizeof TABLES[0]; t++)
		for (const struct gnp_shape_family *family = TABLES[t]; family->name; family++)
			if (i-- == 0)
				return family;
	return NULL;
}

const char *gnp_shape_name(size_t i)
{
	const struct gnp_shape_family *family = family_at(i);
	return family ? family->name : NULL;
}

static gnp_status unknown_name(const char *name, struct gnp_error *error)
{
	struct gnp_names known;
	gnp_names_begin(&known, name, strlen(name));
	for (size_t i = 0; gnp_shape_name(i); i++)
		gnp_names_add(&known, gnp_shape_name(i));
	return gnp_error_set(error, GNP_NOT_FOUND, "shape: got \"%.64s\", need one of %s", name, gnp_names_end(&known));
}

void *gnp_shape_data_new(struct gnp_shape *shape, size_t size, struct gnp_error *error)
{
	shape->data = calloc(1, size);
	if (!shape->data)
		gnp_error_set(error, GNP_OUT_OF_MEMORY, "shape %s: no memory", shape->family->name);
	return shape->data;
}

gnp_status gnp_shape_create(const char *name, uint64_t seed, unsigned degree, struct gnp_shape **out,
                            struct gnp_error *error)
{
	const struct gnp_shape_family *family = NULL;
	for (size_t i = 0; (family = family_at(i)) && strcmp(family->name, name) != 0; i++)
		;
	if (!family)
		return unknown_name(name, error);
	struct gnp_shape *shape = calloc(1, sizeof *shape);
	if (!shape)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "shape %s: no memory", name);

	shape->family = family;
	gnp_status status = family->create(shape, seed, degree, error);
	if (status == GNP_OK)
		status = gnp_shape_mesh_measure(shape, error);
	if (status != GNP_OK) {
		gnp_shape_free(shape);
		return status;
	}
	*out = shape;
	return GNP_OK;
}

double gnp_shape_area(const struct gnp_shape *shape)
{
	return shape->mesh.area[shape->mesh.triangles];
}

void gnp_shape_free(struct gnp_shape *shape)
{
	if (!shape)
		return;
	free(shape->mesh.corners);
	free(shape->mesh.area);
	free(shape->data);
	free(shape);
}
