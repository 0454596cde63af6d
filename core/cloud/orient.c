#include "core/cloud/orient.h"

#include <math.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/vector.h"
#include "core/cloud/distinct.h"
#include "core/cloud/forest.h"
#include "core/cloud/neighborhoods.h"
#include "core/cloud/outward.h"
#include "core/cloud/pca.h"

/* Terms of an edge's weight besides 1 - |agreement of normals|, and the largest weight told apart. On noisy and undersampled
 * surfaces leaving the tangent planes is the best sign of an edge that misleads; 1 .. 4 serve alike. */
static const double tangent_share = 2, distance_share = 0.02, worst = 3;
/* An edge longer than this many times the smaller radius of its ends is a long one. */
static const double long_ratio = 3;

enum {
	NEIGHBOURS = 16,
	NEIGHBOURS_MAX = 256,
	CHUNK = 256,   /* points a worker takes at a time */
	BLOCK = 8192,  /* points of a serial loop between two looks at the task */
	SHORT = 24576, /* levels of short edges: 0 .. SHORT - 1; long ones take the rest */
	DOUBTFUL = 10032, /* SHORT sqrt(0.5 / worst): from here the normals or the edge tell two stories */
	LEVELS = 32767,
	NO_EDGE = 65535,
	ROOM = 4 /* a row may hold this many times the neighbours asked for, by ties, before its search is cut short */
};

/* The Riemannian graph: every point and its nearest neighbours. */
struct graph {
	const double *points; /* (count, 3) */
	size_t count, k;      /* k: neighbours of a point, itself not counted */
	const struct gnp_neighbors *neighbors;
	struct gnp_pool *pool;
	struct gnp_task *task;
	double *normals;     /* (count, 3) */
	uint32_t *index;     /* (count, k) */
	uint16_t *key;       /* (count, k) level << 1 | opposite, NO_EDGE for an edge that the other end holds too */
	double *radius;      /* (count) distance to the k-th neighbour; later the root of a relative area */
	size_t *start;       /* (LEVELS + 1) */
	struct edge *edges;  /* ascending by level */
	struct gnp_forest forest;
	uint32_t *members, *label; /* (count) */
	bool stop_if_crowded;
	atomic_bool crowded; /* some neighbourhood is mostly points that coincide */
};

struct edge {
	uint32_t from, to; /* to << 1 | opposite */
};

static void between(const double *a, const double *b, double e[3])
{
	for (int c = 0; c < 3; c++)
		e[c] = b[c] - a[c];
}

/* --- neighbours and planes --- */

/* The first k of a row of neighbours without i itself, every stride-th; how many of them coincide with i. */
static size_t choose(const uint32_t *row, const double *distance, size_t length, size_t i, size_t stride, size_t k,
                     uint32_t *chosen)
{
	size_t seen = 0, taken = 0, coincident = 0;
	for (size_t r = 0; r < length && taken < k; r++) {
		if (row[r] == i || ++seen % stride != 0)
			continue;
		coincident += distance[r] == 0;
		chosen[taken++] = row[r];
	}
	return coincident;
}

/* Points on a line or a scan's widely spaced rows: looks four and sixteen times as far, and links the point to a sample
 * of what is found, so that neither its normal nor its connection hangs on one row. */
static gnp_status look_farther(struct graph *graph, size_t i, struct gnp_scratch *scratch, struct gnp_pca *pca,
                               struct gnp_error *error)
{
	static const double collinear = 0.01; /* ratio of variances */
	for (size_t stride = 4; stride <= 16 && pca->values[1] < collinear * pca->values[0]; stride *= 4) {
		size_t wanted = stride * graph->k + 1;
		if (wanted > graph->count)
			break;
		struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
		uint32_t *row = gnp_scratch_take(scratch, wanted, sizeof *row);
		double *distance = gnp_scratch_take(scratch, wanted, sizeof *distance);
		if (!row || !distance)
			return gnp_error_set(error, GNP_OUT_OF_MEMORY, "orient: no memory for %zu neighbours", wanted);
		gnp_status status = gnp_neighbors_knn(graph->neighbors, graph->points + 3 * i, 1, wanted, row, distance,
		                                      scratch, error);
		if (status != GNP_OK)
			return status;
		gnp_pca_fit(graph->points, row, wanted, pca);
		choose(row, distance, wanted, i, stride, graph->k, graph->index + i * graph->k);
		graph->radius[i] = distance[wanted - 1];
		gnp_scratch_release(scratch, mark);
	}
	return GNP_OK;
}

