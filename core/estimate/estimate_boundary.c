#include "core/estimate/estimate_boundary.h"

#include <stdlib.h>

#include "core/base/memory.h"
#include "core/cells/boundary.h"
#include "core/estimate/estimate.h"

gnp_status gnp_estimate_boundary(const struct gnp_estimate_work *work, struct gnp_pool *pool, struct gnp_task *task,
                                 struct gnp_error *error)
{
	const struct gnp_prepared *prepared = work->prepared;
	double *column = work->out->values[GNP_BOUNDARY];
	unsigned char *rim = gnp_array_new(prepared->count, 1), *candidate = gnp_array_new(prepared->count, 1);
	gnp_status status = GNP_OK;
	if (!rim || !candidate)
		status = gnp_no_memory("boundary", prepared->count, "points", error);
	for (size_t i = 0; i < prepared->count && status == GNP_OK; i++)
		candidate[i] = work->chosen || column[prepared->order[i]] > 0;
	if (status == GNP_OK)
		status = gnp_boundary_find(prepared, work->usual_gap, candidate, pool, task, rim, error);
	for (size_t i = 0; i < prepared->count && status == GNP_OK && !work->chosen; i++)
		column[prepared->order[i]] = rim[i];
	for (size_t p = 0; p < work->cover.count && status == GNP_OK && work->chosen; p++)
		column[p] = rim[work->cover.centre[p]];
	free(rim);
	free(candidate);
	return status;
}

size_t gnp_estimate_boundary_memory(size_t count)
{
	return gnp_boundary_memory(count) + 2 * count;
}
