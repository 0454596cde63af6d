#include "core/cloud/isolated.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/forest.h"
#include "core/base/memory.h"
#include "core/base/select.h"
#include "core/base/vector.h"
#include "core/linear/pca.h"

static const double SCATTERED = 0.1; /* mean share of the least variance that no surface has */
static const double AWAY_MOST = 1e100; /* finite where a spacing is next to nothing */

enum { NEAR = 17 /* the point itself and 16 more */, SIXTH = 6, POINTS_A_CHUNK = 512 };

struct work {
	const struct gnp_prepared *prepared;
	double link;
	size_t near;       /* NEAR, or all points of a smaller cloud */
	uint32_t *index;   /* (count, near) */
	double *own;       /* (count) spacing by the sixth neighbour, or the first after it that is elsewhere: six share a disk of its distance */
	double *spacing;   /* (count) its median over the neighbours; 0: all of them are at one place */
	double *bulk;      /* (count) the least variance of the neighbours over the sum of all three */
	const struct gnp_neighbors *rest; /* those that are none */
	const double *places;             /* (isolated points, 3) */
	double *gap;                      /* (isolated points) */
};

static gnp_status search_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	struct work *work = context;
	size_t near = work->near;
	double *distance = gnp_scratch_take(scratch, (end - begin) * near, sizeof *distance);
	if (!distance)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "isolated points: no memory for %zu points", end - begin);
	gnp_status status = gnp_neighbors_knn(work->prepared->neighbors, work->prepared->points + 3 * begin, end - begin, near,
	                                      work->index + begin * near, distance, scratch, error);
	for (size_t i = begin; i < end && status == GNP_OK; i++) {
		const double *row = distance + (i - begin) * near;
		size_t sixth = near > SIXTH ? SIXTH : near - 1;
		while (sixth + 1 < near && !(row[sixth] > 0))
			sixth++;
		work->own[i] = row[sixth] / sqrt(SIXTH / acos(-1));
	}
	return status;
}

static gnp_status settle_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	struct work *work = context;
	(void)scratch, (void)error;
	for (size_t i = begin; i < end; i++) {
		double values[NEAR];
		struct gnp_pca pca;
		gnp_pca_fit(work->prepared->points, work->index + i * work->near, work->near, &pca);
		double sum = pca.values[0] + pca.values[1] + pca.values[2];
		size_t known = 0;
		work->bulk[i] = sum > 0 ? pca.values[2] / sum : 0;
		for (size_t j = 0; j < work->near; j++) {
			values[known] = work->own[work->index[i * work->near + j]];
			known += values[known] > 0;
		}
		work->spacing[i] = gnp_median(values, known);
	}
	return GNP_OK;
}

/* The smaller spacing of two points that has one. */
static double lesser_spacing(const struct work *work, size_t a, size_t b)
{
	double x = work->spacing[a], y = work->spacing[b];
	return x > 0 && y > 0 ? fmin(x, y) : fmax(x, y);
}

static double distance_of(const struct work *work, size_t a, size_t b)
{
	const double *p = work->prepared->points + 3 * a, *q = work->prepared->points + 3 * b;
	const double d[3] = {p[0] - q[0], p[1] - q[1], p[2] - q[2]};
	return sqrt(gnp_dot(d, d));
}

/* Joins linked points; polled. */
static gnp_status link_points(const struct work *work, struct gnp_forest *forest, struct gnp_task *task, struct gnp_error *error)
{
	enum { POLL = 8192 };
	gnp_status status = GNP_OK;
	for (size_t i = 0; i < work->prepared->count && status == GNP_OK; i++) {
		for (size_t j = 0; j < work->near; j++) {
			size_t other = work->index[i * work->near + j];
			if (distance_of(work, i, other) <= work->link * lesser_spacing(work, i, other))
				gnp_forest_join(forest, (uint32_t)i, (uint32_t)other, false, SIZE_MAX);
		}
		if (i % POLL == 0)
			status = gnp_task_check(task, error);
	}
	return status;
}

/* bulk (count): that of a piece is added up at its root. */
static void add_up(struct gnp_forest *forest, size_t count, const double *bulk, double *sum, size_t *largest)
{
	bool flipped;
	memset(sum, 0, count * sizeof *sum);
	*largest = 0;
	for (size_t i = 0; i < count; i++) {
		uint32_t root = gnp_forest_find(forest, (uint32_t)i, &flipped);
		sum[root] += bulk[i];
		*largest = forest->size[root] > *largest ? forest->size[root] : *largest;
	}
}