static gnp_status fit_planes(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                             struct gnp_error *error)
{
	struct graph *graph = context;
	struct gnp_neighborhoods rows;
	size_t k = graph->k;
	uint32_t *centres = gnp_scratch_take(scratch, end - begin, sizeof *centres);
	if (!centres)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "orient: no memory for %zu points", end - begin);
	for (size_t i = begin; i < end; i++)
		centres[i - begin] = (uint32_t)i;
	gnp_status status = gnp_neighborhoods_find(graph->neighbors, centres, end - begin, k + 1, 1, ROOM * (k + 1), scratch,
	                                           &rows, error);
	for (size_t i = begin; i < end && status == GNP_OK; i++) {
		size_t at = rows.start[i - begin], length = rows.start[i - begin + 1] - at;
		struct gnp_pca pca;
		if (choose(rows.index + at, rows.distance + at, length, i, 1, k, graph->index + i * k) > k / 4)
			atomic_store_explicit(&graph->crowded, true, memory_order_relaxed);
		graph->radius[i] = rows.r_k[i - begin];
		gnp_pca_fit(graph->points, rows.index + at, k + 1, &pca);
		status = look_farther(graph, i, scratch, &pca, error);
		memcpy(graph->normals + 3 * i, pca.axes[2], sizeof pca.axes[2]);
	}
	return status;
}

/* --- edges --- */

static bool lists(const struct graph *graph, size_t i, size_t j)
{
	const uint32_t *row = graph->index + i * graph->k;
	for (size_t s = 0; s < graph->k; s++)
		if (row[s] == j)
			return true;
	return false;
}

/* The normal of i is carried along the edge e as along a circular arc: by the mirror plane across e. So a fold's two
 * flanks, and the two sides of a thin wall, come out right where parallel transport would not. An edge is trusted
 * the more the better the carried normal agrees with that of j up to sign, the closer it lies to both tangent planes,
 * and the shorter it is. */
static uint16_t edge_key(const struct graph *graph, size_t i, size_t j)
{
	const double *n = graph->normals + 3 * i, *m = graph->normals + 3 * j;
	double e[3];
	between(graph->points + 3 * i, graph->points + 3 * j, e);
	double length = sqrt(gnp_dot(e, e)), along_n = 0, along_m = 0;
	if (length > 0) {
		along_n = gnp_dot(n, e) / length;
		along_m = gnp_dot(m, e) / length;
	}
	double agreement = gnp_dot(n, m) - 2 * along_n * along_m;
	unsigned opposite = agreement < 0, level;
	double narrow = fmin(graph->radius[i], graph->radius[j]);
	if (length > long_ratio * narrow) {
		double octaves = log2(length / narrow) * 32;
		level = SHORT + (unsigned)fmin(octaves, LEVELS - 1 - SHORT);
	} else {
		double w = 1 - fmin(fabs(agreement), 1) + tangent_share * 0.5 * (along_n * along_n + along_m * along_m) +
		           distance_share * length / (graph->radius[i] + graph->radius[j] + 1e-300);
		level = (unsigned)(sqrt(fmin(w / worst, 1)) * (SHORT - 1));
	}
	return (uint16_t)(level << 1 | opposite);
}

static gnp_status weigh_edges(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                              struct gnp_error *error)
{
	struct graph *graph = context;
	(void)scratch;
	(void)error;
	for (size_t i = begin; i < end; i++)
		for (size_t s = 0; s < graph->k; s++) {
			size_t j = graph->index[i * graph->k + s];
			bool twice = j < i && lists(graph, j, i);
			graph->key[i * graph->k + s] = twice ? NO_EDGE : edge_key(graph, i, j);
		}
	return GNP_OK;
}

