#include "core/cloud/neighbors.h"

#include <flann/flann.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "core/base/headroom.h"
#include "core/base/memory.h"
#include "core/cloud/cloud.h"

struct gnp_neighbors {
	flann_index_t index;
	const double *points; /* (count, 3), borrowed */
	size_t count;
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

/* Bytes of an index beside its bookkeeping, a point: a copy of it, its number and its place, and its share of the nodes. */
enum { INDEX_BYTES_A_POINT = 24 + 8 + 8 + 24 };

/* FLANN leaves out what is at no finite distance, and the numbers of its answer are then nobody's. */
static gnp_status check_places(const double *points, size_t count, struct gnp_error *error)
{
	for (size_t i = 0; i < 3 * count; i++)
		if (!(fabs(points[i]) <= GNP_COORDINATE_MAX))
			return gnp_error_set(error, GNP_DEGENERATE, "neighbors: coordinate %zu of point %zu is %g, need a finite number of magnitude at most %g",
			                     i % 3, i / 3, points[i], GNP_COORDINATE_MAX);
	return GNP_OK;
}

gnp_status gnp_neighbors_build(const double *points, size_t count, struct gnp_neighbors **out,
                               struct gnp_error *error)
{
	if (count < 1 || count > INT32_MAX)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "points: got %zu, need 1..%d", count, INT32_MAX);
	gnp_status status = check_places(points, count, error);
	if (status == GNP_OK)
		status = gnp_headroom_need("neighbors", count * INDEX_BYTES_A_POINT, error);
	if (status != GNP_OK)
		return status;
	struct gnp_neighbors *neighbors = calloc(1, sizeof *neighbors);
	if (!neighbors)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "neighbors: no memory for %zu points", count);
	struct FLANNParameters parameters = exact_parameters();
	float speedup = 0;
	neighbors->points = points;
	neighbors->count = count;
	/* FLANN does not write to the data set; its C interface merely lacks the const. */
	neighbors->index = flann_build_index_double((double *)(uintptr_t)points, (int)count, 3, &speedup, &parameters);
	if (!neighbors->index) {
		free(neighbors);
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "neighbors: cannot index %zu points", count);
	}
	*out = neighbors;
	return GNP_OK;
}

void gnp_neighbors_free(struct gnp_neighbors *neighbors)
{
	if (!neighbors)
		return;
	struct FLANNParameters parameters = exact_parameters();
	flann_free_index_double(neighbors->index, &parameters);
	free(neighbors);
}

/* Ascending by (distance, index): Shell's sort, whose last pass decides ties by index. */
static void sort_row(double *distance, uint32_t *index, size_t count)
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

enum { BUCKETS_MIN = 64, BUCKETS_MAX = 1024 };

/* The same into other arrays, in linear time where it matters: on a surface the squared distances of a ball's points are
 * spread evenly, so equal buckets of them hold a few entries each. largest: at least every square. */
static void sort_squares(const double *square, const uint32_t *index, size_t count, double largest, double *square_out,
                         uint32_t *index_out)
{
	uint32_t start[BUCKETS_MAX + 1];
	int buckets = count < BUCKETS_MIN ? BUCKETS_MIN : count > BUCKETS_MAX ? BUCKETS_MAX : (int)count;
	double scale = largest > 0 ? (buckets - 1) / largest : 0;
	memset(start, 0, ((size_t)buckets + 1) * sizeof *start);
	for (size_t i = 0; i < count; i++)
		start[(int)(square[i] * scale) + 1]++;
	for (int b = 0; b < buckets; b++)
		start[b + 1] += start[b];
	for (size_t i = 0; i < count; i++) {
		uint32_t at = start[(int)(square[i] * scale)]++;
		square_out[at] = square[i];
		index_out[at] = index[i];
	}
	uint32_t begin = 0;
	for (int b = 0; b < buckets; begin = start[b++])
		if (start[b] - begin > 1)
			sort_row(square_out + begin, index_out + begin, start[b] - begin);
}

static double distance_squared(const double *a, const double *b)
{
	double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
	return x * x + y * y + z * z;
}

/* Distances computed here rather than taken from FLANN: one formula decides every order and radius. */
static void finish_row(const struct gnp_neighbors *neighbors, const double *point, const int *found, size_t count,
                       uint32_t *index, double *distance)
{
	for (size_t i = 0; i < count; i++) {
		index[i] = (uint32_t)found[i];
		distance[i] = sqrt(distance_squared(point, neighbors->points + 3 * (size_t)found[i]));
	}
	sort_row(distance, index, count);
}

