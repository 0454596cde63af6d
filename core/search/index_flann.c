/* The search tree of gnp_neighbors: FLANN's exact k-d tree, and all that this program knows of FLANN.
 *
 * FLANN is C++ that lets std::bad_alloc out of its C interface, and writes through what malloc gave it without
 * looking. It is therefore entered only where there is memory for what the call takes (core/base/headroom.h). */
#include "core/search/index.h"

#include <flann/flann.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>

#include "core/base/headroom.h"

struct gnp_index {
	flann_index_t tree;
	size_t count;
};

enum {
	BYTES_A_POINT = 24 + 8 + 8 + 24, /* a copy, its number and place, its share of the nodes; 48 measured */
	SEARCH_BYTES_A_POINT = 64        /* of a search in progress, a point it keeps */
};

/* Exact search in the calling thread. A copy per call: FLANN takes its parameters by mutable pointer. */
static struct FLANNParameters exact_parameters(void)
{
	struct FLANNParameters parameters = DEFAULT_FLANN_PARAMETERS;
	parameters.algorithm = FLANN_INDEX_KDTREE_SINGLE;
	parameters.leaf_max_size = 12;
	parameters.checks = -1;
	parameters.cores = 1;
	parameters.sorted = 0;
	parameters.random_seed = 0;
	return parameters;
}

/* FLANN does not write to points; its C interface merely lacks the const. */
static double *unconst(const double *points)
{
	return (double *)(uintptr_t)points;
}

static gnp_status build(const double *points, size_t count, struct gnp_index **out, struct gnp_error *error)
{
	gnp_status status = gnp_headroom_need("neighbors", count * BYTES_A_POINT, error);
	if (status != GNP_OK)
		return status;
	struct gnp_index *index = calloc(1, sizeof *index);
	if (!index)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "neighbors: no memory for %zu points", count);
	struct FLANNParameters parameters = exact_parameters();
	float speedup = 0;
	index->count = count;
	index->tree = flann_build_index_double(unconst(points), (int)count, 3, &speedup, &parameters);
	if (!index->tree) {
		free(index);
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "neighbors: cannot index %zu points", count);
	}
	*out = index;
	return GNP_OK;
}

static gnp_status prepare(const struct gnp_index *index, size_t most, struct gnp_error *error)
{
	(void)index;
	return gnp_headroom_need("neighbors", most * SEARCH_BYTES_A_POINT, error);
}

static gnp_status nearest(const struct gnp_index *index, const double *points, size_t queries, size_t k, int *found,
                          double *square, struct gnp_error *error)
{
	gnp_status status = prepare(index, k, error);
	if (status != GNP_OK)
		return status;
	struct FLANNParameters parameters = exact_parameters();
	if (flann_find_nearest_neighbors_index_double(index->tree, unconst(points), (int)queries, found, square, (int)k,
	                                              &parameters) != 0)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "neighbors: the search failed");
	return GNP_OK;
}

static size_t within(const struct gnp_index *index, const double *centre, double radius, size_t most, int *found,
                     double *square)
{
	struct FLANNParameters parameters = exact_parameters();
	/* FLANN takes the squared radius as a float: round it up. */
	float limit = nextafterf((float)(radius * radius * (1 + 1e-6)), INFINITY);
	int count = flann_radius_search_double(index->tree, unconst(centre), found, square, (int)most, limit, &parameters);
	return count < 0 ? 0 : (size_t)count < most ? (size_t)count : most;
}

static size_t bytes(const struct gnp_index *index)
{
	return index->count * BYTES_A_POINT;
}

static void free_index(struct gnp_index *index)
{
	if (!index)
		return;
	struct FLANNParameters parameters = exact_parameters();
	flann_free_index_double(index->tree, &parameters);
	free(index);
}

const struct gnp_index_kind gnp_index_flann = {build, nearest, prepare, within, bytes, free_index};
