#include "core/cells/area.h"

#include <math.h>
#include <stdatomic.h>

#include "core/cells/star.h"
#include "core/search/neighborhoods.h"

enum { POINTS_A_CHUNK = 512 };

struct work {
	const struct gnp_prepared *prepared;
	double *area;
	atomic_size_t open;
};

static gnp_status measure_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	struct work *work = context;
	const struct gnp_prepared *prepared = work->prepared;
	size_t ring = GNP_CELL_NEIGHBORS + 1 < prepared->count ? GNP_CELL_NEIGHBORS + 1 : prepared->count;
	uint32_t *centres = gnp_scratch_take(scratch, end - begin, sizeof *centres);
	struct gnp_neighborhoods found;
	if (!centres)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "area: no memory for %zu points", end - begin);
	for (size_t i = begin; i < end; i++)
		centres[i - begin] = (uint32_t)i;
	gnp_status status = gnp_neighborhoods_find(prepared->neighbors, centres, end - begin, ring, 1, ring, scratch, &found, error);
	for (size_t i = begin; i < end && status == GNP_OK; i++) {
		size_t at = found.start[i - begin], count = found.start[i - begin + 1] - at;
		double last = found.distance[at + count - 1];
		struct gnp_star star;
		const uint32_t *row;
		struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
		status = gnp_star_find(prepared, i, found.index + at, count, scratch, &row, &star, error);
		gnp_scratch_release(scratch, mark);
		work->area[i] = star.area > 0 ? star.area : fmax(last * last, 1e-300);
		if (star.open)
			atomic_fetch_add_explicit(&work->open, 1, memory_order_relaxed);
	}
	return status;
}

gnp_status gnp_area_measure(const struct gnp_prepared *prepared, struct gnp_pool *pool, struct gnp_task *task, double *area, size_t *open,
                            struct gnp_error *error)
{
	struct work work = {.prepared = prepared, .area = area};
	gnp_status status = gnp_pool_run(pool, task, prepared->count, POINTS_A_CHUNK, measure_chunk, &work, error);
	if (status == GNP_OK && open)
		*open = work.open;
	return status;
}
