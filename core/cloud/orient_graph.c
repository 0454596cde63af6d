#include "core/cloud/orient_graph.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"
#include "core/base/vector.h"
#include "core/linear/pca.h"
#include "core/search/neighborhoods.h"

/* Terms of an edge's weight besides 1 - |agreement of normals|, and the largest weight told apart. On noisy and
 * undersampled surfaces leaving the tangent planes is the best sign of an edge that misleads; 1 .. 4 serve alike. */
static const double tangent_share = 2, distance_share = 0.02, worst = 3;
/* From this weight an edge is not sound. */
static const double doubtful = 0.5;
/* An edge longer than this many times the smaller radius of its ends is a long one. */
static const double long_ratio = 3;

enum {
	CHUNK = 256,   /* points a worker takes at a time */
	BLOCK = 8192,  /* points of a serial loop between two looks at the task */
	SHORT = 24576, /* levels of short edges: 0 .. SHORT - 1; long ones take the rest */
	DOUBTFUL = 10032, /* SHORT sqrt(doubtful / worst): from here edges are not sound */
	LEVELS = 32767,
	NO_EDGE = 65535, /* the key of an edge that the other end holds too */
	ROOM = 4 /* a row may hold this many times the neighbours asked for, by ties, before its search is cut short */
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
static gnp_status look_farther(struct gnp_orient_graph *graph, size_t i, struct gnp_scratch *scratch,
                               struct gnp_pca *pca, struct gnp_error *error)
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
	struct gnp_orient_graph *graph = context;
	struct gnp_neighborhoods rows;
	size_t k = graph->k;
	uint32_t *centres = gnp_scratch_take(scratch, end - begin, sizeof *centres);
	if (!centres)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "orient: no memory for %zu points", end - begin);
	for (size_t i = begin; i < end; i++)
		centres[i - begin] = (uint32_t)i;
	gnp_status status = gnp_neighborhoods_find(graph->neighbors, centres, end - begin, k + 1, 1, ROOM * (k + 1),
	                                           scratch, &rows, error);
	for (size_t i = begin; i < end && status == GNP_OK; i++) {
		size_t at = rows.start[i - begin], length = rows.start[i - begin + 1] - at;
		struct gnp_pca pca;
		if (choose(rows.index + at, rows.distance + at, length, i, 1, k, graph->index + i * k) > k / 4)
			atomic_store_explicit(&graph->crowded, true, memory_order_relaxed);
		graph->radius[i] = rows.r_k[i - begin];
		gnp_pca_fit(graph->points, rows.index + at, k + 1, &pca);
		status = look_farther(graph, i, scratch, &pca, error);
		memcpy(graph->normals + 3 * i, pca.axes[2], sizeof pca.axes[2]);
		double thick = pca.values[1] > 0 ? sqrt(fmax(pca.values[2], 0) / pca.values[1]) : 1;
		graph->thickness[i] = (unsigned char)(255 * fmin(thick, 1));
	}
	return status;
}

/* --- edges --- */

static bool lists(const struct gnp_orient_graph *graph, size_t i, size_t j)
{
	const uint32_t *row = graph->index + i * graph->k;
	for (size_t s = 0; s < graph->k; s++)
		if (row[s] == j)
			return true;
	return false;
}

/* An edge as it carries an orientation. */
struct carried {
	double length, agreement; /* of the carried normal with the other end's */
	double weight;            /* the less the more trusted; what its length adds is left out */
};

/* The normal of i is carried along the edge e as along a circular arc: by the mirror plane across e. So a fold's two
 * flanks, and the two sides of a thin wall, come out right where parallel transport would not. An edge is trusted
 * the more the better the carried normal agrees with that of j up to sign, and the closer it lies to both tangent
 * planes. */
static struct carried carry(const struct gnp_orient_graph *graph, size_t i, size_t j)
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
	double leaving = tangent_share * 0.5 * (along_n * along_n + along_m * along_m);
	return (struct carried){length, agreement, 1 - fmin(fabs(agreement), 1) + leaving};
}

/* Of edges that are trusted alike the shorter comes first. */
static uint16_t edge_key(const struct gnp_orient_graph *graph, size_t i, size_t j)
{
	struct carried edge = carry(graph, i, j);
	unsigned opposite = edge.agreement < 0, level;
	double narrow = fmin(graph->radius[i], graph->radius[j]);
	if (edge.length > long_ratio * narrow) {
		double octaves = log2(edge.length / narrow) * 32;
		level = SHORT + (unsigned)fmin(octaves, LEVELS - 1 - SHORT);
	} else {
		double w = edge.weight + distance_share * edge.length / (graph->radius[i] + graph->radius[j] + 1e-300);
		level = (unsigned)(sqrt(fmin(w / worst, 1)) * (SHORT - 1));
	}
	return (uint16_t)(level << 1 | opposite);
}

