#include "core/search/neighborhoods.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

enum { BUCKETS_MIN = 64, BUCKETS_MAX = 1024 };

/* Sorts squared distances as gnp_neighbors_sort does, into other arrays, in linear time where it matters: on a
 * surface the squared distances of a ball's points are spread evenly, so equal buckets of them hold a few entries
 * each. largest: at least every square. */
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
			gnp_neighbors_sort(square_out + begin, index_out + begin, start[b] - begin);
}

static double distance_squared(const double *a, const double *b)
{
	double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
	return x * x + y * y + z * z;
}

/* --- the group: a few centres that share one search --- */

enum { MEMBERS = 12, CANDIDATES_MIN = 1024, CANDIDATES_MAX = 8192 };

/* Centres that are consecutive along the space-filling curve share nearly all their neighbours, so candidates come
 * from one search round their mean, and each centre filters them by its own distances. */
struct group {
	const struct gnp_neighbors *neighbors;
	const double *points;
	struct gnp_scratch *scratch;
	size_t k, most;
	double ratio;
	double guess;       /* r_k of the points just before, the first estimate of the next ones'; 0: there are none */
	double expected;    /* the radius of a row by that estimate */
	/* candidates */
	size_t count;
	double centre[3], reach; /* every point within reach of centre is a candidate */
	size_t capacity;         /* candidates there is room for */
	int *found;              /* (capacity) */
	double *x, *y, *z;       /* (capacity) */
	double *square;          /* (capacity) */
	double *near_square;     /* (capacity + 1) those within a first radius */
	uint32_t *near_index;
	/* the row being built */
	size_t length;
	double r_k;
	uint32_t *index;         /* (max(capacity, most) + 1) */
	double *distance;
};

static bool group_take(struct group *group)
{
	struct gnp_scratch *scratch = group->scratch;
	/* The group's ball has about twice the radius of a row's. */
	double expected = 8 * group->ratio * group->ratio * (double)group->k;
	group->capacity = (size_t)fmin(fmax(expected, CANDIDATES_MIN), CANDIDATES_MAX);
	size_t row = group->most > group->capacity ? group->most : group->capacity;
	group->found = gnp_scratch_take(scratch, group->capacity, sizeof(int));
	group->x = gnp_scratch_take(scratch, group->capacity, sizeof(double));
	group->y = gnp_scratch_take(scratch, group->capacity, sizeof(double));
	group->z = gnp_scratch_take(scratch, group->capacity, sizeof(double));
	group->square = gnp_scratch_take(scratch, group->capacity, sizeof(double));
	group->near_square = gnp_scratch_take(scratch, group->capacity + 1, sizeof(double));
	group->near_index = gnp_scratch_take(scratch, group->capacity + 1, sizeof(uint32_t));
	group->index = gnp_scratch_take(scratch, row + 1, sizeof(uint32_t));
	group->distance = gnp_scratch_take(scratch, row + 1, sizeof(double));
	return group->found && group->x && group->y && group->z && group->square && group->near_square &&
	       group->near_index && group->index && group->distance;
}

/* The mean of the members; returns the farthest of them from it. */
static double centre_group(struct group *group, const uint32_t *members, size_t count)
{
	double spread = 0;
	for (int c = 0; c < 3; c++) {
		double sum = 0;
		for (size_t m = 0; m < count; m++)
			sum += group->points[3 * (size_t)members[m] + c];
		group->centre[c] = sum / (double)count;
	}
	for (size_t m = 0; m < count; m++)
		spread = fmax(spread, distance_squared(group->points + 3 * (size_t)members[m], group->centre));
	return sqrt(spread);
}