/* Bytes of a search in progress, a point it keeps. */
enum { SEARCH_BYTES_A_POINT = 64 };

gnp_status gnp_neighbors_knn(const struct gnp_neighbors *neighbors, const double *points, size_t queries, size_t k,
                             uint32_t *index, double *distance, struct gnp_scratch *scratch,
                             struct gnp_error *error)
{
	if (k < 1 || k > neighbors->count)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "k: got %zu, need 1..%zu", k, neighbors->count);
	gnp_status checked = check_places(points, queries, error);
	if (checked != GNP_OK)
		return checked;
	struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
	int *found = gnp_scratch_take(scratch, queries * k, sizeof *found);
	if (!found)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "neighbors: no memory for %zu x %zu", queries, k);
	if (gnp_headroom_need("neighbors", k * SEARCH_BYTES_A_POINT, error) != GNP_OK) {
		gnp_scratch_release(scratch, mark);
		return GNP_OUT_OF_MEMORY;
	}
	struct FLANNParameters parameters = exact_parameters();
	int status = flann_find_nearest_neighbors_index_double(neighbors->index, (double *)(uintptr_t)points, (int)queries,
	                                                       found, distance, (int)k, &parameters);
	for (size_t q = 0; q < queries && status == 0; q++)
		finish_row(neighbors, points + 3 * q, found + q * k, k, index + q * k, distance + q * k);
	gnp_scratch_release(scratch, mark);
	if (status != 0)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "neighbors: the search failed");
	return GNP_OK;
}

/* Indices of the at most `most` points nearest to centre among those within radius. */
static size_t find_within(const struct gnp_neighbors *neighbors, const double *centre, double radius, size_t most,
                          int *found, double *distance)
{
	struct FLANNParameters parameters = exact_parameters();
	/* FLANN takes the squared radius as a float: round it up, the caller filters exactly. */
	float square = nextafterf((float)(radius * radius * (1 + 1e-6)), INFINITY);
	int count = flann_radius_search_double(neighbors->index, (double *)(uintptr_t)centre, found, distance, (int)most,
	                                       square, &parameters);
	return count < 0 ? 0 : (size_t)count < most ? (size_t)count : most;
}

enum { GROUP = 12, CANDIDATES_MIN = 1024, CANDIDATES_MAX = 8192 };

/* One search serves a group: centres that are consecutive along the space-filling curve share nearly all their neighbours, so
 * candidates come from one FLANN radius search round their mean and each point filters them by its own distances. */
struct group {
	const struct gnp_neighbors *neighbors;
	size_t k, most;
	double ratio;
	double guess;       /* r_k of the points just before, the first estimate of the next ones' */
	double expected;    /* the radius of a row by that estimate */
	/* candidates */
	size_t count;
	double centre[3], reach; /* every point within reach of centre is a candidate */
	size_t capacity;         /* candidates there is room for */
	int *found;              /* (capacity) */
	double *x, *y, *z;       /* (capacity) */
	double *square;          /* (max(capacity, most)) */
	double *near_square;     /* (capacity + 1) those within a first radius */
	uint32_t *near_index;
	uint32_t *index;         /* (max(capacity, most)), of the row being built */
	double *distance;
};

static void gather_candidates(struct group *group, const uint32_t *centres, size_t members)
{
	const double *points = group->neighbors->points;
	double spread = 0;
	for (int c = 0; c < 3; c++) {
		double sum = 0;
		for (size_t m = 0; m < members; m++)
			sum += points[3 * (size_t)centres[m] + c];
		group->centre[c] = sum / (double)members;
	}
	for (size_t m = 0; m < members; m++)
		spread = fmax(spread, distance_squared(points + 3 * (size_t)centres[m], group->centre));
	spread = sqrt(spread);
	double radius = 1.12 * group->ratio * group->guess;
	group->expected = radius;
	group->count = 0;
	group->reach = -1;
	if (spread > 2 * radius) /* the curve jumped: the points do not share neighbours */
		return;
	size_t count = find_within(group->neighbors, group->centre, spread + radius, group->capacity, group->found, group->square);
	if (count == group->capacity) /* possibly cut short */
		return;
	group->count = count;
	group->reach = spread + radius;
	for (size_t j = 0; j < count; j++) {
		const double *p = points + 3 * (size_t)group->found[j];
		group->x[j] = p[0];
		group->y[j] = p[1];
		group->z[j] = p[2];
	}
}

