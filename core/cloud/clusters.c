#include "core/cloud/clusters.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/memory.h"

enum {
	SMALL = 30,   /* points of a cluster at most, where that makes not too many */
	MANY = 1024,  /* clusters of a surface */
	BLOCK = 32768 /* edges between two looks at the task */
};
#define NONE UINT32_MAX

/* Places less thick than this for their width are flat: there an edge counts up to so many times as much, and more on
 * surfaces of more than so many points, where the same cut goes through relatively fewer edges. */
static const double flat = 0.2, certain = 50, usual = 10000;

static gnp_status no_memory(size_t points, struct gnp_error *error)
{
	return gnp_error_set(error, GNP_OUT_OF_MEMORY, "orient: no memory for clusters of %zu points", points);
}

size_t gnp_clusters_most(size_t points)
{
	return points / 16 < MANY ? points / 16 + 1 : MANY;
}

static size_t begin_of(const struct gnp_surfaces *surfaces, size_t surface)
{
	return surface ? surfaces->ends[surface - 1] : 0;
}

/* most (surfaces): points of a cluster at most. */
static gnp_status join(struct gnp_clusters *clusters, const uint32_t *most, struct gnp_error *error)
{
	const struct gnp_orient_graph *graph = clusters->graph;
	const uint32_t *label = clusters->surfaces->label;
	struct gnp_forest *forest = &clusters->forest;
	for (size_t e = 0; e < graph->edge_count; e++) {
		gnp_status status = e % BLOCK == 0 ? gnp_task_check(graph->task, error) : GNP_OK;
		if (status != GNP_OK)
			return status;
		bool flipped;
		uint32_t i = graph->edges[e].from, j = graph->edges[e].to >> 1;
		if (label[i] != label[j])
			continue;
		uint32_t a = gnp_forest_find(forest, i, &flipped), b = gnp_forest_find(forest, j, &flipped);
		if (a != b && forest->size[a] + forest->size[b] <= most[label[i]])
			gnp_forest_join(forest, a, b, false, SIZE_MAX);
	}
	return GNP_OK;
}

/* Numbers the clusters of a surface by their first members; how many there are. */
static size_t number_clusters(struct gnp_clusters *clusters, size_t surface)
{
	const struct gnp_surfaces *surfaces = clusters->surfaces;
	uint32_t *number = clusters->number;
	size_t begin = begin_of(surfaces, surface), end = surfaces->ends[surface], found = 0;
	bool flipped;
	for (size_t m = begin; m < end; m++)
		number[surfaces->members[m]] = NONE;
	for (size_t m = begin; m < end; m++) {
		uint32_t root = gnp_forest_find(&clusters->forest, surfaces->members[m], &flipped);
		if (number[root] == NONE)
			number[root] = (uint32_t)found++;
		number[surfaces->members[m]] = number[root];
	}
	return found;
}

/* Doubles what clusters may hold where there are too many; false when there are not, anywhere. */
static bool allow_more(struct gnp_clusters *clusters, uint32_t *most)
{
	const struct gnp_surfaces *surfaces = clusters->surfaces;
	bool any = false;
	for (size_t s = 0; s < surfaces->count; s++) {
		size_t points = surfaces->ends[s] - begin_of(surfaces, s);
		if (most[s] >= 2 * points || number_clusters(clusters, s) <= gnp_clusters_most(points))
			continue;
		most[s] *= 2;
		any = true;
	}
	return any;
}

gnp_status gnp_clusters_init(struct gnp_clusters *clusters, const struct gnp_orient_graph *graph,
                             const struct gnp_surfaces *surfaces, struct gnp_error *error)
{
	*clusters = (struct gnp_clusters){.graph = graph, .surfaces = surfaces};
	uint32_t *most = gnp_array_new(surfaces->count, sizeof *most);
	clusters->number = gnp_array_new(graph->count, sizeof *clusters->number);
	if (!gnp_forest_init(&clusters->forest, graph->count) || !most || !clusters->number) {
		free(most);
		return no_memory(graph->count, error);
	}
	for (size_t s = 0; s < surfaces->count; s++) {
		size_t points = surfaces->ends[s] - begin_of(surfaces, s), share = points + points / 2;
		most[s] = share / MANY > SMALL ? (uint32_t)(share / MANY) : SMALL;
	}
	gnp_status status;
	do
		status = join(clusters, most, error);
	while (status == GNP_OK && allow_more(clusters, most));
	free(most);
	return status;
}

