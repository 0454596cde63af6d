#include "core/geodesic/geodesic_check.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"

static const double below_most = 0.03; /* of the mean length: 0 to 0.002 where the surface is resolved */

enum { CHUNK = 4096 };

struct lines {
	const struct gnp_neighbors *sources;
	const double *points;
	double *length; /* (points) */
};

static gnp_status measure_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                struct gnp_error *error)
{
	const struct lines *lines = context;
	uint32_t *nearest = gnp_scratch_take(scratch, end - begin, sizeof *nearest);
	if (!nearest)
		return gnp_no_memory("distances", end - begin, "points", error);
	return gnp_neighbors_knn(lines->sources, lines->points + 3 * begin, end - begin, 1, nearest, lines->length + begin,
	                         scratch, error);
}

/* length (points) out: of the straight line to the nearest source. */
static gnp_status measure_lines(const struct gnp_prepared *prepared, const uint32_t *sources, size_t count,
                                struct gnp_pool *pool, struct gnp_task *task, double *length, struct gnp_error *error)
{
	struct gnp_neighbors *index = NULL;
	double *places = gnp_array_new(count, 3 * sizeof *places);
	if (!places)
		return gnp_no_memory("distances", count, "sources", error);
	for (size_t s = 0; s < count; s++)
		memcpy(places + 3 * s, prepared->points + 3 * (size_t)sources[s], 3 * sizeof *places);
	gnp_status status = gnp_neighbors_build(places, count, &index, error);
	struct lines lines = {index, prepared->points, length};
	if (status == GNP_OK)
		status = gnp_pool_run(pool, task, prepared->count, CHUNK, measure_chunk, &lines, error);
	gnp_neighbors_free(index);
	free(places);
	return status;
}

static void lengthen(const double *line, size_t count, double *distance, struct gnp_warnings *warnings)
{
	double lines = 0, below = 0;
	for (size_t i = 0; i < count; i++) {
		if (isinf(distance[i]))
			continue;
		lines += line[i];
		below += fmax(0, line[i] - distance[i]);
		distance[i] = fmax(distance[i], line[i]);
	}
	if (below > below_most * lines)
		gnp_warnings_add(warnings, GNP_WARNING_DISTANCE,
		                 "they were shorter than the straight line to the nearest source, by %.3g %% of it on average, "
		                 "more than %g %%: not to be believed, the points are too uneven",
		                 100 * below / lines, 100 * below_most);
}

gnp_status gnp_geodesic_check(const struct gnp_prepared *prepared, const uint32_t *sources, size_t count,
                              struct gnp_pool *pool, struct gnp_task *task, double *distance, struct gnp_error *error)
{
	double *line = gnp_array_new(prepared->count, sizeof *line);
	if (!line)
		return gnp_no_memory("distances", prepared->count, "points", error);
	gnp_status status = measure_lines(prepared, sources, count, pool, task, line, error);
	if (status == GNP_OK)
		lengthen(line, prepared->count, distance, gnp_task_warnings(task));
	free(line);
	return status;
}
