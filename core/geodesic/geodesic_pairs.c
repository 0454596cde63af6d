/* Distances between the points of pairs (geodesic.h): a front from each point of the side that has fewer of them,
 * a few of them at a time. */
#include <math.h>
#include <stdlib.h>

#include "core/base/memory.h"
#include "core/base/vector.h"
#include "core/cells/front.h"
#include "core/geodesic/geodesic.h"
#include "core/geodesic/geodesic_parts.h"

/* A way that is asked for, between places in curve order. */
struct way {
	uint32_t from, to;
	size_t pair;
};

struct work {
	const struct gnp_geodesic *geodesic;
	struct gnp_task *task;
	struct way *ways;     /* (count) by from */
	uint32_t *goals;      /* (count) to of each way */
	size_t *start;        /* (fronts + 1) of each front's ways */
	double *distance;     /* of each pair */
	size_t fronts, lanes;
};

enum { LANES = 4 }; /* fronts at a time, at most: each one holds what a whole cloud needs */

static int compare(const void *a, const void *b)
{
	const struct way *x = a, *y = b;
	if (x->from != y->from)
		return x->from < y->from ? -1 : 1;
	return (x->pair > y->pair) - (x->pair < y->pair);
}

static gnp_status check(const struct gnp_geodesic *geodesic, const uint32_t (*pairs)[2], size_t count,
                        struct gnp_error *error)
{
	for (size_t p = 0; p < count; p++)
		for (size_t k = 0; k < 2; k++)
			if (pairs[p][k] >= geodesic->domain.cloud_count)
				return gnp_error_set(error, GNP_INVALID_ARGUMENT, "pairs[%zu]: got point %u, the cloud has %zu", p,
				                     pairs[p][k], geodesic->domain.cloud_count);
	return GNP_OK;
}

/* How many points one side of the pairs has; seen (cloud's points): zero, and so again. */
static size_t count_distinct(const uint32_t (*pairs)[2], size_t count, size_t side, unsigned char *seen)
{
	size_t distinct = 0;
	for (size_t p = 0; p < count; p++) {
		distinct += !seen[pairs[p][side]];
		seen[pairs[p][side]] = 1;
	}
	for (size_t p = 0; p < count; p++)
		seen[pairs[p][side]] = 0;
	return distinct;
}

/* Returns how many ways there are: none to or from a point that was dropped. */
static size_t list_ways(const struct gnp_geodesic *geodesic, const uint32_t (*pairs)[2], size_t count, size_t side,
                        struct way *ways)
{
	size_t made = 0;
	for (size_t p = 0; p < count; p++) {
		uint32_t from = geodesic->place[pairs[p][side]], to = geodesic->place[pairs[p][1 - side]];
		if (from != GNP_GEODESIC_DROPPED && to != GNP_GEODESIC_DROPPED)
			ways[made++] = (struct way){from, to, p};
	}
	qsort(ways, made, sizeof *ways, compare);
	return made;
}

/* Where each front's ways begin; returns how many fronts. */
static size_t part(struct work *work, size_t ways)
{
	size_t fronts = 0;
	for (size_t w = 0; w < ways; w++) {
		work->goals[w] = work->ways[w].to;
		if (w == 0 || work->ways[w].from != work->ways[w - 1].from)
			work->start[fronts++] = w;
	}
	work->start[fronts] = ways;
	return fronts;
}

static double straight(const double *p, const double *q)
{
	const double d[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]};
	return sqrt(gnp_dot(d, d));
}

/* One front; found (points): room. */
static gnp_status find_ways(const struct work *work, size_t front, double *found, struct gnp_error *error)
{
	const struct gnp_prepared *prepared = &work->geodesic->domain.prepared;
	size_t first = work->start[front], last = work->start[front + 1];
	const struct gnp_front_goals goals = {work->goals + first, last - first, 2 * work->geodesic->longest};
	gnp_status status = gnp_front_find(prepared, &work->geodesic->shared, &work->ways[first].from, 1, NULL, &goals,
	                                   work->task, found, error);
	for (size_t w = first; w < last && status == GNP_OK; w++) {
		const struct way *way = &work->ways[w];
		double line = straight(prepared->points + 3 * (size_t)way->from, prepared->points + 3 * (size_t)way->to);
		work->distance[way->pair] = fmax(found[way->to], line);
	}
	return status == GNP_OK ? gnp_task_check(work->task, error) : status;
}

static gnp_status lane(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	const struct work *work = context;
	size_t points = work->geodesic->domain.prepared.count;
	double *found = gnp_array_new(points, sizeof *found);
	gnp_status status = found ? GNP_OK : gnp_no_memory("pairs", points, "points", error);
	(void)scratch, (void)end; /* one lane a chunk */
	for (size_t f = begin; f < work->fronts && status == GNP_OK; f += work->lanes)
		status = find_ways(work, f, found, error);
	free(found);
	return status;
}

static gnp_status find(struct work *work, const uint32_t (*pairs)[2], size_t count, struct gnp_pool *pool,
                       struct gnp_error *error)
{
	unsigned char *seen = gnp_array_zero(work->geodesic->domain.cloud_count, 1);
	if (!seen || !work->ways || !work->goals || !work->start) {
		free(seen);
		return gnp_no_memory("pairs", count, "pairs", error);
	}
	size_t side = count_distinct(pairs, count, 1, seen) < count_distinct(pairs, count, 0, seen);
	free(seen);
	work->fronts = part(work, list_ways(work->geodesic, pairs, count, side, work->ways));
	work->lanes = work->fronts < LANES ? work->fronts : LANES;
	gnp_task_stage(work->task, GNP_STAGE_SOLVE, work->lanes);
	return gnp_pool_run(pool, work->task, work->lanes, 1, lane, work, error);
}

gnp_status gnp_geodesic_pairs(const struct gnp_geodesic *geodesic, const uint32_t (*pairs)[2], size_t count,
                              struct gnp_pool *pool, struct gnp_task *task, double *distance, struct gnp_error *error)
{
	gnp_status status = check(geodesic, pairs, count, error);
	if (status != GNP_OK)
		return status;
	struct work work = {.geodesic = geodesic, .task = task, .ways = gnp_array_new(count + 1, sizeof *work.ways),
	                    .goals = gnp_array_new(count + 1, sizeof *work.goals),
	                    .start = gnp_array_new(count + 1, sizeof *work.start), .distance = distance};
	for (size_t p = 0; p < count; p++)
		distance[p] = INFINITY;
	status = find(&work, pairs, count, pool, error);
	gnp_task_stage(task, GNP_STAGE_DONE, 0);
	free(work.ways);
	free(work.goals);
	free(work.start);
	return status;
}