static void forget(struct gnp_clusters *clusters)
{
	free(clusters->members);
	free(clusters->start);
	free(clusters->link_start);
	free(clusters->link_to);
	free(clusters->link_trust);
	clusters->members = clusters->link_to = NULL;
	clusters->start = clusters->link_start = NULL;
	clusters->link_trust = NULL;
}

void gnp_clusters_clear(struct gnp_clusters *clusters)
{
	forget(clusters);
	gnp_forest_clear(&clusters->forest);
	free(clusters->number);
	clusters->number = NULL;
}

static gnp_status sort_members(struct gnp_clusters *clusters, size_t surface, struct gnp_error *error)
{
	const struct gnp_surfaces *surfaces = clusters->surfaces;
	size_t begin = begin_of(surfaces, surface), end = surfaces->ends[surface], sum = 0;
	clusters->members = gnp_array_new(end - begin, sizeof *clusters->members);
	size_t *start = clusters->start = gnp_array_zero(clusters->count + 1, sizeof *clusters->start);
	if (!clusters->members || !start)
		return no_memory(end - begin, error);
	for (size_t m = begin; m < end; m++)
		start[clusters->number[surfaces->members[m]]]++;
	for (size_t c = 0; c <= clusters->count; c++)
		start[c] = sum += start[c];
	for (size_t m = end; m-- > begin;)
		clusters->members[--start[clusters->number[surfaces->members[m]]]] = surfaces->members[m];
	return GNP_OK;
}

/* The trust of all edges of the surface, and what links count for: the more the flatter both ends lie. sums (count,
 * count): added up by clusters. */
static double sum_links(const struct gnp_clusters *clusters, size_t surface, float *sums)
{
	const struct gnp_orient_graph *graph = clusters->graph;
	const uint32_t *label = clusters->surfaces->label, *number = clusters->number;
	size_t points = clusters->start[clusters->count];
	double total = 0, most = certain * sqrt(fmax(1, (double)points / usual));
	for (size_t m = 0; m < points; m++) {
		size_t i = clusters->members[m];
		for (size_t s = 0; s < graph->k; s++) {
			size_t j = graph->index[i * graph->k + s];
			if (label[j] != surface)
				continue;
			double trust = gnp_orient_graph_trust(graph, i, j);
			double thick = fmax(graph->thickness[i], graph->thickness[j]) / 255.0, flatness = fmax(0, 1 - thick / flat);
			total += fabs(trust);
			if (number[i] == number[j])
				continue;
			trust *= 1 + most * flatness * flatness;
			sums[number[i] * clusters->count + number[j]] += (float)trust;
			sums[number[j] * clusters->count + number[i]] += (float)trust;
		}
	}
	return total;
}

static gnp_status list_links(struct gnp_clusters *clusters, const float *sums, double total, struct gnp_error *error)
{
	size_t count = clusters->count, found = 0;
	for (size_t l = 0; l < count * count; l++)
		found += sums[l] != 0;
	clusters->link_start = gnp_array_new(count + 1, sizeof *clusters->link_start);
	clusters->link_to = gnp_array_new(found, sizeof *clusters->link_to);
	clusters->link_trust = gnp_array_new(found, sizeof *clusters->link_trust);
	if (!clusters->link_start || !clusters->link_to || !clusters->link_trust)
		return no_memory(clusters->start[count], error);
	found = 0;
	for (size_t l = 0; l < count * count; l++) {
		if (l % count == 0)
			clusters->link_start[l / count] = found;
		if (sums[l] == 0)
			continue;
		clusters->link_to[found] = (uint32_t)(l % count);
		clusters->link_trust[found++] = sums[l] / total;
	}
	clusters->link_start[count] = found;
	return GNP_OK;
}

gnp_status gnp_clusters_make(struct gnp_clusters *clusters, size_t surface, struct gnp_error *error)
{
	forget(clusters);
	clusters->count = number_clusters(clusters, surface);
	gnp_status status = sort_members(clusters, surface, error);
	if (status != GNP_OK)
		return status;
	float *sums = gnp_array_zero(clusters->count, clusters->count * sizeof *sums);
	if (!sums)
		return no_memory(clusters->start[clusters->count], error);
	double total = sum_links(clusters, surface, sums);
	status = list_links(clusters, sums, total, error);
	free(sums);
	return status;
}