/* Squares that differ in their last bits have equal roots: moves the last entry of a row sorted by square to its place
 * among its equals. */
static void settle_tie(const double *distance, uint32_t *index, size_t last)
{
	for (size_t e = last; e > 0 && distance[e - 1] == distance[e] && index[e - 1] > index[e]; e--) {
		uint32_t swap = index[e];
		index[e] = index[e - 1];
		index[e - 1] = swap;
	}
}

/* The row of point i from the group's candidates; false when they may not hold all of its ball. */
static bool row_from_candidates(struct group *group, size_t i, size_t *length, double *r_k)
{
	const double *p = group->neighbors->points + 3 * i;
	double sure = group->reach - sqrt(distance_squared(p, group->centre)), sure_square = sure * sure * (1 - 1e-12);
	if (sure <= 0 || group->count < group->k)
		return false;
	double px = p[0], py = p[1], pz = p[2];
	const double *restrict x = group->x, *restrict y = group->y, *restrict z = group->z;
	double *restrict square = group->square;
	for (size_t j = 0; j < group->count; j++) {
		double dx = px - x[j], dy = py - y[j], dz = pz - z[j];
		square[j] = dx * dx + dy * dy + dz * dz;
	}
	/* Most rows end well inside what is sure: sort only what the estimate of their radius takes in, or else all. */
	double limits[2] = {fmin(sure_square, group->expected * group->expected), sure_square};
	for (int attempt = 0; attempt < 2; attempt++) {
		size_t near = 0;
		for (size_t j = 0; j < group->count; j++) {
			group->near_square[near] = square[j];
			group->near_index[near] = (uint32_t)group->found[j];
			near += square[j] <= limits[attempt];
		}
		if (near < group->k)
			continue;
		sort_squares(group->near_square, group->near_index, near, limits[attempt], group->distance, group->index);
		*r_k = sqrt(group->distance[group->k - 1]);
		double radius = group->ratio * *r_k;
		if (radius * radius > limits[attempt] * (1 - 1e-12))
			continue;
		size_t count = 0;
		while (count < near && count < group->most &&
		       (group->distance[count] = sqrt(group->distance[count])) <= radius)
			settle_tie(group->distance, group->index, count++);
		*length = count;
		return true;
	}
	return false;
}

/* The row of point i by searches of its own. */
static gnp_status row_from_search(struct group *group, size_t i, struct gnp_scratch *scratch, size_t *length,
                                  double *r_k, struct gnp_error *error)
{
	const double *p = group->neighbors->points + 3 * i;
	gnp_status status =
		gnp_neighbors_knn(group->neighbors, p, 1, group->k, group->index, group->distance, scratch, error);
	if (status != GNP_OK)
		return status;
	*r_k = group->distance[group->k - 1];
	double radius = group->ratio * *r_k;
	struct gnp_scratch_mark mark = gnp_scratch_mark(scratch);
	int *found = gnp_scratch_take(scratch, group->most, sizeof *found);
	if (!found)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "neighbors: no memory for %zu neighbours", group->most);
	size_t count = find_within(group->neighbors, p, radius, group->most, found, group->square);
	finish_row(group->neighbors, p, found, count, group->index, group->distance);
	gnp_scratch_release(scratch, mark);
	while (count && group->distance[count - 1] > radius)
		count--;
	*length = count;
	return GNP_OK;
}

static bool group_take(struct group *group, struct gnp_scratch *scratch)
{
	/* The group's ball has about twice the radius of a row's. */
	double expected = 8 * group->ratio * group->ratio * (double)group->k;
	group->capacity = expected < CANDIDATES_MIN ? CANDIDATES_MIN : expected > CANDIDATES_MAX ? CANDIDATES_MAX : (size_t)expected;
	size_t row = group->most > group->capacity ? group->most : group->capacity;
	group->found = gnp_scratch_take(scratch, group->capacity, sizeof(int));
	group->x = gnp_scratch_take(scratch, group->capacity, sizeof(double));
	group->y = gnp_scratch_take(scratch, group->capacity, sizeof(double));
	group->z = gnp_scratch_take(scratch, group->capacity, sizeof(double));
	group->square = gnp_scratch_take(scratch, row, sizeof(double));
	group->near_square = gnp_scratch_take(scratch, group->capacity + 1, sizeof(double));
	group->near_index = gnp_scratch_take(scratch, group->capacity + 1, sizeof(uint32_t));
	group->index = gnp_scratch_take(scratch, row + 1, sizeof(uint32_t));
	group->distance = gnp_scratch_take(scratch, row + 1, sizeof(double));
	return group->found && group->x && group->y && group->z && group->square && group->near_square &&
	       group->near_index && group->index && group->distance;
}