/* Counting sort of all edges by level; equal levels keep the order of their points. */
static gnp_status sort_edges(struct graph *graph, struct gnp_error *error)
{
	size_t slots = graph->count * graph->k, block = BLOCK * graph->k, sum = 0;
	gnp_status status;
	for (size_t first = 0; first < slots; first += block) {
		if ((status = gnp_task_check(graph->task, error)) != GNP_OK)
			return status;
		for (size_t s = first; s < slots && s < first + block; s++)
			if (graph->key[s] != NO_EDGE)
				graph->start[graph->key[s] >> 1]++;
	}
	for (size_t level = 0; level <= LEVELS; level++) {
		size_t here = graph->start[level];
		graph->start[level] = sum;
		sum += here;
	}
	graph->edges = gnp_array_new(sum, sizeof *graph->edges);
	if (!graph->edges)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "orient: no memory for %zu edges", sum);
	for (size_t i = 0; i < graph->count; i++) {
		if (i % BLOCK == 0 && (status = gnp_task_check(graph->task, error)) != GNP_OK)
			return status;
		for (size_t s = i * graph->k; s < (i + 1) * graph->k; s++)
			if (graph->key[s] != NO_EDGE)
				graph->edges[graph->start[graph->key[s] >> 1]++] =
					(struct edge){(uint32_t)i, graph->index[s] << 1 | (graph->key[s] & 1u)};
	}
	return GNP_OK;
}

/* --- signs --- */

/* Points whose set is smaller than a neighbourhood lose their area: outliers and specks have no say in what is outward. */
static void mark_fragments(struct graph *graph)
{
	bool flipped;
	for (size_t i = 0; i < graph->count; i++)
		if (graph->forest.size[gnp_forest_find(&graph->forest, (uint32_t)i, &flipped)] <= graph->k)
			graph->radius[i] = 0;
}

/* The votes of the edges between two sets, named by their roots a < b: positive for equal signs. */
struct ballot {
	uint32_t a, b;
	int64_t votes;
};

static int compare_pairs(const void *x, const void *y)
{
	const struct ballot *p = x, *q = y;
	if (p->a != q->a)
		return p->a < q->a ? -1 : 1;
	return (p->b > q->b) - (p->b < q->b);
}

static int compare_majorities(const void *x, const void *y)
{
	int64_t p = llabs(((const struct ballot *)x)->votes), q = llabs(((const struct ballot *)y)->votes);
	return p != q ? (p < q ? 1 : -1) : compare_pairs(x, y);
}

/* Joins large sets that only doubtful edges connect: not by the best of these but by the majority of all, clearest first. A
 * tie leaves the two apart. */
static gnp_status vote(struct graph *graph, size_t count, struct gnp_error *error)
{
	struct ballot *ballots = gnp_array_new(count, sizeof *ballots);
	size_t cast = 0, pairs = 0;
	if (!ballots)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "orient: no memory for %zu edges", count);
	for (size_t e = 0; e < count; e++) {
		bool flip_a, flip_b, opposite = graph->edges[e].to & 1;
		uint32_t a = gnp_forest_find(&graph->forest, graph->edges[e].from, &flip_a);
		uint32_t b = gnp_forest_find(&graph->forest, graph->edges[e].to >> 1, &flip_b);
		if (a != b)
			ballots[cast++] = (struct ballot){a < b ? a : b, a < b ? b : a, opposite ^ flip_a ^ flip_b ? -1 : 1};
	}
	qsort(ballots, cast, sizeof *ballots, compare_pairs);
	for (size_t i = 0; i < cast; i++) {
		if (pairs && compare_pairs(&ballots[pairs - 1], &ballots[i]) == 0)
			ballots[pairs - 1].votes += ballots[i].votes;
		else
			ballots[pairs++] = ballots[i];
	}
	qsort(ballots, pairs, sizeof *ballots, compare_majorities);
	for (size_t i = 0; i < pairs && ballots[i].votes != 0; i++)
		gnp_forest_join(&graph->forest, ballots[i].a, ballots[i].b, ballots[i].votes < 0, SIZE_MAX);
	free(ballots);
	return GNP_OK;
}

/* Kruskal, by weight, while edges are sound. Doubtful ones, and long ones (that lead to where points lie much denser), join
 * small sets only and vote on large ones. Long edges of fragments do not vote: an outlier between two surfaces goes
 * to one of them and does not bridge them. */
