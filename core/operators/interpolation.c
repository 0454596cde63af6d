#include "core/operators/interpolation.h"

#include <string.h>

#include "core/cells/cell.h"
#include "core/cloud/patch.h"
#include "core/fit/taylor.h"
#include "core/operators/stencil.h"

enum { POINTS_A_CHUNK = 128 };

struct work {
	const struct gnp_prepared *prepared;
	const double *points;
	unsigned degree;
	size_t wide;
	struct gnp_csr *out; /* rows `wide` long; what is not needed has the value 0 */
};

/* Entries of one row: index (wide) ascending by distance, of which those of the nearest one's sheet count. */
static gnp_status fill_row(const struct work *work, size_t p, const uint32_t *index, struct gnp_scratch *scratch,
                           struct gnp_error *error)
{
	const struct gnp_prepared *prepared = work->prepared;
	const double *normal = prepared->normals + 3 * (size_t)index[0], *origin = work->points + 3 * p;
	double *u = gnp_scratch_take(scratch, work->wide, sizeof *u), *v = gnp_scratch_take(scratch, work->wide, sizeof *v);
	double *share = gnp_scratch_take(scratch, work->wide, sizeof *share), tangents[2][3];
	double *weights[GNP_STENCIL_PARTS] = {share};
	double *value = work->out->value + p * work->wide;
	uint32_t *column = work->out->column + p * work->wide;
	size_t count = 0;
	unsigned used;
	if (!u || !v || !share)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "interpolation: no memory for %zu neighbours", work->wide);
	gnp_tangents_of(normal, tangents);
	memset(value, 0, work->wide * sizeof *value);
	memcpy(column, index, work->wide * sizeof *column);
	for (size_t j = 0; j < work->wide; j++) {
		const double *q = prepared->points + 3 * (size_t)index[j];
		double d[3] = {q[0] - origin[0], q[1] - origin[1], q[2] - origin[2]};
		if (!gnp_same_sheet(normal, prepared->normals + 3 * (size_t)index[j]))
			continue;
		u[count] = gnp_dot(d, tangents[0]);
		v[count] = gnp_dot(d, tangents[1]);
		column[count++] = index[j];
	}
	gnp_status status = gnp_stencil_fit(work->degree, 1, u, v, count, scratch, weights, &used, NULL);
	if (status == GNP_OUT_OF_MEMORY)
		return gnp_error_set(error, status, "interpolation: no memory for %zu neighbours", count);
	if (status == GNP_OK)
		memcpy(value, share, count * sizeof *value);
	else
		value[0] = 1;
	return GNP_OK;
}

static gnp_status rows_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                             struct gnp_error *error)
{
	const struct work *work = context;
	uint32_t *index = gnp_scratch_take(scratch, (end - begin) * work->wide, sizeof *index);
	double *distance = gnp_scratch_take(scratch, (end - begin) * work->wide, sizeof *distance);
	if (!index || !distance)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "interpolation: no memory for %zu points", end - begin);
	gnp_status status = gnp_neighbors_knn(work->prepared->neighbors, work->points + 3 * begin, end - begin, work->wide, index, distance,
	                                      scratch, error);
	for (size_t p = begin; p < end && status == GNP_OK; p++) {
		struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
		work->out->row_offsets[p + 1] = (p + 1) * work->wide;
		status = fill_row(work, p, index + (p - begin) * work->wide, scratch, error);
		gnp_scratch_release(scratch, mark);
	}
	return status;
}

gnp_status gnp_interpolation_make(const struct gnp_prepared *prepared, const double *points, size_t count,
                                  unsigned degree, struct gnp_pool *pool, struct gnp_task *task, struct gnp_csr *out,
                                  struct gnp_error *error)
{
	struct gnp_csr made;
	size_t wide = 2 * gnp_taylor_size(degree) < prepared->count ? 2 * gnp_taylor_size(degree) : prepared->count;
	gnp_status status = gnp_csr_allocate(count, prepared->count, count * wide, &made, error);
	if (status != GNP_OK)
		return status;
	struct work work = {prepared, points, degree, wide, &made};
	status = gnp_pool_run(pool, task, count, POINTS_A_CHUNK, rows_chunk, &work, error);
	if (status == GNP_OK)
		*out = made;
	else
		gnp_csr_clear(&made);
	return status;
}