/* Appends the row just built; the arrays of out grow in scratch by doubling. */
static bool append_row(struct gnp_neighborhoods *out, size_t *capacity, size_t row, const struct group *group,
                       size_t length, struct gnp_scratch *scratch)
{
	size_t used = out->start[row];
	if (used + length > *capacity) {
		size_t larger = 2 * (used + length);
		uint32_t *index = gnp_scratch_take(scratch, larger, sizeof *index);
		double *distance = gnp_scratch_take(scratch, larger, sizeof *distance);
		if (!index || !distance)
			return false;
		memcpy(index, out->index, used * sizeof *index);
		memcpy(distance, out->distance, used * sizeof *distance);
		out->index = index;
		out->distance = distance;
		*capacity = larger;
	}
	memcpy(out->index + used, group->index, length * sizeof *out->index);
	memcpy(out->distance + used, group->distance, length * sizeof *out->distance);
	out->start[row + 1] = used + length;
	return true;
}

gnp_status gnp_neighborhoods_find(const struct gnp_neighbors *neighbors, const uint32_t *centres, size_t rows,
                                  size_t k, double ratio, size_t most, struct gnp_scratch *scratch,
                                  struct gnp_neighborhoods *out, struct gnp_error *error)
{
	if (k < 1 || k > neighbors->count || most < k)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "k: got %zu, need 1..%zu", k,
		                     most < neighbors->count ? most : neighbors->count);
	if (most > neighbors->count)
		most = neighbors->count;
	if (gnp_headroom_need("neighbors", most * SEARCH_BYTES_A_POINT, error) != GNP_OK)
		return GNP_OUT_OF_MEMORY;
	size_t capacity = rows * (size_t)fmin(1.3 * ratio * ratio * (double)k + 8, (double)most);
	struct group group = {.neighbors = neighbors, .k = k, .most = most, .ratio = ratio};
	*out = (struct gnp_neighborhoods){.count = rows};
	out->start = gnp_scratch_take(scratch, rows + 1, sizeof *out->start);
	out->r_k = gnp_scratch_take(scratch, rows, sizeof *out->r_k);
	out->index = gnp_scratch_take(scratch, capacity, sizeof *out->index);
	out->distance = gnp_scratch_take(scratch, capacity, sizeof *out->distance);
	if (!group_take(&group, scratch) || !out->start || !out->r_k || !out->index || !out->distance)
		return gnp_error_set(error, GNP_OUT_OF_MEMORY, "neighbors: no memory for %zu neighbourhoods", rows);
	out->start[0] = 0;
	for (size_t first = 0; first < rows; first += GROUP) {
		size_t last = rows - first > GROUP ? first + GROUP : rows;
		double widest = 0;
		if (group.guess == 0) { /* nothing to go by yet */
			size_t length;
			gnp_status status = row_from_search(&group, centres[first], scratch, &length, &group.guess, error);
			if (status != GNP_OK)
				return status;
		}
		gather_candidates(&group, centres + first, last - first);
		for (size_t row = first; row < last; row++) {
			size_t i = centres[row], length = 0;
			double r_k = 0;
			if (!row_from_candidates(&group, i, &length, &r_k)) {
				gnp_status status = row_from_search(&group, i, scratch, &length, &r_k, error);
				if (status != GNP_OK)
					return status;
			}
			out->r_k[row] = r_k;
			widest = fmax(widest, r_k);
			if (!append_row(out, &capacity, row, &group, length, scratch))
				return gnp_error_set(error, GNP_OUT_OF_MEMORY, "neighbors: no memory for %zu neighbourhoods", rows);
		}
		group.guess = widest;
	}
	return GNP_OK;
}