static gnp_status grow_forest(struct graph *graph, struct gnp_error *error)
{
	size_t sound = graph->start[DOUBTFUL - 1], shorts = graph->start[SHORT - 1], total = graph->start[LEVELS - 1];
	size_t deferred = 0;
	for (size_t e = 0; e < total; e++) {
		if (e % (4 * BLOCK) == 0) {
			gnp_status status = gnp_task_check(graph->task, error);
			if (status != GNP_OK)
				return status;
		}
		if (e == shorts)
			mark_fragments(graph);
		struct edge edge = graph->edges[e];
		uint32_t a = edge.from, b = edge.to >> 1;
		bool joined = gnp_forest_join(&graph->forest, a, b, edge.to & 1, e < sound ? SIZE_MAX : graph->k);
		bool fragment = e >= shorts && (graph->radius[a] == 0 || graph->radius[b] == 0);
		if (e >= sound && !joined && !fragment)
			graph->edges[deferred++] = edge;
	}
	return deferred ? vote(graph, deferred, error) : GNP_OK;
}

static void negate(double *n)
{
	for (int c = 0; c < 3; c++)
		n[c] = -n[c];
}

/* Gives every point the sign of its set's root and sorts the points by set: components numbered by their lowest point. */
static gnp_status apply_signs(struct graph *graph, size_t **starts, size_t *components, struct gnp_error *error)
{
	size_t found = 0, sum = 0;
	gnp_status status;
	uint32_t *number = graph->forest.size; /* the sizes have done their work: 0 stands for not numbered yet */
	memset(number, 0, graph->count * sizeof *number);
	for (size_t i = 0; i < graph->count; i++) {
		bool flipped;
		if (i % BLOCK == 0 && (status = gnp_task_check(graph->task, error)) != GNP_OK)
			return status;
		uint32_t root = gnp_forest_find(&graph->forest, (uint32_t)i, &flipped);
		if (!number[root])
			number[root] = (uint32_t)++found;
		graph->label[i] = number[root] - 1;
		if (flipped)
			negate(graph->normals + 3 * i);
	}
	size_t *start = *starts = gnp_array_zero(found + 1, sizeof *start);
	if (!start)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "orient: no memory for %zu components", found);
	for (size_t i = 0; i < graph->count; i++)
		start[graph->label[i]]++;
	for (size_t c = 0; c <= found; c++) {
		size_t here = start[c];
		start[c] = sum;
		sum += here;
	}
	for (size_t i = 0; i < graph->count; i++)
		graph->members[start[graph->label[i]]++] = (uint32_t)i;
	*components = found;
	return GNP_OK;
}

static gnp_status turn_outward(struct graph *graph, const size_t *end, size_t components, struct gnp_error *error)
{
	for (size_t c = 0, begin = 0; c < components; begin = end[c++]) {
		gnp_status status = gnp_task_check(graph->task, error);
		if (status != GNP_OK)
			return status;
		if (!gnp_outward_flips(graph->points, graph->normals, graph->radius, graph->members + begin, end[c] - begin))
			continue;
		for (size_t m = begin; m < end[c]; m++)
			negate(graph->normals + 3 * (size_t)graph->members[m]);
	}
	return GNP_OK;
}

/* --- the whole --- */

static bool graph_init(struct graph *graph)
{
	size_t slots;
	if (!gnp_size_multiply(graph->count, graph->k, &slots))
		return false;
	graph->index = gnp_array_new(slots, sizeof *graph->index);
	graph->key = gnp_array_new(slots, sizeof *graph->key);
	graph->radius = gnp_array_new(graph->count, sizeof *graph->radius);
	graph->start = gnp_array_zero(LEVELS + 1, sizeof *graph->start);
	return graph->index && graph->key && graph->radius && graph->start;
}

static void graph_clear(struct graph *graph)
{
	free(graph->index);
	free(graph->key);
	free(graph->radius);
	free(graph->start);
	free(graph->edges);
	free(graph->members);
	gnp_forest_clear(&graph->forest);
}

static gnp_status propagate(struct graph *graph, size_t *components, struct gnp_error *error)
{
	size_t *ends = NULL, found = 0;
	gnp_status status = sort_edges(graph, error);
	if (status != GNP_OK)
		return status;
	/* What is done with makes room. */
	free(graph->key);
	graph->key = NULL;
	graph->label = graph->index;
	graph->members = gnp_array_new(graph->count, sizeof *graph->members);
	if (!gnp_forest_init(&graph->forest, graph->count) || !graph->members)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "orient: no memory for %zu points", graph->count);
	status = grow_forest(graph, error);
	if (status == GNP_OK)
		status = apply_signs(graph, &ends, &found, error);
	if (status == GNP_OK)
		status = turn_outward(graph, ends, found, error);
	free(ends);
	if (status == GNP_OK && components)
		*components = found;
	return status;
}