double gnp_orient_graph_trust(const struct gnp_orient_graph *graph, size_t i, size_t j)
{
	struct carried edge = carry(graph, i, j);
	if (edge.length > long_ratio * fmin(graph->radius[i], graph->radius[j]))
		return 0;
	return copysign(fmax(0, 1 - edge.weight / doubtful), edge.agreement);
}

static gnp_status weigh_edges(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                              struct gnp_error *error)
{
	struct gnp_orient_graph *graph = context;
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

/* How many edges each level has, then where each begins. start (LEVELS + 1) is zeroed. */
static gnp_status count_levels(const struct gnp_orient_graph *graph, size_t *start, struct gnp_error *error)
{
	size_t slots = graph->count * graph->k, block = BLOCK * graph->k, sum = 0;
	for (size_t first = 0; first < slots; first += block) {
		gnp_status status = gnp_task_check(graph->task, error);
		if (status != GNP_OK)
			return status;
		for (size_t s = first; s < slots && s < first + block; s++)
			if (graph->key[s] != NO_EDGE)
				start[graph->key[s] >> 1]++;
	}
	for (size_t level = 0; level <= LEVELS; level++) {
		size_t here = start[level];
		start[level] = sum;
		sum += here;
	}
	return GNP_OK;
}

/* Counting sort by level; equal levels keep the order of their points. next: where each level's next edge goes. */
static gnp_status place_edges(struct gnp_orient_graph *graph, size_t *next, struct gnp_error *error)
{
	for (size_t i = 0; i < graph->count; i++) {
		gnp_status status = i % BLOCK == 0 ? gnp_task_check(graph->task, error) : GNP_OK;
		if (status != GNP_OK)
			return status;
		for (size_t s = i * graph->k; s < (i + 1) * graph->k; s++)
			if (graph->key[s] != NO_EDGE)
				graph->edges[next[graph->key[s] >> 1]++] =
					(struct gnp_orient_edge){(uint32_t)i, graph->index[s] << 1 | (graph->key[s] & 1u)};
	}
	return GNP_OK;
}

gnp_status gnp_orient_graph_sort(struct gnp_orient_graph *graph, struct gnp_error *error)
{
	size_t *start = gnp_array_zero(LEVELS + 1, sizeof *start);
	if (!start)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "orient: no memory for %zu points", graph->count);
	gnp_status status = count_levels(graph, start, error);
	if (status == GNP_OK) {
		graph->sound_count = start[DOUBTFUL];
		graph->short_count = start[SHORT];
		graph->edge_count = start[LEVELS];
		graph->edges = gnp_array_new(graph->edge_count, sizeof *graph->edges);
		if (graph->edges)
			status = place_edges(graph, start, error);
		else
			status = gnp_error_set(error, GNP_OUT_OF_MEMORY, "orient: no memory for %zu edges", graph->edge_count);
	}
	free(start);
	free(graph->key);
	graph->key = NULL;
	return status;
}

/* --- the whole --- */

static bool graph_take(struct gnp_orient_graph *graph)
{
	size_t slots;
	if (!gnp_size_multiply(graph->count, graph->k, &slots))
		return false;
	graph->index = gnp_array_new(slots, sizeof *graph->index);
	graph->key = gnp_array_new(slots, sizeof *graph->key);
	graph->radius = gnp_array_new(graph->count, sizeof *graph->radius);
	graph->thickness = gnp_array_new(graph->count, sizeof *graph->thickness);
	return graph->index && graph->key && graph->radius && graph->thickness;
}

gnp_status gnp_orient_graph_make(struct gnp_orient_graph *graph, struct gnp_error *error)
{
	if (!graph_take(graph))
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "orient: no memory for %zu points", graph->count);
	gnp_status status = gnp_pool_run(graph->pool, graph->task, graph->count, CHUNK, fit_planes, graph, error);
	if (status != GNP_OK || (graph->stop_if_crowded && atomic_load(&graph->crowded)))
		return status;
	return gnp_pool_run(graph->pool, graph->task, graph->count, CHUNK, weigh_edges, graph, error);
}

void gnp_orient_graph_clear(struct gnp_orient_graph *graph)
{
	free(graph->index);
	free(graph->key);
	free(graph->radius);
	free(graph->thickness);
	free(graph->edges);
}