/* Marks the members of pieces that are too small, or no surface. */
static gnp_status mark(const struct work *work, size_t cluster, struct gnp_task *task, unsigned char *isolated, size_t *isolated_count,
                       struct gnp_error *error)
{
	struct gnp_forest forest;
	size_t count = work->prepared->count, largest;
	double *sum = gnp_array_new(count, sizeof *sum);
	bool flipped, room = gnp_forest_init(&forest, count) && sum;
	gnp_status status = room ? link_points(work, &forest, task, error)
	                         : gnp_error_set(error, GNP_OUT_OF_MEMORY, "isolated points: no memory for %zu points", count);
	*isolated_count = 0;
	if (status == GNP_OK)
		add_up(&forest, count, work->bulk, sum, &largest);
	for (size_t i = 0; i < count && status == GNP_OK; i++) {
		uint32_t root = gnp_forest_find(&forest, (uint32_t)i, &flipped);
		size_t size = forest.size[root];
		isolated[i] = size < largest && (size < cluster || sum[root] > SCATTERED * (double)size);
		*isolated_count += isolated[i];
	}
	gnp_forest_clear(&forest);
	free(sum);
	return status;
}

static gnp_status gap_chunk(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	struct work *work = context;
	uint32_t *index = gnp_scratch_take(scratch, end - begin, sizeof *index);
	if (!index)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "isolated points: no memory for %zu points", end - begin);
	return gnp_neighbors_knn(work->rest, work->places + 3 * begin, end - begin, 1, index, work->gap + begin, scratch, error);
}

/* How far isolated points are from the rest. */
static gnp_status measure_gaps(struct work *work, const unsigned char *isolated, size_t isolated_count, struct gnp_pool *pool, struct gnp_task *task,
                               double *away, struct gnp_error *error)
{
	const struct gnp_prepared *prepared = work->prepared;
	size_t count = prepared->count, rests = 0, at = 0;
	double *rest = gnp_array_new(count - isolated_count, 3 * sizeof *rest), *places = gnp_array_new(isolated_count, 3 * sizeof *places);
	double *gap = gnp_array_new(isolated_count, sizeof *gap);
	struct gnp_neighbors *tree = NULL;
	gnp_status status = rest && places && gap ? GNP_OK : gnp_error_set(error, GNP_OUT_OF_MEMORY, "isolated points: no memory for %zu points", count);
	for (size_t i = 0; i < count && status == GNP_OK; i++)
		memcpy(isolated[i] ? places + 3 * at++ : rest + 3 * rests++, prepared->points + 3 * i, 3 * sizeof *rest);
	if (status == GNP_OK)
		status = gnp_neighbors_build(rest, rests, &tree, error);
	work->rest = tree;
	work->places = places;
	work->gap = gap;
	if (status == GNP_OK)
		status = gnp_pool_run(pool, task, isolated_count, POINTS_A_CHUNK, gap_chunk, work, error);
	at = 0;
	for (size_t i = 0; i < count && status == GNP_OK; i++)
		away[i] = isolated[i] ? fmin(gap[at++] / fmax(work->spacing[i], 1e-300), AWAY_MOST) : 0;
	gnp_neighbors_free(tree);
	free(rest);
	free(places);
	free(gap);
	return status;
}

gnp_status gnp_isolated_find(const struct gnp_prepared *prepared, double link, size_t cluster, struct gnp_pool *pool, struct gnp_task *task,
                           unsigned char *isolated, double *away, size_t *isolated_count, struct gnp_error *error)
{
	size_t count = prepared->count, near = NEAR < count ? NEAR : count;
	struct work work = {.prepared = prepared, .link = link, .near = near, .index = gnp_array_new(count, near * sizeof *work.index),
	                    .own = gnp_array_new(count, sizeof *work.own), .spacing = gnp_array_new(count, sizeof *work.spacing),
	                    .bulk = gnp_array_new(count, sizeof *work.bulk)};
	gnp_status status = work.index && work.own && work.spacing && work.bulk
	                            ? GNP_OK
	                            : gnp_error_set(error, GNP_OUT_OF_MEMORY, "isolated points: no memory for %zu points", count);
	if (status == GNP_OK)
		status = gnp_pool_run(pool, task, count, POINTS_A_CHUNK, search_chunk, &work, error);
	if (status == GNP_OK)
		status = gnp_pool_run(pool, task, count, POINTS_A_CHUNK, settle_chunk, &work, error);
	if (status == GNP_OK)
		status = mark(&work, cluster, task, isolated, isolated_count, error);
	if (status == GNP_OK && *isolated_count)
		status = measure_gaps(&work, isolated, *isolated_count, pool, task, away, error);
	else if (status == GNP_OK)
		memset(away, 0, count * sizeof *away);
	free(work.index);
	free(work.own);
	free(work.spacing);
	free(work.bulk);
	return status;
}