static gnp_status run_stages(struct graph *graph, size_t *components, struct gnp_error *error)
{
	gnp_status status = gnp_pool_run(graph->pool, graph->task, graph->count, CHUNK, fit_planes, graph, error);
	if (status != GNP_OK || (graph->stop_if_crowded && atomic_load(&graph->crowded)))
		return status;
	status = gnp_pool_run(graph->pool, graph->task, graph->count, CHUNK, weigh_edges, graph, error);
	return status == GNP_OK ? propagate(graph, components, error) : status;
}

/* crowded (may be NULL): set, and the rest left undone, when many points coincide. */
static gnp_status orient(const double *points, size_t count, const struct gnp_neighbors *neighbors, size_t k,
                         struct gnp_pool *pool, struct gnp_task *task, double *normals, size_t *components,
                         bool *crowded, struct gnp_error *error)
{
	if (count < 2) {
		if (count)
			memcpy(normals, (double[3]){0, 0, 1}, 3 * sizeof *normals);
		if (components)
			*components = count;
		return GNP_OK;
	}
	struct graph graph = {.points = points, .count = count, .neighbors = neighbors, .pool = pool, .task = task,
	                      .normals = normals, .k = k < count ? k : count - 1, .stop_if_crowded = crowded};
	gnp_status status = graph_init(&graph) ? run_stages(&graph, components, error)
	                                       : gnp_error_set(error, GNP_OUT_OF_MEMORY, "orient: no memory for %zu points", count);
	if (crowded)
		*crowded = atomic_load(&graph.crowded);
	graph_clear(&graph);
	return status;
}

/* Where many points coincide a neighbourhood may hold nothing else: orients the places they lie at instead. */
static gnp_status orient_places(const double *points, size_t count, size_t k, struct gnp_pool *pool,
                                struct gnp_task *task, double *normals, size_t *components, struct gnp_error *error)
{
	size_t places = 0;
	struct gnp_neighbors *neighbors = NULL;
	uint32_t *which = gnp_array_new(count, sizeof *which), *first = gnp_array_new(count, sizeof *first);
	double *at = NULL, *normal = NULL;
	gnp_status status = which && first ? gnp_distinct_find(points, count, task, which, first, &places, error)
	                                   : gnp_error_set(error, GNP_OUT_OF_MEMORY, "orient: no memory for %zu points", count);
	if (status != GNP_OK)
		goto done;
	at = gnp_array_new(places, 3 * sizeof *at);
	normal = gnp_array_new(places, 3 * sizeof *normal);
	if (!at || !normal) {
		status = gnp_error_set(error, GNP_OUT_OF_MEMORY, "orient: no memory for %zu points", places);
		goto done;
	}
	for (size_t p = 0; p < places; p++)
		memcpy(at + 3 * p, points + 3 * (size_t)first[p], 3 * sizeof *at);
	status = gnp_neighbors_build(at, places, &neighbors, error);
	if (status == GNP_OK)
		status = orient(at, places, neighbors, k, pool, task, normal, components, NULL, error);
	for (size_t i = 0; i < count && status == GNP_OK; i++)
		memcpy(normals + 3 * i, normal + 3 * (size_t)which[i], 3 * sizeof *normal);
done:
	gnp_neighbors_free(neighbors);
	free(which);
	free(first);
	free(at);
	free(normal);
	return status;
}

gnp_status gnp_orient_normals(const double *points, size_t count, const struct gnp_neighbors *neighbors, size_t k,
                              struct gnp_pool *pool, struct gnp_task *task, double *normals,
                              size_t *components, struct gnp_error *error)
{
	if (k > NEIGHBOURS_MAX)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "k: got %zu, need at most %d", k, NEIGHBOURS_MAX);
	bool crowded = false;
	k = k ? k : NEIGHBOURS;
	gnp_status status = orient(points, count, neighbors, k, pool, task, normals, components, &crowded, error);
	if (status != GNP_OK || !crowded)
		return status;
	return orient_places(points, count, k, pool, task, normals, components, error);
}
