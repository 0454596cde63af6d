#include "eliminate.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "memory.h"

/* A candidate, sorted by row (a square of the (y, z) plane, as wide as the reach), then by x. */
struct entry {
	float x[3];
	uint32_t index; /* the caller's */
};

struct elimination {
	size_t count, wanted;
	const float *points;
	float reach;    /* 2 r_max: candidates further apart do not see each other */
	float shortest; /* 2 r_min: closer ones count as this far */
	float low[3];
	size_t rows[2];        /* along y, z */
	size_t *row_start;     /* (rows[0] rows[1] + 1) */
	struct entry *entries; /* (count) */
	size_t *start;         /* (count + 1) rows of neighbour */
	uint32_t *neighbor;    /* (start[count]) positions in entries */
	float *weight;         /* (count) */
	uint32_t *heap;        /* (alive) positions in entries, the largest weight first */
	uint32_t *where;       /* (count) position in heap, GONE once eliminated */
	size_t alive;
};

static const uint32_t GONE = UINT32_MAX;

static void elimination_clear(struct elimination *e)
{
	free(e->row_start);
	free(e->entries);
	free(e->start);
	free(e->neighbor);
	free(e->weight);
	free(e->heap);
	free(e->where);
}

static gnp_status no_memory(const struct elimination *e, struct gnp_error *error)
{
	return gnp_error_set(error, GNP_OUT_OF_MEMORY, "sample: no memory to choose %zu of %zu candidates", e->wanted, e->count);
}

/* ---- Rows ---- */

static size_t row_of(const struct elimination *e, const float *x, size_t axis)
{
	size_t row = (size_t)((x[axis] - e->low[axis]) / e->reach);
	return row < e->rows[axis - 1] ? row : e->rows[axis - 1] - 1;
}

static size_t row_index(const struct elimination *e, const float *x)
{
	return row_of(e, x, 2) * e->rows[0] + row_of(e, x, 1);
}

static int entry_compare(const void *a, const void *b)
{
	const struct entry *p = a, *q = b;
	if (p->x[0] != q->x[0])
		return p->x[0] < q->x[0] ? -1 : 1;
	return p->index < q->index ? -1 : p->index > q->index;
}

static gnp_status rows_sort(void *context, size_t begin, size_t end, struct gnp_scratch *scratch, struct gnp_error *error)
{
	struct elimination *e = context;
	(void)scratch;
	(void)error;
	for (size_t row = begin; row < end; row++)
		qsort(e->entries + e->row_start[row], e->row_start[row + 1] - e->row_start[row], sizeof *e->entries, entry_compare);
	return GNP_OK;
}

static void bounds_find(struct elimination *e)
{
	float high[3];
	for (int c = 0; c < 3; c++) {
		e->low[c] = high[c] = e->points[c];
		for (size_t i = 1; i < e->count; i++) {
			e->low[c] = fminf(e->low[c], e->points[3 * i + (size_t)c]);
			high[c] = fmaxf(high[c], e->points[3 * i + (size_t)c]);
		}
	}
	for (int c = 0; c < 2; c++)
		e->rows[c] = (size_t)((high[c + 1] - e->low[c + 1]) / e->reach) + 1;
}

/* Counting sort into rows, then each row by x. */
static gnp_status entries_order(struct elimination *e, struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error)
{
	bounds_find(e);
	size_t rows = e->rows[0] * e->rows[1];
	e->row_start = gnp_array_zero(rows + 1, sizeof *e->row_start);
	e->entries = gnp_array_new(e->count, sizeof *e->entries);
	if (!e->row_start || !e->entries)
		return no_memory(e, error);
	for (size_t i = 0; i < e->count; i++)
		e->row_start[row_index(e, e->points + 3 * i)]++;
	for (size_t row = 0, sum = 0; row <= rows; row++) {
		sum += e->row_start[row];
		e->row_start[row] = sum; /* the row's end; filling from the back turns it into its start */
	}
	for (size_t i = e->count; i-- > 0;) {
		struct entry *entry = &e->entries[--e->row_start[row_index(e, e->points + 3 * i)]];
		memcpy(entry->x, e->points + 3 * i, sizeof entry->x);
		entry->index = (uint32_t)i;
	}
	return gnp_pool_run(pool, task, rows, 64, rows_sort, e, error);
}

