#include "core/search/neighbors.h"

#include <math.h>
#include <stdlib.h>

#include "core/base/vector.h"

struct gnp_neighbors {
	const struct gnp_index_kind *kind;
	struct gnp_index *index;
	const double *points; /* (count, 3), borrowed */
	size_t count;
};

/* A search leaves out what is at no finite distance, and the numbers of its answer are then nobody's. */
static gnp_status check_places(const double *points, size_t count, struct gnp_error *error)
{
	for (size_t i = 0; i < 3 * count; i++)
		if (!(fabs(points[i]) <= GNP_COORDINATE_MAX))
			return gnp_error_set(error, GNP_DEGENERATE, "neighbors: coordinate %zu of point %zu is %g, need a finite "
			                     "number of magnitude at most %g", i % 3, i / 3, points[i], GNP_COORDINATE_MAX);
	return GNP_OK;
}

gnp_status gnp_neighbors_build_on(const struct gnp_index_kind *kind, const double *points, size_t count,
                                  struct gnp_neighbors **out, struct gnp_error *error)
{
	if (count < 1 || count > INT32_MAX)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "points: got %zu, need 1..%d", count, INT32_MAX);
	gnp_status status = check_places(points, count, error);
	if (status != GNP_OK)
		return status;
	struct gnp_neighbors *neighbors = calloc(1, sizeof *neighbors);
	if (!neighbors)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "neighbors: no memory for %zu points", count);
	*neighbors = (struct gnp_neighbors){.kind = kind, .points = points, .count = count};
	status = kind->build(points, count, &neighbors->index, error);
	if (status != GNP_OK) {
		free(neighbors);
		return status;
	}
	*out = neighbors;
	return GNP_OK;
}

gnp_status gnp_neighbors_build(const double *points, size_t count, struct gnp_neighbors **out, struct gnp_error *error)
{
	return gnp_neighbors_build_on(&gnp_index_flann, points, count, out, error);
}

void gnp_neighbors_free(struct gnp_neighbors *neighbors)
{
	if (!neighbors)
		return;
	neighbors->kind->free(neighbors->index);
	free(neighbors);
}

const double *gnp_neighbors_points(const struct gnp_neighbors *neighbors)
{
	return neighbors->points;
}

size_t gnp_neighbors_count(const struct gnp_neighbors *neighbors)
{
	return neighbors->count;
}

size_t gnp_neighbors_bytes(const struct gnp_neighbors *neighbors)
{
	return neighbors->kind->bytes(neighbors->index);
}

/* Shell's sort, whose last pass decides ties by index. */
void gnp_neighbors_sort(double *distance, uint32_t *index, size_t count)
{
	static const size_t gaps[] = {3905, 1968, 861, 336, 112, 48, 21, 7, 1};
	for (size_t g = count > 21 ? 0 : 8; g < sizeof gaps / sizeof *gaps; g++)
		for (size_t gap = gaps[g], i = gap; i < count; i++) {
			double d = distance[i];
			uint32_t at = index[i];
			size_t j = i;
			for (; j >= gap && (distance[j - gap] > d || (distance[j - gap] == d && index[j - gap] > at)); j -= gap) {
				distance[j] = distance[j - gap];
				index[j] = index[j - gap];
			}
			distance[j] = d;
			index[j] = at;
		}
}

/* Distances computed here rather than taken from the index: one formula decides every order and radius. */
static void finish_row(const struct gnp_neighbors *neighbors, const double *place, const int *found, size_t count,
                       uint32_t *index, double *distance)
{
	for (size_t i = 0; i < count; i++) {
		const double *p = neighbors->points + 3 * (size_t)found[i];
		double x = place[0] - p[0], y = place[1] - p[1], z = place[2] - p[2];
		index[i] = (uint32_t)found[i];
		distance[i] = sqrt(x * x + y * y + z * z);
	}
	gnp_neighbors_sort(distance, index, count);
}

gnp_status gnp_neighbors_knn(const struct gnp_neighbors *neighbors, const double *points, size_t queries, size_t k,
                             uint32_t *index, double *distance, struct gnp_scratch *scratch, struct gnp_error *error)
{
	if (k < 1 || k > neighbors->count)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "k: got %zu, need 1..%zu", k, neighbors->count);
	gnp_status status = check_places(points, queries, error);
	if (status != GNP_OK)
		return status;
	struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
	int *found = gnp_scratch_take(scratch, queries * k, sizeof *found);
	if (!found)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "neighbors: no memory for %zu x %zu", queries, k);
	status = neighbors->kind->nearest(neighbors->index, points, queries, k, found, distance, error);
	for (size_t q = 0; q < queries && status == GNP_OK; q++)
		finish_row(neighbors, points + 3 * q, found + q * k, k, index + q * k, distance + q * k);
	gnp_scratch_release(scratch, mark);
	return status;
}

gnp_status gnp_neighbors_prepare(const struct gnp_neighbors *neighbors, size_t most, struct gnp_error *error)
{
	return neighbors->kind->prepare(neighbors->index, most, error);
}

size_t gnp_neighbors_candidates(const struct gnp_neighbors *neighbors, const double *place, double radius, size_t most,
                                int *found, double *square)
{
	return neighbors->kind->within(neighbors->index, place, radius, most, found, square);
}

gnp_status gnp_neighbors_within(const struct gnp_neighbors *neighbors, const double *place, double radius, size_t most,
                                uint32_t *index, double *distance, size_t *count, struct gnp_scratch *scratch,
                                struct gnp_error *error)
{
	struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
	int *found = gnp_scratch_take(scratch, most, sizeof *found);
	if (!found)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "neighbors: no memory for %zu neighbours", most);
	size_t length = gnp_neighbors_candidates(neighbors, place, radius, most, found, distance);
	finish_row(neighbors, place, found, length, index, distance);
	gnp_scratch_release(scratch, mark);
	while (length && distance[length - 1] > radius)
		length--;
	*count = length;
	return GNP_OK;
}
