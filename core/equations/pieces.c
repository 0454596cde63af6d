#include "core/equations/pieces.h"

#include <stdlib.h>

#include "core/base/forest.h"
#include "core/base/memory.h"

enum { NONE = UINT32_MAX };

void gnp_pieces_clear(struct gnp_pieces *pieces)
{
	free(pieces->free);
	free(pieces->local);
	free(pieces->start);
	free(pieces->member);
	*pieces = (struct gnp_pieces){.count = 0};
}

size_t gnp_pieces_mark_free(const struct gnp_domain *domain, const unsigned char *fixed, unsigned char *free_there)
{
	size_t count = domain->prepared.count, found = 0;
	for (size_t i = 0; i < count; i++)
		free_there[i] = !fixed || !fixed[domain->prepared.order[i]];
	for (size_t k = 0; fixed && k < domain->copies.count; k++)
		if (fixed[domain->copies.copy[k].index] && domain->copies.copy[k].row != GNP_COPY_OUTSIDE)
			free_there[domain->copies.copy[k].row] = 0;
	for (size_t i = 0; i < count; i++)
		found += free_there[i];
	return found;
}

static void join_neighbours(const struct gnp_pieces *pieces, const struct gnp_stiffness *volumes,
                            struct gnp_forest *forest)
{
	for (size_t i = 0; i < pieces->points; i++)
		for (size_t e = volumes->start[i]; e < volumes->start[i + 1]; e++)
			if (pieces->free[i] && pieces->free[volumes->column[e]])
				gnp_forest_join(forest, (uint32_t)i, volumes->column[e], false, SIZE_MAX);
}

/* piece (points): the number of each free point's set. Counts their points into start. */
static void number_sets(struct gnp_pieces *pieces, struct gnp_forest *forest, uint32_t *piece)
{
	bool flipped;
	for (size_t i = 0; i < pieces->points; i++)
		piece[i] = NONE;
	for (size_t i = 0; i < pieces->points; i++) {
		if (!pieces->free[i])
			continue;
		uint32_t root = gnp_forest_find(forest, (uint32_t)i, &flipped);
		if (piece[root] == NONE)
			piece[root] = (uint32_t)pieces->count++;
		piece[i] = piece[root];
		pieces->start[piece[i] + 1]++;
	}
	for (size_t p = 0; p < pieces->count; p++)
		pieces->start[p + 1] += pieces->start[p];
}

/* start moves on while points are listed, and back again. */
static void list_members(struct gnp_pieces *pieces, const uint32_t *piece)
{
	for (size_t i = 0; i < pieces->points; i++)
		if (pieces->free[i])
			pieces->member[pieces->start[piece[i]]++] = (uint32_t)i;
	for (size_t p = pieces->count; p > 0; p--)
		pieces->start[p] = pieces->start[p - 1];
	pieces->start[0] = 0;
	for (size_t p = 0; p < pieces->count; p++)
		for (size_t k = 0; k < gnp_pieces_size(pieces, p); k++)
			pieces->local[gnp_pieces_point(pieces, p, k)] = (uint32_t)k;
}

gnp_status gnp_pieces_find(const struct gnp_domain *domain, const struct gnp_stiffness *volumes,
                           const unsigned char *fixed, struct gnp_pieces *out, struct gnp_error *error)
{
	size_t count = domain->prepared.count;
	struct gnp_forest forest;
	struct gnp_pieces pieces = {.points = count, .free = gnp_array_new(count, 1),
	                            .local = gnp_array_new(count, sizeof *pieces.local),
	                            .start = gnp_array_zero(count + 1, sizeof *pieces.start),
	                            .member = gnp_array_new(count, sizeof *pieces.member)};
	uint32_t *piece = gnp_array_new(count, sizeof *piece);
	bool room = gnp_forest_init(&forest, count) && piece;
	room = room && pieces.free && pieces.local && pieces.start && pieces.member;
	if (room) {
		gnp_pieces_mark_free(domain, fixed, pieces.free);
		join_neighbours(&pieces, volumes, &forest);
		number_sets(&pieces, &forest, piece);
		list_members(&pieces, piece);
		*out = pieces;
	} else {
		gnp_pieces_clear(&pieces);
	}
	gnp_forest_clear(&forest);
	free(piece);
	return room ? GNP_OK : gnp_no_memory("spectrum", count, "points", error);
}
