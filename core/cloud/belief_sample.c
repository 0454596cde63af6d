#include "core/cloud/belief_sample.h"

#include <math.h>
#include <stdlib.h>

#include "core/base/memory.h"
#include "core/base/select.h"
#include "core/base/vector.h"
#include "core/fit/least_squares.h"
#include "core/fit/taylor.h"
#include "core/linear/pca.h"

/* Points looked at: one of EVERY, so that small clouds do not pay more for it than for their answer, and a share of
 * FEWEST points is one. */
enum { EVERY = 50, SAMPLES_LEAST = 40, SAMPLES_MOST = 512, FEWEST = 3, CHUNK = 8 };

static const double PI = 3.14159265358979323846, DEGREES = 57.295779513082321;

size_t gnp_belief_sample_stride(size_t count)
{
	size_t wanted = count / EVERY;
	wanted = wanted < SAMPLES_LEAST ? SAMPLES_LEAST : wanted > SAMPLES_MOST ? SAMPLES_MOST : wanted;
	return (count + wanted - 1) / wanted;
}

double gnp_belief_angle(double cosine)
{
	return DEGREES * acos(fmax(fmin(cosine, 1), -1));
}

static void between(const double *from, const double *to, double d[3])
{
	for (int c = 0; c < 3; c++)
		d[c] = to[c] - from[c];
}

/* Of points in rows the nearest lie on a line, whose plane means nothing: looks farther until they span two directions.
 * False when the row does not. */
bool gnp_belief_see_plane(const struct gnp_prepared *prepared, const struct gnp_belief_row *row, const double normal[3],
                          struct gnp_belief_look *look)
{
	static const double spans = 0.1; /* ratio of variances */
	struct gnp_pca pca;
	bool spanned;
	for (size_t k = gnp_belief_at_most(GNP_BELIEF_NEAR, row);; k = gnp_belief_at_most(2 * k, row)) {
		gnp_pca_fit(prepared->points, row->index, k, &pca);
		look->spanned = k;
		spanned = pca.values[1] >= spans * pca.values[0];
		if (k == row->count || spanned)
			break;
	}
	look->flat = pca.values[1] > 0 ? pca.values[2] / pca.values[1] : INFINITY;
	look->tilt = gnp_belief_angle(fabs(gnp_dot(normal, pca.axes[2])));
	return spanned;
}

bool gnp_belief_tilted(const struct gnp_belief_look *look)
{
	static const double flat = 0.1;
	return look->flat < flat && look->tilt > GNP_BELIEF_TILT;
}

/* Root mean square heights of the nearest: over their mean, and per degree of freedom what a quadratic leaves of
 * them. */
static void see_heights(const struct gnp_prepared *prepared, const struct gnp_belief_row *row,
                        struct gnp_belief_look *look)
{
	enum { STRIDE = 8, SIZE = 6 };
	_Alignas(64) double rows[GNP_BELIEF_NEAR * STRIDE], gram[STRIDE * STRIDE], moment[STRIDE];
	double u[GNP_BELIEF_NEAR], v[GNP_BELIEF_NEAR], w[GNP_BELIEF_NEAR], ones[GNP_BELIEF_NEAR], d[3], mean = 0, square = 0, explained = 0;
	size_t near = gnp_belief_at_most(GNP_BELIEF_NEAR, row);
	double radius = row->distance[near - 1];
	struct gnp_pca pca;
	look->small = NAN;
	look->rough = 0;
	if (!(radius > 0))
		return;
	gnp_pca_fit(prepared->points, row->index, near, &pca);
	for (size_t j = 0; j < near; j++) {
		between(prepared->points + 3 * (size_t)row->index[0], prepared->points + 3 * (size_t)row->index[j], d);
		u[j] = gnp_dot(d, pca.axes[0]) / radius;
		v[j] = gnp_dot(d, pca.axes[1]) / radius;
		w[j] = gnp_dot(d, pca.axes[2]) / radius;
		ones[j] = 1;
		mean += w[j] / (double)near;
	}
	for (size_t j = 0; j < near; j++) {
		w[j] -= mean;
		square += w[j] * w[j];
	}
	look->rough = sqrt(square / (double)near) * radius / look->spacing;
	if (near <= SIZE)
		return;
	gnp_taylor_rows(2, u, v, near, STRIDE, rows);
	gnp_normal_equations(rows, ones, w, near, STRIDE, gram, moment);
	if (!gnp_cholesky_factor(gram, SIZE, STRIDE, GNP_SMALLEST_PIVOT))
		return;
	gnp_cholesky_forward(gram, SIZE, STRIDE, moment, moment);
	for (size_t i = 0; i < SIZE; i++)
		explained += moment[i] * moment[i];
	look->small = sqrt(fmax(square - explained, 0) / (double)(near - SIZE)) * radius / look->spacing;
}

gnp_status gnp_belief_find_row(const struct gnp_prepared *prepared, size_t i, size_t count, struct gnp_scratch *scratch,
                               struct gnp_belief_row *row, struct gnp_error *error)
{
	row->count = count < prepared->count ? count : prepared->count;
	return gnp_neighbors_knn(prepared->neighbors, prepared->points + 3 * i, 1, row->count, row->index, row->distance, scratch, error);
}

struct work {
	struct gnp_belief_sample *sample;
	gnp_belief_look_fn look;
	const void *context;
};

static gnp_status look_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                             struct gnp_error *error)
{
	const struct work *work = context;
	struct gnp_belief_row row;
	gnp_status status = GNP_OK;
	for (size_t s = begin; s < end && status == GNP_OK; s++) {
		struct gnp_belief_look *look = &work->sample->looks[s];
		status = work->look(work->sample, work->context, s, scratch, &row, error);
		if (status != GNP_OK)
			break;
		size_t near = gnp_belief_at_most(2 * GNP_BELIEF_NEAR, &row);
		look->spacing = row.distance[near - 1] * sqrt(PI / (double)near);
		see_heights(work->sample->prepared, &row, look);
	}
	return status;
}

gnp_status gnp_belief_sample_make(const struct gnp_prepared *prepared, gnp_belief_look_fn look, const void *context,
                                  struct gnp_pool *pool, struct gnp_task *task, struct gnp_belief_sample *out,
                                  struct gnp_error *error)
{
	struct gnp_belief_sample sample = {.prepared = prepared, .stride = gnp_belief_sample_stride(prepared->count)};
	struct work work = {&sample, look, context};
	sample.count = (prepared->count + sample.stride - 1) / sample.stride;
	sample.looks = gnp_array_zero(sample.count, sizeof *sample.looks);
	if (!sample.looks)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "belief: no memory for %zu points", sample.count);
	gnp_status status = gnp_pool_run(pool, task, sample.count, CHUNK, look_chunk, &work, error);
	if (status == GNP_OK)
		*out = sample;
	else
		free(sample.looks);
	return status;
}

double gnp_belief_sample_share(const struct gnp_belief_sample *sample, bool (*holds)(const void *context, size_t s),
                               const void *context)
{
	size_t count = 0;
	for (size_t s = 0; s < sample->count; s++)
		count += holds(context, s);
	return count < FEWEST ? 0 : 100 * (double)count / (double)sample->count;
}

double gnp_belief_sample_median(const struct gnp_belief_sample *sample, double (*of)(const void *context, size_t s),
                                const void *context, double *values)
{
	size_t known = 0;
	for (size_t s = 0; s < sample->count; s++) {
		double value = of(context, s);
		if (isfinite(value))
			values[known++] = value;
	}
	return gnp_median(values, known);
}
