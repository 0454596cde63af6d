#include "weights/validate/pde/pde_paths.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

#include "core/base/memory.h"
#include "core/base/vector.h"

enum { ON_EDGE_MOST = 255 };

struct entry {
	double distance;
	uint32_t node;
};

/* Nodes are the vertices, then the points of each edge from its first end to its second. */
struct search {
	const struct gnp_pde_mesh *mesh;
	size_t vertices, nodes;
	uint32_t *first;      /* (edges + 1) node of an edge's first point */
	size_t *corner_start; /* (vertices + 1) */
	uint32_t *corner;     /* (3 triangles) triangles about each vertex */
	double *distance;     /* (nodes) the shortest way found */
	unsigned char *done;  /* (nodes) */
	struct entry *heap;
	size_t heap_count, heap_room;
};

static void clear(struct search *search)
{
	free(search->first);
	free(search->corner_start);
	free(search->corner);
	free(search->distance);
	free(search->done);
	free(search->heap);
}

static gnp_status allocate(struct search *search, unsigned density, struct gnp_error *error)
{
	const struct gnp_pde_mesh *mesh = search->mesh;
	size_t places = 3 * mesh->surface.triangle_count;
	search->first = gnp_array_new(mesh->edge_count + 1, sizeof *search->first);
	search->corner_start = gnp_array_zero(search->vertices + 2, sizeof *search->corner_start);
	search->corner = gnp_array_new(places, sizeof *search->corner);
	search->nodes = search->vertices;
	for (size_t e = 0; e < mesh->edge_count && search->first; e++) {
		double points =
			fmin(fmax(round(density * gnp_pde_mesh_length(mesh, e) / mesh->edge_length), 1), ON_EDGE_MOST);
		search->first[e] = (uint32_t)search->nodes;
		search->nodes += (size_t)points;
	}
	if (search->nodes > UINT32_MAX / 2)
		return gnp_error_set(error, GNP_TOO_LARGE, "paths: got %zu points on edges, need at most %u", search->nodes,
		                     UINT32_MAX / 2);
	search->distance = gnp_array_new(search->nodes, sizeof *search->distance);
	search->done = gnp_array_zero(search->nodes, 1);
	search->heap_room = 1024;
	search->heap = gnp_array_new(search->heap_room, sizeof *search->heap);
	if (!search->first || !search->corner_start || !search->corner || !search->distance || !search->done ||
	    !search->heap)
		return gnp_no_memory("paths", search->nodes, "points on edges", error);
	search->first[mesh->edge_count] = (uint32_t)search->nodes;
	for (size_t i = 0; i < search->nodes; i++)
		search->distance[i] = INFINITY;
	return GNP_OK;
}

static void list_corners(struct search *search)
{
	const struct gnp_real_mesh *surface = &search->mesh->surface;
	size_t places = 3 * surface->triangle_count, *start = search->corner_start;
	for (size_t p = 0; p < places; p++)
		start[surface->triangles[p] + 2]++;
	for (size_t i = 0; i < search->vertices; i++)
		start[i + 2] += start[i + 1];
	for (size_t p = 0; p < places; p++)
		search->corner[start[surface->triangles[p] + 1]++] = (uint32_t)(p / 3);
}

/* ---- A heap of nodes, the nearest first; a node may be in it more than once ---- */

static bool push(struct search *search, double distance, uint32_t node)
{
	if (search->heap_count == search->heap_room) {
		struct entry *more = realloc(search->heap, 2 * search->heap_room * sizeof *more);
		if (!more)
			return false;
		search->heap = more;
		search->heap_room *= 2;
	}
	size_t at = search->heap_count++;
	for (; at > 0 && search->heap[(at - 1) / 2].distance > distance; at = (at - 1) / 2)
		search->heap[at] = search->heap[(at - 1) / 2];
	search->heap[at] = (struct entry){distance, node};
	return true;
}

