#include "core/cells/volume.h"

#include <stdlib.h>

#include "core/base/memory.h"
#include "core/cells/star.h"
#include "core/search/neighborhoods.h"

enum { POINTS_A_CHUNK = 512, EDGES = 20 };

struct work {
	const struct gnp_prepared *prepared;
	uint32_t *neighbor; /* (count, EDGES) */
	float *weight;      /* (count, EDGES) 0 past the last */
};

static void take_edges(const struct gnp_star *cell, const uint32_t *index, uint32_t *neighbor, float *weight)
{
	for (size_t e = 0; e < EDGES; e++) {
		bool there = e < cell->edges;
		neighbor[e] = there ? index[cell->neighbor[e]] : 0;
		weight[e] = there ? (float)cell->weight[e] : 0;
	}
}

static gnp_status cells_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	const struct work *work = context;
	const struct gnp_prepared *prepared = work->prepared;
	size_t ring = GNP_CELL_NEIGHBORS + 1 < prepared->count ? GNP_CELL_NEIGHBORS + 1 : prepared->count;
	uint32_t *centres = gnp_scratch_take(scratch, end - begin, sizeof *centres);
	struct gnp_neighborhoods found;
	if (!centres)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "volumes: no memory for %zu points", end - begin);
	for (size_t i = begin; i < end; i++)
		centres[i - begin] = (uint32_t)i;
	gnp_status status = gnp_neighborhoods_find(prepared->neighbors, centres, end - begin, ring, 1, ring, scratch, &found, error);
	for (size_t i = begin; i < end && status == GNP_OK; i++) {
		const uint32_t *index = found.index + found.start[i - begin];
		struct gnp_star star;
		size_t count = found.start[i - begin + 1] - found.start[i - begin];
		const uint32_t *row;
		struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
		status = gnp_star_find(prepared, i, index, count, scratch, &row, &star, error);
		if (status == GNP_OK)
			take_edges(&star, row, work->neighbor + i * EDGES, work->weight + i * EDGES);
		gnp_scratch_release(scratch, mark);
	}
	return status;
}

gnp_status gnp_volume_stiffness(const struct gnp_prepared *prepared, struct gnp_pool *pool, struct gnp_task *task,
                                struct gnp_stiffness *out, struct gnp_error *error)
{
	size_t count = prepared->count;
	struct work work = {prepared, gnp_array_new(count, EDGES * sizeof(uint32_t)), gnp_array_new(count, EDGES * sizeof(float))};
	gnp_status status = work.neighbor && work.weight
	                        ? gnp_pool_run(pool, task, count, POINTS_A_CHUNK, cells_chunk, &work, error)
	                        : gnp_error_set(error, GNP_OUT_OF_MEMORY, "volumes: no memory for the cells of %zu points", count);
	if (status == GNP_OK)
		status = gnp_stiffness_make(count, EDGES, work.neighbor, work.weight, task, out, error);
	free(work.neighbor);
	free(work.weight);
	return status;
}

static void write_row(const struct gnp_stiffness *stiffness, size_t i, double diagonal, bool given, struct gnp_csr *out)
{
	size_t at = out->row_offsets[i], e = given ? stiffness->start[i + 1] : stiffness->start[i];
	for (; e < stiffness->start[i + 1] && stiffness->column[e] < i; e++, at++) {
		out->column[at] = stiffness->column[e];
		out->value[at] = -stiffness->value[e];
	}
	out->column[at] = (uint32_t)i;
	out->value[at++] = given ? 1 : diagonal;
	for (; e < stiffness->start[i + 1]; e++, at++) {
		out->column[at] = stiffness->column[e];
		out->value[at] = -stiffness->value[e];
	}
	out->row_offsets[i + 1] = at;
}

gnp_status gnp_volume_matrix(const struct gnp_stiffness *stiffness, const double *added, const unsigned char *given,
                             struct gnp_csr *out, struct gnp_error *error)
{
	size_t count = stiffness->count;
	gnp_status status = gnp_csr_allocate(count, count, stiffness->start[count] + count, out, error);
	for (size_t i = 0; i < count && status == GNP_OK; i++)
		write_row(stiffness, i, stiffness->diagonal[i] + added[i], given && given[i], out);
	return status;
}
