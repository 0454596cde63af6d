#include "weights/validate/pde/pde_mesh.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/forest.h"
#include "core/base/memory.h"
#include "core/base/vector.h"

#define NO_VERTEX UINT32_MAX

void gnp_pde_mesh_clear(struct gnp_pde_mesh *mesh)
{
	gnp_real_mesh_clear(&mesh->surface);
	free(mesh->edge);
	free(mesh->edge_of);
	free(mesh->around_start);
	free(mesh->around);
	*mesh = (struct gnp_pde_mesh){.edge_count = 0};
}

double gnp_pde_mesh_length(const struct gnp_pde_mesh *mesh, size_t edge)
{
	const double *a = mesh->surface.vertices + 3 * (size_t)mesh->edge[2 * edge];
	const double *b = mesh->surface.vertices + 3 * (size_t)mesh->edge[2 * edge + 1];
	const double d[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
	return sqrt(gnp_dot(d, d));
}

/* ---- One vertex a place ---- */

struct placed {
	double at[3];
	uint32_t index;
};

static int by_place(const void *a, const void *b)
{
	const struct placed *x = a, *y = b;
	for (int c = 0; c < 3; c++)
		if (x->at[c] != y->at[c])
			return x->at[c] < y->at[c] ? -1 : 1;
	return (x->index > y->index) - (x->index < y->index);
}

/* name (vertices) out: the lowest vertex at the same place. */
static gnp_status name_places(const struct gnp_real_mesh *mesh, uint32_t *name, struct gnp_error *error)
{
	struct placed *placed = gnp_array_new(mesh->vertex_count, sizeof *placed);
	if (!placed)
		return gnp_no_memory("mesh", mesh->vertex_count, "vertices", error);
	for (size_t i = 0; i < mesh->vertex_count; i++) {
		memcpy(placed[i].at, mesh->vertices + 3 * i, sizeof placed[i].at);
		placed[i].index = (uint32_t)i;
	}
	qsort(placed, mesh->vertex_count, sizeof *placed, by_place);
	for (size_t i = 0, first = 0; i < mesh->vertex_count; i++) {
		if (memcmp(placed[i].at, placed[first].at, sizeof placed[i].at) != 0)
			first = i;
		name[placed[i].index] = placed[first].index;
	}
	free(placed);
	return GNP_OK;
}

/* ---- Triangles that count ---- */

struct cornered {
	uint32_t low[3]; /* corners ascending */
	uint32_t index;
};

static int by_corners(const void *a, const void *b)
{
	const struct cornered *x = a, *y = b;
	for (int c = 0; c < 3; c++)
		if (x->low[c] != y->low[c])
			return x->low[c] < y->low[c] ? -1 : 1;
	return (x->index > y->index) - (x->index < y->index);
}

static int by_number(const void *a, const void *b)
{
	uint32_t x = *(const uint32_t *)a, y = *(const uint32_t *)b;
	return (x > y) - (x < y);
}

/* counts (triangles) out: 1 for those with three places and an area, the first of their corners. */
static gnp_status choose_triangles(const struct gnp_real_mesh *mesh, const uint32_t *name, unsigned char *counts,
                                   struct gnp_error *error)
{
	struct cornered *cornered = gnp_array_new(mesh->triangle_count, sizeof *cornered);
	if (!cornered)
		return gnp_no_memory("mesh", mesh->triangle_count, "triangles", error);
	for (size_t t = 0; t < mesh->triangle_count; t++) {
		double normal[3];
		for (int c = 0; c < 3; c++)
			cornered[t].low[c] = name[mesh->triangles[3 * t + c]];
		qsort(cornered[t].low, 3, sizeof *cornered[t].low, by_number);
		cornered[t].index = (uint32_t)t;
		counts[t] = cornered[t].low[0] != cornered[t].low[1] && cornered[t].low[1] != cornered[t].low[2] &&
		            gnp_real_mesh_normal(mesh, t, normal) > 0;
	}
	qsort(cornered, mesh->triangle_count, sizeof *cornered, by_corners);
	for (size_t t = 1; t < mesh->triangle_count; t++)
		if (memcmp(cornered[t].low, cornered[t - 1].low, sizeof cornered[t].low) == 0)
			counts[cornered[t].index] = 0;
	free(cornered);
	return GNP_OK;
}

/* Takes triangles of small pieces off; *pieces: those that stay. */
static gnp_status drop_debris(const struct gnp_real_mesh *mesh, const uint32_t *name, unsigned char *counts,
                              size_t *pieces, struct gnp_error *error)
{
	struct gnp_forest forest;
	size_t used = 0;
	bool flipped;
	*pieces = 0;
	if (!gnp_forest_init(&forest, mesh->vertex_count)) {
		gnp_forest_clear(&forest);
		return gnp_no_memory("mesh", mesh->vertex_count, "vertices", error);
	}
	for (size_t t = 0; t < mesh->triangle_count; t++)
		for (int c = 1; c < 3 && counts[t]; c++)
			gnp_forest_join(&forest, name[mesh->triangles[3 * t]], name[mesh->triangles[3 * t + (size_t)c]], false,
			                SIZE_MAX);
	for (uint32_t i = 0; i < mesh->vertex_count; i++)
		used += forest.size[gnp_forest_find(&forest, i, &flipped)] > 1;
	for (uint32_t i = 0; i < mesh->vertex_count; i++)
		*pieces +=
			gnp_forest_find(&forest, i, &flipped) == i && forest.size[i] > 1 && 100 * (size_t)forest.size[i] >= used;
	for (size_t t = 0; t < mesh->triangle_count; t++)
		counts[t] =
			counts[t] &&
			100 * (size_t)forest.size[gnp_forest_find(&forest, name[mesh->triangles[3 * t]], &flipped)] >= used;
	gnp_forest_clear(&forest);
	return GNP_OK;
}

/* The triangles that count over the vertices that have some, renumbered. fresh: spare (vertices). */
static gnp_status renumber(const struct gnp_real_mesh *mesh, const uint32_t *name, const unsigned char *counts,
                           uint32_t *fresh, struct gnp_real_mesh *out, struct gnp_error *error)
{
	double *vertices = gnp_array_new(mesh->vertex_count, 3 * sizeof *vertices);
	uint32_t *triangles = gnp_array_new(mesh->triangle_count, 3 * sizeof *triangles);
	size_t points = 0, kept = 0;
	gnp_status status =
		vertices && triangles ? GNP_OK : gnp_no_memory("mesh", mesh->triangle_count, "triangles", error);
	memset(fresh, 0xff, mesh->vertex_count * sizeof *fresh);
	for (size_t t = 0; t < mesh->triangle_count && status == GNP_OK; t++)
		for (int c = 0; c < 3 && counts[t]; c++)
			fresh[name[mesh->triangles[3 * t + c]]] = 0;
	for (size_t i = 0; i < mesh->vertex_count && status == GNP_OK; i++)
		if (fresh[i] != NO_VERTEX) {
			memcpy(vertices + 3 * points, mesh->vertices + 3 * i, 3 * sizeof *vertices);
			fresh[i] = (uint32_t)points++;
		}
	for (size_t t = 0; t < mesh->triangle_count && status == GNP_OK; t++) {
		for (int c = 0; c < 3 && counts[t]; c++)
			triangles[3 * kept + c] = fresh[name[mesh->triangles[3 * t + c]]];
		kept += counts[t];
	}
	if (status == GNP_OK && kept == 0)
		status = gnp_error_set(error, GNP_INVALID_ARGUMENT, "mesh: got no triangle with an area, need one");
	if (status == GNP_OK)
		status = gnp_real_mesh_create(vertices, points, triangles, kept, out, error);
	free(vertices);
	free(triangles);
	return status;
}

static gnp_status clean(const struct gnp_real_mesh *mesh, struct gnp_real_mesh *out, size_t *pieces,
                        struct gnp_error *error)
{
	uint32_t *names = gnp_array_new(mesh->vertex_count, 2 * sizeof *names);
	unsigned char *counts = gnp_array_new(mesh->triangle_count, 1);
	gnp_status status = names && counts ? name_places(mesh, names, error)
	                                    : gnp_no_memory("mesh", mesh->vertex_count, "vertices", error);
	if (status == GNP_OK)
		status = choose_triangles(mesh, names, counts, error);
	if (status == GNP_OK)
		status = drop_debris(mesh, names, counts, pieces, error);
	if (status == GNP_OK)
		status = renumber(mesh, names, counts, names + mesh->vertex_count, out, error);
	free(names);
	free(counts);
	return status;
}

/* ---- Edges ---- */

struct side {
	uint32_t end[2];
	uint32_t place; /* 3 triangle + the corner across */
};

static int by_ends(const void *a, const void *b)
{
	const struct side *x = a, *y = b;
	for (int c = 0; c < 2; c++)
		if (x->end[c] != y->end[c])
			return x->end[c] < y->end[c] ? -1 : 1;
	return (x->place > y->place) - (x->place < y->place);
}

static void list_sides(const struct gnp_real_mesh *surface, struct side *sides)
{
	for (size_t p = 0; p < 3 * surface->triangle_count; p++) {
		size_t first = p / 3 * 3, c = p - first;
		uint32_t a = surface->triangles[first + (c + 1) % 3], b = surface->triangles[first + (c + 2) % 3];
		sides[p] = (struct side){{a < b ? a : b, a < b ? b : a}, (uint32_t)p};
	}
	qsort(sides, 3 * surface->triangle_count, sizeof *sides, by_ends);
}

static gnp_status find_edges(struct gnp_pde_mesh *mesh, struct gnp_error *error)
{
	size_t places = 3 * mesh->surface.triangle_count, e = 0;
	struct side *sides = gnp_array_new(places, sizeof *sides);
	mesh->edge = gnp_array_new(places, 2 * sizeof *mesh->edge);
	mesh->edge_of = gnp_array_new(places, sizeof *mesh->edge_of);
	mesh->around_start = gnp_array_new(places + 1, sizeof *mesh->around_start);
	mesh->around = gnp_array_new(places, sizeof *mesh->around);
	if (!sides || !mesh->edge || !mesh->edge_of || !mesh->around_start || !mesh->around) {
		free(sides);
		return gnp_no_memory("mesh", places, "sides of triangles", error);
	}
	list_sides(&mesh->surface, sides);
	for (size_t begin = 0, end; begin < places; begin = end, e++) {
		for (end = begin; end < places && memcmp(sides[end].end, sides[begin].end, sizeof sides[end].end) == 0;
		     end++) {
			mesh->edge_of[sides[end].place] = (uint32_t)e;
			mesh->around[end] = sides[end].place / 3;
		}
		memcpy(mesh->edge + 2 * e, sides[begin].end, sizeof sides[begin].end);
		mesh->around_start[e] = begin;
		mesh->open += end - begin == 1;
		mesh->crowded += end - begin > 2;
		mesh->edge_length += gnp_pde_mesh_length(mesh, e);
	}
	mesh->around_start[e] = places;
	mesh->edge_count = e;
	mesh->edge_length /= (double)e;
	free(sides);
	return GNP_OK;
}

gnp_status gnp_pde_mesh_make(const struct gnp_real_mesh *mesh, struct gnp_pde_mesh *out, struct gnp_error *error)
{
	struct gnp_pde_mesh made = {.edge_count = 0};
	gnp_status status = clean(mesh, &made.surface, &made.pieces, error);
	if (status == GNP_OK)
		status = find_edges(&made, error);
	if (status == GNP_OK)
		*out = made;
	else
		gnp_pde_mesh_clear(&made);
	return status;
}