/* ---- Neighbours and weights ---- */

/* First entry of a row with x >= value. */
static size_t row_lower(const struct elimination *e, size_t row, float value)
{
	size_t low = e->row_start[row], high = e->row_start[row + 1];
	while (low < high) {
		size_t middle = low + (high - low) / 2;
		if (e->entries[middle].x[0] < value)
			low = middle + 1;
		else
			high = middle;
	}
	return low;
}

static float distance(const float *a, const float *b)
{
	float x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
	return sqrtf(x * x + y * y + z * z);
}

/* Neighbours of entry i, written to list unless NULL; returns how many. */
static size_t neighbors_find(const struct elimination *e, size_t i, uint32_t *list)
{
	const float *x = e->entries[i].x;
	size_t y = row_of(e, x, 1), z = row_of(e, x, 2), found = 0;
	for (size_t w = z ? z - 1 : 0; w <= z + 1 && w < e->rows[1]; w++)
		for (size_t v = y ? y - 1 : 0; v <= y + 1 && v < e->rows[0]; v++) {
			size_t row = w * e->rows[0] + v, end = e->row_start[row + 1];
			for (size_t j = row_lower(e, row, x[0] - e->reach); j < end && e->entries[j].x[0] <= x[0] + e->reach; j++) {
				if (j == i || distance(x, e->entries[j].x) >= e->reach)
					continue;
				if (list)
					list[found] = (uint32_t)j;
				found++;
			}
		}
	return found;
}

/* (1 - d / 2 r_max)^8, symmetric in its points to the last bit. */
static float pair_weight(const struct elimination *e, size_t i, size_t j)
{
	float d = fmaxf(distance(e->entries[i].x, e->entries[j].x), e->shortest);
	float w = fmaxf(1 - d / e->reach, 0);
	w *= w;
	w *= w;
	return w * w;
}

static gnp_status neighbors_count(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                  struct gnp_error *error)
{
	struct elimination *e = context;
	(void)scratch;
	(void)error;
	for (size_t i = begin; i < end; i++)
		e->start[i + 1] = neighbors_find(e, i, NULL);
	return GNP_OK;
}

static gnp_status neighbors_fill(void *context, size_t begin, size_t end, struct gnp_scratch *scratch,
                                 struct gnp_error *error)
{
	struct elimination *e = context;
	(void)scratch;
	(void)error;
	for (size_t i = begin; i < end; i++) {
		neighbors_find(e, i, e->neighbor + e->start[i]);
		float sum = 0;
		for (size_t n = e->start[i]; n < e->start[i + 1]; n++)
			sum += pair_weight(e, i, e->neighbor[n]);
		e->weight[i] = sum;
	}
	return GNP_OK;
}

static gnp_status neighbors_list(struct elimination *e, struct gnp_pool *pool, struct gnp_task *task, struct gnp_error *error)
{
	enum { CHUNK = 4096 };
	e->start = gnp_array_new(e->count + 1, sizeof *e->start);
	e->weight = gnp_array_new(e->count, sizeof *e->weight);
	if (!e->start || !e->weight)
		return no_memory(e, error);
	e->start[0] = 0;
	gnp_status status = gnp_pool_run(pool, task, e->count, CHUNK, neighbors_count, e, error);
	if (status != GNP_OK)
		return status;
	for (size_t i = 0; i < e->count; i++)
		e->start[i + 1] += e->start[i];
	e->neighbor = gnp_array_new(e->start[e->count], sizeof *e->neighbor);
	if (!e->neighbor)
		return no_memory(e, error);
	return gnp_pool_run(pool, task, e->count, CHUNK, neighbors_fill, e, error);
}