/* Leaves none where one search cannot serve all members. */
static void group_gather(struct group *group, const uint32_t *members, size_t count)
{
	double spread = centre_group(group, members, count), radius = 1.12 * group->ratio * group->guess;
	group->expected = radius;
	group->count = 0;
	group->reach = -1;
	if (spread > 2 * radius) /* the curve jumped: the points do not share neighbours */
		return;
	size_t found = gnp_neighbors_candidates(group->neighbors, group->centre, spread + radius, group->capacity,
	                                        group->found, group->square);
	if (found == group->capacity) /* possibly cut short */
		return;
	group->count = found;
	group->reach = spread + radius;
	for (size_t j = 0; j < found; j++) {
		const double *p = group->points + 3 * (size_t)group->found[j];
		group->x[j] = p[0];
		group->y[j] = p[1];
		group->z[j] = p[2];
	}
}

/* Squared distances of all candidates from a place. */
static void measure_candidates(struct group *group, const double *place)
{
	double px = place[0], py = place[1], pz = place[2];
	const double *restrict x = group->x, *restrict y = group->y, *restrict z = group->z;
	double *restrict square = group->square;
	for (size_t j = 0; j < group->count; j++) {
		double dx = px - x[j], dy = py - y[j], dz = pz - z[j];
		square[j] = dx * dx + dy * dy + dz * dz;
	}
}