static uint32_t pop(struct search *search)
{
	uint32_t node = search->heap[0].node;
	struct entry last = search->heap[--search->heap_count];
	size_t at = 0;
	for (size_t child; (child = 2 * at + 1) < search->heap_count; at = child) {
		child += child + 1 < search->heap_count && search->heap[child + 1].distance < search->heap[child].distance;
		if (search->heap[child].distance >= last.distance)
			break;
		search->heap[at] = search->heap[child];
	}
	search->heap[at] = last;
	return node;
}

/* ---- The search ---- */

static const double *vertex(const struct search *search, uint32_t i)
{
	return search->mesh->surface.vertices + 3 * (size_t)i;
}

/* Where the k-th of an edge's points is. */
static void place(const struct search *search, size_t edge, uint32_t k, double out[3])
{
	const double *a = vertex(search, search->mesh->edge[2 * edge]),
				 *b = vertex(search, search->mesh->edge[2 * edge + 1]);
	double share = (k + 1.0) / (search->first[edge + 1] - search->first[edge] + 1.0);
	for (int c = 0; c < 3; c++)
		out[c] = a[c] + share * (b[c] - a[c]);
}

static bool reach(struct search *search, const double from[3], double way, uint32_t node, const double to[3])
{
	const double d[3] = {to[0] - from[0], to[1] - from[1], to[2] - from[2]};
	double distance = way + sqrt(gnp_dot(d, d));
	if (search->done[node] || distance >= search->distance[node])
		return true;
	search->distance[node] = distance;
	return push(search, distance, node);
}

/* All nodes of a triangle's sides, from a place on one of them. */
static bool cross(struct search *search, size_t triangle, const double from[3], double way)
{
	bool fits = true;
	for (size_t c = 0; c < 3; c++) {
		size_t edge = search->mesh->edge_of[3 * triangle + c];
		uint32_t corner = search->mesh->surface.triangles[3 * triangle + c];
		fits = fits && reach(search, from, way, corner, vertex(search, corner));
		for (uint32_t node = search->first[edge]; node < search->first[edge + 1]; node++) {
			double to[3];
			place(search, edge, node - search->first[edge], to);
			fits = fits && reach(search, from, way, node, to);
		}
	}
	return fits;
}

/* The edge that a node beyond the vertices is on. */
static size_t edge_of(const struct search *search, uint32_t node)
{
	size_t low = 0, high = search->mesh->edge_count;
	while (high - low > 1) {
		size_t middle = (low + high) / 2;
		if (search->first[middle] <= node)
			low = middle;
		else
			high = middle;
	}
	return low;
}

static bool leave(struct search *search, uint32_t node)
{
	bool fits = true;
	double from[3];
	if (node < search->vertices) {
		for (size_t k = search->corner_start[node]; k < search->corner_start[node + 1]; k++)
			fits = fits && cross(search, search->corner[k], vertex(search, node), search->distance[node]);
		return fits;
	}
	size_t edge = edge_of(search, node);
	place(search, edge, node - search->first[edge], from);
	for (size_t k = search->mesh->around_start[edge]; k < search->mesh->around_start[edge + 1]; k++)
		fits = fits && cross(search, search->mesh->around[k], from, search->distance[node]);
	return fits;
}

gnp_status gnp_pde_paths(const struct gnp_pde_mesh *mesh, uint32_t source, unsigned density, double *distance,
                         struct gnp_error *error)
{
	struct search search = {.mesh = mesh, .vertices = mesh->surface.vertex_count};
	gnp_status status = allocate(&search, density, error);
	bool fits = status == GNP_OK;
	if (fits) {
		list_corners(&search);
		search.distance[source] = 0;
		fits = push(&search, 0, source);
	}
	while (fits && search.heap_count > 0) {
		uint32_t node = pop(&search);
		if (search.done[node])
			continue;
		search.done[node] = 1;
		fits = leave(&search, node);
	}
	if (status == GNP_OK && !fits)
		status = gnp_no_memory("paths", search.heap_count, "ways", error);
	for (size_t i = 0; i < search.vertices && status == GNP_OK; i++)
		distance[i] = search.distance[i];
	clear(&search);
	return status;
}
