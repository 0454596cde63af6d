#include "core/operators/rim.h"

#include "core/cells/star.h"

struct work {
	const struct gnp_prepared *prepared;
	double *length;
};

static void take_rim(void *context, size_t point, const struct gnp_star *star, const uint32_t *row, double farthest)
{
	const struct work *work = context;
	(void)row;
	(void)farthest;
	work->length[point] = star->rim;
}

static gnp_status stars_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                              struct gnp_error *error)
{
	const struct work *work = context;
	return gnp_stars_visit(work->prepared, begin, end, take_rim, context, scratch, error);
}

gnp_status gnp_rim_measure(const struct gnp_prepared *prepared, struct gnp_pool *pool, struct gnp_task *task,
                           double *length, struct gnp_error *error)
{
	enum { POINTS_A_CHUNK = 512 };
	struct work work = {prepared, length};
	return gnp_pool_run(pool, task, prepared->count, POINTS_A_CHUNK, stars_chunk, &work, error);
}