/* ---- Heap: four children a node, half the depth of the usual two ---- */

static void heap_put(struct elimination *e, size_t at, uint32_t i)
{
	e->heap[at] = i;
	e->where[i] = (uint32_t)at;
}

/* Moves the entry at a node down to its place. */
static void heap_sink(struct elimination *e, size_t at)
{
	uint32_t i = e->heap[at];
	float weight = e->weight[i];
	for (;;) {
		size_t child = 4 * at + 1, last = child + 4 < e->alive ? child + 4 : e->alive, best = at;
		float most = weight;
		for (; child < last; child++)
			if (e->weight[e->heap[child]] > most) {
				most = e->weight[e->heap[child]];
				best = child;
			}
		if (best == at)
			break;
		heap_put(e, at, e->heap[best]);
		at = best;
	}
	heap_put(e, at, i);
}

static gnp_status heap_build(struct elimination *e, struct gnp_error *error)
{
	e->heap = gnp_array_new(e->count, sizeof *e->heap);
	e->where = gnp_array_new(e->count, sizeof *e->where);
	if (!e->heap || !e->where)
		return no_memory(e, error);
	e->alive = e->count;
	for (size_t i = 0; i < e->count; i++)
		heap_put(e, i, (uint32_t)i);
	for (size_t at = e->count / 4 + 1; at-- > 0;)
		if (at < e->count)
			heap_sink(e, at);
	return GNP_OK;
}

/* Takes the top away and relieves its neighbours. Weights only fall, so entries only sink; and the last entry of the heap
 * never weighs more than the top it replaces. */
static void heap_pop(struct elimination *e)
{
	uint32_t top = e->heap[0];
	e->where[top] = GONE;
	if (--e->alive > 0) {
		heap_put(e, 0, e->heap[e->alive]);
		heap_sink(e, 0);
	}
	for (size_t n = e->start[top]; n < e->start[top + 1]; n++) {
		uint32_t j = e->neighbor[n];
		if (e->where[j] == GONE)
			continue;
		e->weight[j] -= pair_weight(e, top, j);
		heap_sink(e, e->where[j]);
	}
}

static int index_compare(const void *a, const void *b)
{
	uint32_t p = *(const uint32_t *)a, q = *(const uint32_t *)b;
	return p < q ? -1 : p > q;
}

static gnp_status eliminate(struct elimination *e, struct gnp_task *task, uint32_t *kept, struct gnp_error *error)
{
	gnp_status status = heap_build(e, error);
	while (status == GNP_OK && e->alive > e->wanted) {
		heap_pop(e);
		if (e->alive % 4096 == 0)
			status = gnp_task_check(task, error);
	}
	if (status != GNP_OK)
		return status;
	for (size_t at = 0; at < e->alive; at++)
		kept[at] = e->entries[e->heap[at]].index;
	qsort(kept, e->wanted, sizeof *kept, index_compare);
	return GNP_OK;
}

gnp_status gnp_eliminate(const float *points, size_t count, size_t wanted, double area, struct gnp_pool *pool,
                         struct gnp_task *task, uint32_t *kept, struct gnp_error *error)
{
	struct elimination e = {.count = count, .wanted = wanted, .points = points};
	double r_max = sqrt(area / (2 * sqrt(3) * (double)wanted));
	double r_min = r_max * 0.65 * (1 - pow((double)wanted / (double)count, 1.5));
	e.reach = (float)(2 * r_max);
	e.shortest = (float)(2 * r_min);
	gnp_status status = entries_order(&e, pool, task, error);
	if (status == GNP_OK)
		status = neighbors_list(&e, pool, task, error);
	if (status == GNP_OK)
		status = eliminate(&e, task, kept, error);
	elimination_clear(&e);
	return status;
}
