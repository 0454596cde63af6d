#include "core/cells/attach.h"

#include <math.h>
#include <stdlib.h>

#include "core/base/forest.h"
#include "core/base/memory.h"
#include "core/base/scratch.h"

enum { PIECE = 12, NEAREST = 33, RING = 6 };

/* The nearest way out of a piece. */
struct way {
	uint32_t piece, from, to; /* its root; points */
	double distance;
};

struct search {
	const struct gnp_prepared *prepared;
	struct gnp_forest forest;
	struct gnp_scratch *scratch;
	size_t nearest;
	uint32_t index[NEAREST];
	double distance[NEAREST];
};

static gnp_status find_nearest(struct search *search, uint32_t point, struct gnp_error *error)
{
	const struct gnp_prepared *prepared = search->prepared;
	search->nearest = prepared->count < NEAREST ? prepared->count : NEAREST;
	return gnp_neighbors_knn(prepared->neighbors, prepared->points + 3 * (size_t)point, 1, search->nearest,
	                         search->index, search->distance, search->scratch, error);
}

static uint32_t root_of(struct search *search, uint32_t point)
{
	bool flipped;
	return gnp_forest_find(&search->forest, point, &flipped);
}

static bool is_small(struct search *search, uint32_t point)
{
	return search->forest.size[root_of(search, point)] < PIECE;
}

static gnp_status find_way(struct search *search, uint32_t point, struct way *way, struct gnp_error *error)
{
	gnp_status status = find_nearest(search, point, error);
	*way = (struct way){root_of(search, point), point, point, INFINITY};
	for (size_t k = 0; k < search->nearest && status == GNP_OK; k++)
		if (!is_small(search, search->index[k])) {
			way->to = search->index[k];
			way->distance = search->distance[k];
			break;
		}
	return status;
}

static int by_piece(const void *a, const void *b)
{
	const struct way *x = a, *y = b;
	if (x->piece != y->piece)
		return x->piece < y->piece ? -1 : 1;
	if (x->distance != y->distance)
		return x->distance < y->distance ? -1 : 1;
	return (x->from > y->from) - (x->from < y->from);
}

/* Both sides of an edge have a half each: the one that is written stands for both. */
static void tie(const struct way *way, size_t edges, uint32_t *neighbor, float *weight)
{
	static const double EQUILATERAL = 0.57735026918962576; /* half of two cotangents of 60 degrees */
	size_t at = (size_t)way->from * edges, free = 0;
	while (free + 1 < edges && weight[at + free] > 0)
		free++;
	neighbor[at + free] = way->to;
	weight[at + free] = (float)(2 * EQUILATERAL);
}

static gnp_status tie_all(struct search *search, struct way *ways, size_t count, size_t edges, uint32_t *neighbor,
                          float *weight, size_t *tied, struct gnp_error *error)
{
	static const double FAR = 3; /* times how far the neighbours of the one it is tied to are */
	gnp_status status = GNP_OK;
	qsort(ways, count, sizeof *ways, by_piece);
	for (size_t w = 0; w < count && status == GNP_OK; w++) {
		if ((w > 0 && ways[w].piece == ways[w - 1].piece) || isinf(ways[w].distance))
			continue;
		status = find_nearest(search, ways[w].to, error);
		if (status != GNP_OK ||
		    ways[w].distance > FAR * search->distance[RING < search->nearest ? RING : search->nearest - 1])
			continue;
		tie(&ways[w], edges, neighbor, weight);
		++*tied;
	}
	return status;
}

static gnp_status join(struct search *search, const struct gnp_stiffness *stiffness, size_t *small,
                       struct gnp_error *error)
{
	if (!gnp_forest_init(&search->forest, stiffness->count))
		return gnp_no_memory("pieces", stiffness->count, "points", error);
	for (size_t i = 0; i < stiffness->count; i++)
		for (size_t e = stiffness->start[i]; e < stiffness->start[i + 1]; e++)
			gnp_forest_join(&search->forest, (uint32_t)i, stiffness->column[e], false, SIZE_MAX);
	for (uint32_t i = 0; i < stiffness->count; i++)
		*small += is_small(search, i);
	return GNP_OK;
}

gnp_status gnp_attach_pieces(const struct gnp_prepared *prepared, const struct gnp_stiffness *stiffness, size_t edges,
                             uint32_t *neighbor, float *weight, size_t *tied, struct gnp_error *error)
{
	struct search search = {.prepared = prepared};
	struct way *ways = NULL;
	size_t small = 0, found = 0;
	*tied = 0;
	gnp_status status = join(&search, stiffness, &small, error);
	if (status == GNP_OK && small > 0) {
		search.scratch = gnp_scratch_create();
		ways = gnp_array_new(small, sizeof *ways);
		if (!search.scratch || !ways)
			status = gnp_no_memory("pieces", small, "points", error);
		for (uint32_t i = 0; i < stiffness->count && status == GNP_OK; i++)
			if (is_small(&search, i))
				status = find_way(&search, i, &ways[found++], error);
		if (status == GNP_OK)
			status = tie_all(&search, ways, found, edges, neighbor, weight, tied, error);
	}
	gnp_forest_clear(&search.forest);
	gnp_scratch_free(search.scratch);
	free(ways);
	return status;
}
