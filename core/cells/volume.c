#include "core/cells/volume.h"

#include <stdlib.h>

#include "core/base/memory.h"
#include "core/cells/attach.h"
#include "core/cells/star.h"

enum { POINTS_A_CHUNK = 512, EDGES = 20 };

struct work {
	const struct gnp_prepared *prepared;
	uint32_t *neighbor; /* (count, EDGES) */
	float *weight;      /* (count, EDGES) 0 past the last */
};

static void take_edges(void *context, size_t point, const struct gnp_star *star, const uint32_t *row, double farthest)
{
	const struct work *work = context;
	(void)farthest;
	for (size_t e = 0; e < EDGES; e++) {
		bool there = e < star->edges;
		work->neighbor[point * EDGES + e] = there ? row[star->neighbor[e]] : 0;
		work->weight[point * EDGES + e] = there ? (float)star->weight[e] : 0;
	}
}

static gnp_status stars_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                              struct gnp_error *error)
{
	const struct work *work = context;
	return gnp_stars_visit(work->prepared, begin, end, take_edges, context, scratch, error);
}

/* Once more where pieces were tied. */
static gnp_status assemble(struct work *work, struct gnp_task *task, struct gnp_stiffness *out, struct gnp_error *error)
{
	size_t count = work->prepared->count, tied;
	struct gnp_stiffness made;
	gnp_status status = gnp_stiffness_make(count, EDGES, work->neighbor, work->weight, task, &made, error);
	if (status != GNP_OK)
		return status;
	status = gnp_attach_pieces(work->prepared, &made, EDGES, work->neighbor, work->weight, &tied, error);
	if (status == GNP_OK && tied > 0) {
		gnp_stiffness_clear(&made);
		return gnp_stiffness_make(count, EDGES, work->neighbor, work->weight, task, out, error);
	}
	if (status == GNP_OK)
		*out = made;
	else
		gnp_stiffness_clear(&made);
	return status;
}

gnp_status gnp_volume_stiffness(const struct gnp_prepared *prepared, struct gnp_pool *pool, struct gnp_task *task,
                                struct gnp_stiffness *out, struct gnp_error *error)
{
	size_t count = prepared->count;
	struct work work = {prepared, gnp_array_new(count, EDGES * sizeof(uint32_t)), gnp_array_new(count, EDGES * sizeof(float))};
	gnp_status status = work.neighbor && work.weight
	                        ? gnp_pool_run(pool, task, count, POINTS_A_CHUNK, stars_chunk, &work, error)
	                        : gnp_error_set(error, GNP_OUT_OF_MEMORY, "volumes: no memory for the stars of %zu points", count);
	if (status == GNP_OK)
		status = assemble(&work, task, out, error);
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
