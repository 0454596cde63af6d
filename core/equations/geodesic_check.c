#include "core/equations/geodesic_check.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/cells/paths.h"

static const double beyond_most = 0.03; /* of the mean length, either way: 0 to 0.002 where the surface is resolved */

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
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "distances: no memory for %zu points", end - begin);
	return gnp_neighbors_knn(lines->sources, lines->points + 3 * begin, end - begin, 1, nearest, lines->length + begin, scratch, error);
}

/* length (points) out: of the straight line to the nearest source. */
static gnp_status measure_lines(const struct gnp_prepared *prepared, const unsigned char *source, struct gnp_pool *pool,
                                struct gnp_task *task, double *length, struct gnp_error *error)
{
	struct gnp_neighbors *index = NULL;
	double *places = gnp_array_new(prepared->count, 3 * sizeof *places);
	size_t count = 0;
	if (!places)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "distances: no memory for %zu points", prepared->count);
	for (size_t i = 0; i < prepared->count; i++)
		if (source[i])
			memcpy(places + 3 * count++, prepared->points + 3 * i, 3 * sizeof *places);
	gnp_status status = gnp_neighbors_build(places, count, &index, error);
	struct lines lines = {index, prepared->points, length};
	if (status == GNP_OK)
		status = gnp_pool_run(pool, task, prepared->count, CHUNK, measure_chunk, &lines, error);
	gnp_neighbors_free(index);
	free(places);
	return status;
}

static void judge(const double *line, const double *path, const double *distance, size_t count,
                  struct gnp_warnings *warnings)
{
	double lines = 0, paths = 0, below = 0, beyond = 0;
	for (size_t i = 0; i < count; i++) {
		if (isinf(distance[i]) || isinf(path[i]))
			continue;
		lines += line[i];
		paths += path[i];
		below += fmax(0, line[i] - distance[i]);
		beyond += fmax(0, distance[i] - path[i]);
	}
	if (below > beyond_most * lines)
		gnp_warnings_add(warnings, GNP_WARNING_DISTANCE,
		                 "they are shorter than the straight line to the nearest source, by %.3g %% of it on average, more "
		                 "than %g %%: not to be believed, the points are too uneven for the heat method", 100 * below / lines, 100 * beyond_most);
	if (beyond > beyond_most * paths)
		gnp_warnings_add(warnings, GNP_WARNING_DISTANCE,
		                 "they are longer than the way from point to point, by %.3g %% of it on average, more than %g %%: not "
		                 "to be believed, the sources are too many or too close, or the points too uneven for the heat method", 100 * beyond / paths,
		                 100 * beyond_most);
}

gnp_status gnp_geodesic_check(const struct gnp_prepared *prepared, const struct gnp_stiffness *volumes,
                              const unsigned char *source, const double *distance, struct gnp_pool *pool,
                              struct gnp_task *task, struct gnp_error *error)
{
	size_t count = prepared->count;
	if (!task)
		return GNP_OK;
	double *line = gnp_array_new(count, 2 * sizeof *line);
	if (!line)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "distances: no memory for %zu points", count);
	gnp_status status = measure_lines(prepared, source, pool, task, line, error);
	if (status == GNP_OK)
		status = gnp_paths_find(volumes, prepared->points, source, task, line + count, error);
	if (status == GNP_OK)
		judge(line, line + count, distance, count, gnp_task_warnings(task));
	free(line);
	return status;
}
