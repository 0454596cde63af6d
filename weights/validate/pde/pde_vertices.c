#include "weights/validate/pde/pde_vertices.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/vector.h"
#include "weights/validate/pde/pde_cotangent.h"
#include "weights/validate/pde/pde_paths.h"

enum { EIGENVALUES = 20, POINTS_ON_AN_EDGE = 8 };

static double square_between(const double a[3], const double b[3])
{
	const double d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
	return gnp_dot(d, d);
}

/* The one farthest from the middle, then twice the one farthest from those before. */
static void choose_sources(struct gnp_pde_case *known)
{
	double middle[3] = {0};
	for (size_t i = 0; i < 3 * known->count; i++)
		middle[i % 3] += known->points[i] / (double)known->count;
	for (size_t s = 0; s < GNP_PDE_SOURCES; s++) {
		double farthest = -1;
		for (size_t i = 0; i < known->count; i++) {
			const double *x = known->points + 3 * i;
			double off = s == 0 ? square_between(x, middle) : INFINITY;
			for (size_t before = 0; before < s; before++)
				off = fmin(off, square_between(x, known->points + 3 * (size_t)known->at[before]));
			if (off > farthest) {
				farthest = off;
				known->at[s] = (uint32_t)i;
			}
		}
	}
}

static void set_source(struct gnp_pde_case *known, double diagonal)
{
	static const double height[GNP_PDE_SOURCES] = {1, -1, 0.5};
	double width = diagonal / 10, total = 0, mean = 0;
	for (size_t i = 0; i < known->count; i++) {
		known->source[i] = 0;
		for (size_t s = 0; s < GNP_PDE_SOURCES; s++)
			known->source[i] +=
				height[s] * exp(-square_between(known->points + 3 * i, known->points + 3 * (size_t)known->at[s]) /
			                    (width * width));
		total += known->mass[i];
		mean += known->mass[i] * known->source[i];
	}
	for (size_t i = 0; i < known->count; i++)
		known->source[i] -= mean / total;
}

static gnp_status solve(struct gnp_pde_case *known, const struct gnp_pde_mesh *mesh, struct gnp_pool *pool,
                        struct gnp_task *task, struct gnp_error *error)
{
	struct gnp_pde_form form;
	gnp_status status = gnp_pde_cotangent_make(mesh, &form, error);
	if (status != GNP_OK)
		return status;
	memcpy(known->mass, form.mass, known->count * sizeof *form.mass);
	set_source(known, mesh->surface.diagonal);
	status = gnp_pde_form_lowest(&form, known->pieces + known->eigenvalues, pool, task, known->eigenvalue, error);
	if (status == GNP_OK)
		status = gnp_pde_form_solve(&form, known->source, pool, task, known->solution, error);
	gnp_pde_form_clear(&form);
	return status;
}

static gnp_status walk(struct gnp_pde_case *known, const struct gnp_pde_mesh *mesh, struct gnp_error *error)
{
	double *coarse = gnp_array_new(known->count, sizeof *coarse), off = 0;
	size_t compared = 0;
	gnp_status status = coarse ? GNP_OK : gnp_no_memory("case", known->count, "points", error);
	for (size_t s = 0; s < GNP_PDE_SOURCES && status == GNP_OK; s++) {
		double *distance = known->distance + s * known->count;
		status = gnp_pde_paths(mesh, known->at[s], POINTS_ON_AN_EDGE, distance, error);
		if (status == GNP_OK)
			status = gnp_pde_paths(mesh, known->at[s], POINTS_ON_AN_EDGE / 2, coarse, error);
		for (size_t i = 0; i < known->count && status == GNP_OK; i++)
			if (distance[i] > 0 && isfinite(distance[i])) {
				off += coarse[i] / distance[i] - 1;
				compared++;
			}
	}
	known->doubt = off / (double)compared / 2;
	free(coarse);
	return status;
}

static gnp_status allocate(struct gnp_pde_case *known, struct gnp_error *error)
{
	known->eigenvalue = gnp_array_new(known->pieces + known->eigenvalues, sizeof(double));
	known->source = gnp_array_new(known->count, sizeof(double));
	known->solution = gnp_array_new(known->count, sizeof(double));
	known->distance = gnp_array_new(known->count, GNP_PDE_SOURCES * sizeof(double));
	if (known->eigenvalue && known->source && known->solution && known->distance)
		return GNP_OK;
	return gnp_no_memory("case", known->count, "points", error);
}

gnp_status gnp_pde_vertices_make(const char *name, const struct gnp_pde_mesh *mesh, struct gnp_pool *pool,
                                 struct gnp_task *task, struct gnp_pde_case *out, struct gnp_error *error)
{
	const struct gnp_real_mesh *surface = &mesh->surface;
	struct gnp_pde_case known;
	gnp_status status = gnp_pde_case_create(name, "vertices", surface->vertex_count, &known, error);
	if (status != GNP_OK)
		return status;
	known.pieces = mesh->pieces;
	known.open = mesh->open;
	known.spacing = sqrt(surface->area / (double)known.count);
	known.eigenvalues = EIGENVALUES;
	memcpy(known.points, surface->vertices, 3 * known.count * sizeof(double));
	gnp_real_mesh_vertex_normals(surface, known.normals);
	choose_sources(&known);
	status = allocate(&known, error);
	if (status == GNP_OK)
		status = solve(&known, mesh, pool, task, error);
	if (status == GNP_OK)
		status = walk(&known, mesh, error);
	if (status == GNP_OK)
		*out = known;
	else
		gnp_pde_case_clear(&known);
	return status;
}