/* Those whose square is within the limit, into the arrays of near ones. */
static size_t pick_near(struct group *group, double limit)
{
	size_t near = 0;
	for (size_t j = 0; j < group->count; j++) {
		group->near_square[near] = group->square[j];
		group->near_index[near] = (uint32_t)group->found[j];
		near += group->square[j] <= limit;
	}
	return near;
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

/* The row from the candidates whose square is within the limit; false when those may not be all of its ball. */
static bool row_within(struct group *group, double limit)
{
	size_t near = pick_near(group, limit), count = 0;
	double *distance = group->distance;
	if (near < group->k)
		return false;
	sort_squares(group->near_square, group->near_index, near, limit, distance, group->index);
	group->r_k = sqrt(distance[group->k - 1]);
	double radius = group->ratio * group->r_k;
	if (radius * radius > limit * (1 - 1e-12))
		return false;
	while (count < near && count < group->most && (distance[count] = sqrt(distance[count])) <= radius)
		settle_tie(distance, group->index, count++);
	group->length = count;
	return true;
}

/* The row of point i from the group's candidates; false when they may not hold all of its ball. */
static bool row_from_candidates(struct group *group, size_t i)
{
	const double *p = group->points + 3 * i;
	double sure = group->reach - sqrt(distance_squared(p, group->centre)), all = sure * sure * (1 - 1e-12);
	if (sure <= 0 || group->count < group->k)
		return false;
	measure_candidates(group, p);
	/* Most rows end well inside what is sure: sort only what the estimate of their radius takes in, or else all. */
	return row_within(group, fmin(all, group->expected * group->expected)) || row_within(group, all);
}

/* The row of point i by searches of its own. */
static gnp_status row_from_search(struct group *group, size_t i, struct gnp_error *error)
{
	const double *p = group->points + 3 * i;
	gnp_status status = gnp_neighbors_knn(group->neighbors, p, 1, group->k, group->index, group->distance,
	                                      group->scratch, error);
	if (status != GNP_OK)
		return status;
	group->r_k = group->distance[group->k - 1];
	return gnp_neighbors_within(group->neighbors, p, group->ratio * group->r_k, group->most, group->index,
	                            group->distance, &group->length, group->scratch, error);
}

static gnp_status group_row(struct group *group, size_t i, struct gnp_error *error)
{
	return row_from_candidates(group, i) ? GNP_OK : row_from_search(group, i, error);
}

/* --- the rows --- */

/* The answer as it grows. */
struct rows {
	struct gnp_neighborhoods *out;
	size_t count;    /* rows so far */
	size_t capacity; /* entries there is room for */
	struct gnp_scratch *scratch;
};

static bool rows_take(struct rows *rows)
{
	struct gnp_neighborhoods *out = rows->out;
	out->start = gnp_scratch_take(rows->scratch, out->count + 1, sizeof *out->start);
	out->r_k = gnp_scratch_take(rows->scratch, out->count, sizeof *out->r_k);
	out->index = gnp_scratch_take(rows->scratch, rows->capacity, sizeof *out->index);
	out->distance = gnp_scratch_take(rows->scratch, rows->capacity, sizeof *out->distance);
	if (!out->start || !out->r_k || !out->index || !out->distance)
		return false;
	out->start[0] = 0;
	return true;
}

/* By doubling; what is outgrown stays in scratch. */
static bool rows_grow(struct rows *rows, size_t used, size_t need)
{
	struct gnp_neighborhoods *out = rows->out;
	uint32_t *index = gnp_scratch_take(rows->scratch, 2 * need, sizeof *index);
	double *distance = gnp_scratch_take(rows->scratch, 2 * need, sizeof *distance);
	if (!index || !distance)
		return false;
	memcpy(index, out->index, used * sizeof *index);
	memcpy(distance, out->distance, used * sizeof *distance);
	out->index = index;
	out->distance = distance;
	rows->capacity = 2 * need;
	return true;
}

/* Appends the row that the group has just built. */
static bool rows_append(struct rows *rows, const struct group *group)
{
	struct gnp_neighborhoods *out = rows->out;
	size_t used = out->start[rows->count], length = group->length;
	if (used + length > rows->capacity && !rows_grow(rows, used, used + length))
		return false;
	memcpy(out->index + used, group->index, length * sizeof *out->index);
	memcpy(out->distance + used, group->distance, length * sizeof *out->distance);
	out->r_k[rows->count] = group->r_k;
	out->start[++rows->count] = used + length;
	return true;
}

static gnp_status no_memory(size_t count, struct gnp_error *error)
{
	return gnp_error_set(error, GNP_OUT_OF_MEMORY, "neighbors: no memory for %zu neighbourhoods", count);
}

/* The rows of one group's centres. */
static gnp_status find_rows(struct group *group, const uint32_t *centres, size_t count, struct rows *rows,
                            struct gnp_error *error)
{
	gnp_status status = GNP_OK;
	double widest = 0;
	if (group->guess == 0) { /* nothing to go by yet */
		status = row_from_search(group, centres[0], error);
		group->guess = group->r_k;
	}
	if (status == GNP_OK)
		group_gather(group, centres, count);
	for (size_t c = 0; c < count && status == GNP_OK; c++) {
		status = group_row(group, centres[c], error);
		if (status == GNP_OK && !rows_append(rows, group))
			status = no_memory(rows->out->count, error);
		widest = fmax(widest, group->r_k);
	}
	group->guess = widest;
	return status;
}

gnp_status gnp_neighborhoods_find(const struct gnp_neighbors *neighbors, const uint32_t *centres, size_t count,
                                  size_t k, double ratio, size_t most, struct gnp_scratch *scratch,
                                  struct gnp_neighborhoods *out, struct gnp_error *error)
{
	size_t points = gnp_neighbors_count(neighbors);
	if (k < 1 || k > points || most < k)
		return gnp_error_set(error, GNP_INVALID_ARGUMENT, "k: got %zu, need 1..%zu", k, most < points ? most : points);
	struct group group = {.neighbors = neighbors, .points = gnp_neighbors_points(neighbors), .scratch = scratch,
	                      .k = k, .ratio = ratio, .most = most < points ? most : points};
	gnp_status status = gnp_neighbors_prepare(neighbors, group.most, error);
	if (status != GNP_OK)
		return status;
	struct rows rows = {.out = out, .scratch = scratch};
	rows.capacity = count * (size_t)fmin(1.3 * ratio * ratio * (double)k + 8, (double)group.most);
	*out = (struct gnp_neighborhoods){.count = count};
	if (!rows_take(&rows) || !group_take(&group))
		return no_memory(count, error);
	for (size_t first = 0; first < count && status == GNP_OK; first += MEMBERS)
		status = find_rows(&group, centres + first, count - first < MEMBERS ? count - first : MEMBERS, &rows, error);
	return status;
}
