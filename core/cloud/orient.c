#include "core/cloud/orient.h"

#include <stdlib.h>
#include <string.h>

#include "core/base/forest.h"
#include "core/base/memory.h"
#include "core/cloud/distinct.h"
#include "core/cloud/orient_graph.h"
#include "core/cloud/outward.h"
#include "core/cloud/settle.h"

enum {
	NEIGHBOURS = 16,
	NEIGHBOURS_MAX = 256,
	BLOCK = 8192 /* points of a serial loop between two looks at the task */
};

/* Signs that spread along the edges of a graph. */
struct signs {
	struct gnp_orient_graph *graph;
	struct gnp_forest forest;
	uint32_t *members; /* (count) points by set */
	uint32_t *label;   /* (count) the set of each */
};

static gnp_status no_memory(size_t points, struct gnp_error *error)
{
	return gnp_error_set(error, GNP_OUT_OF_MEMORY, "orient: no memory for %zu points", points);
}

/* Points whose set is smaller than a neighbourhood lose their area: outliers and specks have no say in what is
 * outward. */
static void mark_fragments(struct signs *signs)
{
	struct gnp_orient_graph *graph = signs->graph;
	bool flipped;
	for (size_t i = 0; i < graph->count; i++)
		if (signs->forest.size[gnp_forest_find(&signs->forest, (uint32_t)i, &flipped)] <= graph->k)
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

/* Joins large sets that only doubtful edges connect: not by the best of these but by the majority of all, clearest
 * first. A tie leaves the two apart. */
static gnp_status vote(struct signs *signs, const struct gnp_orient_edge *edges, size_t count, struct gnp_error *error)
{
	struct ballot *ballots = gnp_array_new(count, sizeof *ballots);
	size_t cast = 0, pairs = 0;
	if (!ballots)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "orient: no memory for %zu edges", count);
	for (size_t e = 0; e < count; e++) {
		bool flip_a, flip_b, opposite = edges[e].to & 1;
		uint32_t a = gnp_forest_find(&signs->forest, edges[e].from, &flip_a);
		uint32_t b = gnp_forest_find(&signs->forest, edges[e].to >> 1, &flip_b);
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
		gnp_forest_join(&signs->forest, ballots[i].a, ballots[i].b, ballots[i].votes < 0, SIZE_MAX);
	free(ballots);
	return GNP_OK;
}

/* Moves an edge to the end of those that wait: all edges are kept, sound ones in their order. */
static void defer(struct gnp_orient_edge *edges, size_t from, size_t to)
{
	struct gnp_orient_edge edge = edges[from];
	edges[from] = edges[to];
	edges[to] = edge;
}

/* Kruskal, by weight, while edges are sound. Doubtful ones, and long ones (that lead to where points lie much
 * denser), join small sets only and vote on large ones. Long edges of fragments do not vote: an outlier between
 * two surfaces goes to one of them and does not bridge them. */
static gnp_status grow_forest(struct signs *signs, struct gnp_error *error)
{
	struct gnp_orient_graph *graph = signs->graph;
	size_t sound = graph->sound_count, shorts = graph->short_count, deferred = 0;
	for (size_t e = 0; e < graph->edge_count; e++) {
		if (e % (4 * BLOCK) == 0) {
			gnp_status status = gnp_task_check(graph->task, error);
			if (status != GNP_OK)
				return status;
		}
		if (e == shorts)
			mark_fragments(signs);
		struct gnp_orient_edge edge = graph->edges[e];
		uint32_t a = edge.from, b = edge.to >> 1;
		bool joined = gnp_forest_join(&signs->forest, a, b, edge.to & 1, e < sound ? SIZE_MAX : graph->k);
		bool fragment = e >= shorts && (graph->radius[a] == 0 || graph->radius[b] == 0);
		if (e >= sound && !joined && !fragment)
			defer(graph->edges, e, sound + deferred++);
	}
	return deferred ? vote(signs, graph->edges + sound, deferred, error) : GNP_OK;
}

static void negate(double *n)
{
	for (int c = 0; c < 3; c++)
		n[c] = -n[c];
}

/* Gives every point the sign of its set's root, and its set's number: components are numbered by their lowest point. */
static gnp_status apply_signs(struct signs *signs, size_t *components, struct gnp_error *error)
{
	const struct gnp_orient_graph *graph = signs->graph;
	size_t found = 0;
	uint32_t *number = signs->forest.size; /* the sizes have done their work: 0 stands for not numbered yet */
	memset(number, 0, graph->count * sizeof *number);
	for (size_t i = 0; i < graph->count; i++) {
		bool flipped;
		gnp_status status = i % BLOCK == 0 ? gnp_task_check(graph->task, error) : GNP_OK;
		if (status != GNP_OK)
			return status;
		uint32_t root = gnp_forest_find(&signs->forest, (uint32_t)i, &flipped);
		if (!number[root])
			number[root] = (uint32_t)++found;
		signs->label[i] = number[root] - 1;
		if (flipped)
			negate(graph->normals + 3 * i);
	}
	*components = found;
	return GNP_OK;
}

/* Sorts the points by set. *ends (components + 1): where the members of each set end, owned. */
static gnp_status sort_members(struct signs *signs, size_t components, size_t **ends, struct gnp_error *error)
{
	size_t count = signs->graph->count, sum = 0, *start = *ends = gnp_array_zero(components + 1, sizeof *start);
	if (!start)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "orient: no memory for %zu components", components);
	for (size_t i = 0; i < count; i++)
		start[signs->label[i]]++;
	for (size_t c = 0; c <= components; c++) {
		size_t here = start[c];
		start[c] = sum;
		sum += here;
	}
	for (size_t i = 0; i < count; i++)
		signs->members[start[signs->label[i]]++] = (uint32_t)i;
	return GNP_OK;
}

