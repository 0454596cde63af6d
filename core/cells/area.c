#include "core/cells/area.h"

#include <math.h>
#include <stdatomic.h>

#include "core/cells/star.h"

enum { POINTS_A_CHUNK = 512 };

struct work {
	const struct gnp_prepared *prepared;
	double *area;
	atomic_size_t open;
};

static void measure(void *context, size_t point, const struct gnp_star *star, const uint32_t *row, double farthest)
{
	struct work *work = context;
	(void)row;
	work->area[point] = star->area > 0 ? star->area : fmax(farthest * farthest, 1e-300);
	if (star->open)
		atomic_fetch_add_explicit(&work->open, 1, memory_order_relaxed);
}

static gnp_status measure_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                struct gnp_error *error)
{
	const struct work *work = context;
	return gnp_stars_visit(work->prepared, begin, end, measure, context, scratch, error);
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