static gnp_status turn_outward(struct signs *signs, const size_t *end, size_t components, struct gnp_error *error)
{
	struct gnp_orient_graph *graph = signs->graph;
	for (size_t c = 0, begin = 0; c < components; begin = end[c++]) {
		gnp_status status = gnp_task_check(graph->task, error);
		if (status != GNP_OK)
			return status;
		if (!gnp_outward_flips(graph->points, graph->normals, graph->radius, signs->members + begin, end[c] - begin))
			continue;
		for (size_t m = begin; m < end[c]; m++)
			negate(graph->normals + 3 * (size_t)signs->members[m]);
	}
	return GNP_OK;
}

/* Carries one sign through each component of a graph whose edges are sorted, mends it, and turns it outward. */
static gnp_status propagate(struct gnp_orient_graph *graph, size_t *components, struct gnp_error *error)
{
	struct signs signs = {.graph = graph};
	size_t *ends = NULL, found = 0;
	gnp_status status = GNP_OK;
	signs.members = gnp_array_new(graph->count, sizeof *signs.members);
	signs.label = gnp_array_new(graph->count, sizeof *signs.label);
	if (!gnp_forest_init(&signs.forest, graph->count) || !signs.members || !signs.label)
		status = no_memory(graph->count, error);
	if (status == GNP_OK)
		status = grow_forest(&signs, error);
	if (status == GNP_OK)
		status = apply_signs(&signs, &found, error);
	if (status == GNP_OK)
		status = sort_members(&signs, found, &ends, error);
	if (status == GNP_OK)
		status = gnp_settle(graph, &(struct gnp_surfaces){signs.label, signs.members, ends, found}, error);
	if (status == GNP_OK)
		status = turn_outward(&signs, ends, found, error);
	free(ends);
	free(signs.members);
	free(signs.label);
	gnp_forest_clear(&signs.forest);
	if (status == GNP_OK && components)
		*components = found;
	return status;
}

/* What is to be oriented, and by whom; k as asked for. */
struct request {
	const double *points;
	size_t count, k;
	const struct gnp_neighbors *neighbors;
	struct gnp_pool *pool;
	struct gnp_task *task;
};

/* crowded (may be NULL): set, and the rest left undone, when many points coincide. */
static gnp_status orient(const struct request *request, double *normals, size_t *components, bool *crowded,
                         struct gnp_error *error)
{
	size_t count = request->count;
	if (count < 2) {
		if (count)
			memcpy(normals, (double[3]){0, 0, 1}, 3 * sizeof *normals);
		if (components)
			*components = count;
		return GNP_OK;
	}
	struct gnp_orient_graph graph = {.points = request->points, .count = count, .neighbors = request->neighbors,
	                                 .k = request->k < count ? request->k : count - 1, .pool = request->pool,
	                                 .task = request->task, .normals = normals, .stop_if_crowded = crowded};
	gnp_status status = gnp_orient_graph_make(&graph, error);
	bool stopped = crowded && atomic_load(&graph.crowded);
	if (status == GNP_OK && !stopped)
		status = gnp_orient_graph_sort(&graph, error);
	if (status == GNP_OK && !stopped)
		status = propagate(&graph, components, error);
	if (crowded)
		*crowded = stopped;
	gnp_orient_graph_clear(&graph);
	return status;
}

/* Where many points coincide a neighbourhood may hold nothing else: orients the places they lie at instead. */
static gnp_status orient_places(const struct request *request, double *normals, size_t *components,
                                struct gnp_error *error)
{
	size_t count = request->count;
	struct request places = {.k = request->k, .pool = request->pool, .task = request->task};
	struct gnp_neighbors *neighbors = NULL;
	uint32_t *which = gnp_array_new(count, sizeof *which), *first = gnp_array_new(count, sizeof *first);
	double *at = NULL, *normal = NULL;
	gnp_status status = which && first ? gnp_distinct_find(request->points, count, request->task, which, first,
	                                                       &places.count, error)
	                                   : no_memory(count, error);
	if (status != GNP_OK)
		goto done;
	at = gnp_array_new(places.count, 3 * sizeof *at);
	normal = gnp_array_new(places.count, 3 * sizeof *normal);
	if (!at || !normal) {
		status = no_memory(places.count, error);
		goto done;
	}
	for (size_t p = 0; p < places.count; p++)
		memcpy(at + 3 * p, request->points + 3 * (size_t)first[p], 3 * sizeof *at);
	status = gnp_neighbors_build(at, places.count, &neighbors, error);
	places.points = at;
	places.neighbors = neighbors;
	if (status == GNP_OK)
		status = orient(&places, normal, components, NULL, error);
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
	const struct request request = {.points = points, .count = count, .k = k ? k : NEIGHBOURS, .neighbors = neighbors,
	                                .pool = pool, .task = task};
	bool crowded = false;
	if (k > NEIGHBOURS_MAX)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "k: got %zu, need at most %d", k, NEIGHBOURS_MAX);
	gnp_status status = orient(&request, normals, components, &crowded, error);
	return status == GNP_OK && crowded ? orient_places(&request, normals, components, error) : status;
}
